"""Cross-sections of tubes that are not circles: their tables in a problem file, and what outlines these describe."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict, Tag, model_validator

from pneumorph import units
from pneumorph.problem.kinds import by_kind, known
from pneumorph.problem.outline import SAME, Outline, arc, area, centroid, crosses_itself, directions, rounded
from pneumorph.problem.table import TAG, Example, InvalidKey, Quantity, Table

Array = NDArray[np.float64]
Length = Annotated[float, Quantity(units.LENGTH)]
PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]


class _Section(Table):
    turn: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Rotation of the section about the tube's axis, counter-clockwise seen from the tip."""

    @abstractmethod
    def polygon(self) -> Array:
        """The section before it is turned, as a fine closed polygon (n, 2) about the tube's axis, mm."""

    @property
    def anchor(self) -> float:
        """Direction, before the turn, in which lengths along the outline begin: on a mirror axis if it has one."""
        return 0.0

    @cached_property
    def outline(self) -> Outline:
        """The outline of the section."""
        return Outline.of(self.polygon(), self.anchor, self.turn)

    @model_validator(mode="after")
    def _has_an_outline(self) -> _Section:
        # Corners that do not fit are found here, so that the fault has the key of the section.
        assert self.outline.length > 0.0
        return self

    def turned(self, angle: float) -> _Section:
        """The section rotated by an angle about the tube's axis, rad."""
        # A copy of the model would have this one's outline.
        if not angle:
            return self
        keys: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        keys["turn"] += angle
        return type(self).model_construct(None, **keys)


class Ellipse(_Section):
    """An ellipse."""

    kind: Literal["ellipse"]
    """The kind of section."""
    width: PositiveLength
    """Its whole size along x."""
    depth: PositiveLength
    """Its whole size along y."""

    def polygon(self) -> Array:
        return arc([0.0, 0.0], 1.0, 0.0, 2.0 * math.pi)[:-1] * [self.width / 2.0, self.depth / 2.0]


class Rectangle(_Section):
    """A rectangle with rounded corners."""

    kind: Literal["rectangle"]
    """The kind of section."""
    width: PositiveLength
    """Its whole size along x."""
    depth: PositiveLength
    """Its whole size along y."""
    corner: PositiveLength
    """Radius of its corners."""

    def polygon(self) -> Array:
        x, y = self.width / 2.0, self.depth / 2.0
        return rounded(np.array([[x, -y], [x, y], [-x, y], [-x, -y]]), self.corner)


class RegularPolygon(_Section):
    """A regular polygon with rounded corners; one of its corners is on the x axis."""

    kind: Literal["polygon"]
    """The kind of section."""
    sides: Annotated[int, Strict(), Field(ge=3, le=12)]
    """Number of its sides."""
    inner_radius: PositiveLength
    """Radius of the circle that touches all its sides."""
    corner: PositiveLength
    """Radius of its corners."""

    def polygon(self) -> Array:
        angle = 2.0 * np.pi * np.arange(self.sides) / self.sides
        return rounded(self.inner_radius / math.cos(math.pi / self.sides) * directions(angle), self.corner)


class HalfRound(_Section):
    """Half a disc with rounded corners: its flat side faces -x, and its centroid is on the tube's axis."""

    kind: Literal["half-round"]
    """The kind of section."""
    round_radius: PositiveLength
    """Radius of its round side, half the width of the flat one."""
    corner: PositiveLength
    """Radius of its two corners."""

    def polygon(self) -> Array:
        large, small = self.round_radius, self.corner
        if small > 0.45 * large:
            raise InvalidKey("corner", f"{small:g} mm does not fit; use at most {0.45 * large:.4g} mm")
        # The circle of a corner touches the flat side, x = 0, and the round one from within.
        height = math.sqrt((large - small) ** 2 - small**2)
        end = math.atan2(height, small)
        corner = arc([small, height], small, end, math.pi)
        below = (corner * [1.0, -1.0])[::-1]
        points = np.concatenate([arc([0.0, 0.0], large, -end, end), corner[1:], below[:-1]])
        return points - [centroid(points)[0], 0.0]


class Points(_Section):
    """A closed polygon of your own with rounded corners, such as a cross or a star."""

    kind: Literal["points"]
    """The kind of section."""
    points: Annotated[
        tuple[tuple[Length, Length], ...],
        Field(min_length=3, max_length=200),
        Example('e.g. points = [["8 mm", "-5 mm"], ["8 mm", "5 mm"], ["-8 mm", "0 mm"]]'),
    ]
    """Its corners in their order, x and y from the tube's axis."""
    corner: PositiveLength
    """Radius of its corners."""

    @property
    def anchor(self) -> float:
        def even(signs: list[float]) -> bool:
            apart = np.linalg.norm(self._corners[:, None] - self._corners * signs, axis=2)
            return bool((apart.min(axis=1) < SAME).all())

        return -math.pi / 2.0 if even([-1.0, 1.0]) and not even([1.0, -1.0]) else 0.0

    @property
    def _corners(self) -> Array:
        points = np.array(self.points)
        return points if area(points) > 0.0 else points[::-1]

    def polygon(self) -> Array:
        points = self._corners
        if np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).min() < SAME:
            raise InvalidKey("points", "have the same place twice in a row; leave one of them out")
        if crosses_itself(points):
            raise InvalidKey("points", "give sides that cross each other; put them in their order around the section")
        return rounded(points, self.corner)


_Tables = (
    Annotated[Ellipse, Tag(TAG + "ellipse")]
    | Annotated[Rectangle, Tag(TAG + "rectangle")]
    | Annotated[RegularPolygon, Tag(TAG + "polygon")]
    | Annotated[HalfRound, Tag(TAG + "half-round")]
    | Annotated[Points, Tag(TAG + "points")]
)
KINDS = ("ellipse", "rectangle", "polygon", "half-round", "points")


_INSTEAD = ", or for a circle radius in place of section"
Section = Annotated[_Tables, by_kind(), known(KINDS, "section", instead=_INSTEAD)]
