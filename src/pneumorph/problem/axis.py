"""Axes of tubes that are not straight: arcs and straight pieces, each of which goes on in the direction of the last."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph import units
from pneumorph.problem.outline import Outline
from pneumorph.problem.table import Quantity, Table

Array = NDArray[np.float64]


class Arc(Table):
    """A piece of the axis of a body: an arc of a circle, or a straight line."""

    length: Annotated[float, Quantity(units.LENGTH, "positive")]
    """Length of the piece."""
    bend: Annotated[float, Quantity(units.ANGLE, "not negative")] = 0.0
    """Angle by which the axis turns along it; 0 is a straight line."""
    towards: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Direction to which it bends, about the axis from x, counter-clockwise seen from the tip."""

    @property
    def curvature(self) -> float:
        """1 / radius, 1/mm."""
        return self.bend / self.length

    @property
    def inwards(self) -> Array:
        """Unit vector (2,) in the cross-section to the side that it bends to."""
        return np.array([math.cos(self.towards), math.sin(self.towards)])

    def at(self, length: ArrayLike) -> tuple[Array, Array]:
        """Places (n, 3) at lengths (n,) from its beginning, and the rotations (n, 3, 3) of the cross-section there.

        Both are relative to its beginning, which goes along z.
        """
        length = np.asarray(length, dtype=float)
        angle = self.curvature * length
        # (1 - cos φ)/φ and sin(φ)/φ, for straight lines too.
        along, across = length * np.sinc(angle / np.pi), length * angle / 2.0 * np.sinc(angle / (2.0 * np.pi)) ** 2
        places = np.column_stack([across[:, None] * self.inwards, along])
        x, y = self.inwards
        sideways = np.array([-y, x, 0.0])  # the axis of the rotation
        skew = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
        sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
        turns = cosine * np.eye(3) + sine * skew + (1.0 - cosine) * np.outer(sideways, sideways)
        return places, turns

    def coordinates(self, place: Array) -> tuple[float, float, float]:
        """x and y in the cross-section, and the length from the beginning, of the nearest place on it; see `at`."""
        if not self.bend:
            return float(place[0]), float(place[1]), float(place[2])
        radius, (x, y) = self.length / self.bend, self.inwards
        out, aside = radius - float(place[:2] @ self.inwards), float(x * place[1] - y * place[0])
        inwards, angle = radius - math.hypot(out, place[2]), math.atan2(place[2], out) % (2.0 * math.pi)
        return inwards * x - aside * y, inwards * y + aside * x, radius * angle


@dataclass(frozen=True)
class Axis:
    """The line along which the cross-sections of a body lie; it begins in the origin along z.

    Cross-sections are carried along without turning about it.

    Attributes
    ----------
    arcs : sequence of Arc
    """

    arcs: Sequence[Arc]

    @property
    def length(self) -> float:
        """mm."""
        return math.fsum(arc.length for arc in self.arcs)

    @cached_property
    def _beginnings(self) -> list[tuple[float, Array, Array]]:
        """Length, place (3,) and rotation (3, 3) where each arc begins, and at the end of the last one."""
        found = [(0.0, np.zeros(3), np.eye(3))]
        for arc in self.arcs:
            length, place, turn = found[-1]
            (along,), (onwards,) = arc.at([arc.length])
            found.append((length + arc.length, place + turn @ along, turn @ onwards))
        return found

    def at(self, length: ArrayLike) -> tuple[Array, Array]:
        """Places (n, 3) in mm at lengths (n,) from the base, and rotations (n, 3, 3) of the cross-sections there."""
        length = np.asarray(length, dtype=float)
        starts = np.array([start for start, _, _ in self._beginnings[1:-1]])
        piece = np.searchsorted(starts, length, side="right")
        places, turns = np.empty((len(length), 3)), np.empty((len(length), 3, 3))
        for number, (arc, (start, place, turn)) in enumerate(zip(self.arcs, self._beginnings, strict=False)):
            here = piece == number
            along, onwards = arc.at(length[here] - start)
            places[here], turns[here] = place + along @ turn.T, turn @ onwards
        return places, turns

    def coordinates(self, place: Array) -> Iterator[tuple[float, float, float]]:
        """x and y in the cross-section, and the length from the base, where cross-sections contain a place (3,)."""
        for arc, (start, begins, turn) in zip(self.arcs, self._beginnings, strict=False):
            x, y, along = arc.coordinates((place - begins) @ turn)
            if 0.0 <= along <= arc.length:
                yield x, y, start + along

    def shrinks(self, outline: Outline) -> float:
        """By what share lines along a tube of this outline about it are shorter than the axis, at most; 1 is a cusp."""
        return max(float((outline.points @ arc.inwards).max()) * arc.curvature for arc in self.arcs)

    def bends(self, outline: Outline) -> float:
        """The largest curvature along a tube of this outline about it, 1/mm; a very large one at a cusp."""
        inside = ((arc.curvature, float((outline.points @ arc.inwards).max())) for arc in self.arcs)
        return max(curvature / max(1.0 - curvature * reach, 1e-9) for curvature, reach in inside)
