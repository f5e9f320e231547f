"""The tables [[region]]: parts of the body that are made of another rubber, each with its material and its shape."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from pneumorph import units
from pneumorph.problem.material import Material
from pneumorph.problem.models import MOST_CHAMBERS, Length, PositiveLength
from pneumorph.problem.names import Name
from pneumorph.problem.table import ROUNDING, Example, InvalidKey, Quantity, Table

REST = "body"
"""The name of what is in no region, and made of [material]."""

MOST_REGIONS = 20
"""Of a body."""

Angle = Annotated[float, Quantity(units.ANGLE)]


class Layer(Table):
    """A layer under the exterior: all around and along it, or its part between two heights and two angles.

    It is bounded inside by the exterior moved inwards by the thickness. Heights and angles are those of the starting
    body; in every design the layer moves with the exterior.
    """

    thickness: PositiveLength
    """Thickness, less than limits.wall."""
    span: tuple[Length, Length] | None = None
    """Its extent along z; by default the whole body."""
    angles: tuple[Angle, Angle] | None = None
    """Its extent around the axis, from x towards y; by default all around."""

    @model_validator(mode="after")
    def _in_order(self) -> Layer:
        if self.span is not None and self.span[0] >= self.span[1]:
            raise InvalidKey("span", "does not rise; put the lower end first")
        _rising("angles", self.angles)
        return self


class Sleeve(Table):
    """A layer all around chambers, including their ends."""

    thickness: PositiveLength
    """Thickness, less than limits.wall."""
    chambers: Annotated[tuple[Name, ...], Example('chambers = ["A"]')] = Field(min_length=1, max_length=MOST_CHAMBERS)
    """Names of the chambers."""


def _rising(key: str, angles: tuple[float, float] | None) -> None:
    if angles is not None and not 0.0 < angles[1] - angles[0] < 2.0 * math.pi - ROUNDING:
        raise InvalidKey(key, f'must rise, by less than 360 deg; write e.g. {key} = ["-60 deg", "60 deg"]')


class Region(Table):
    """A part of the body that is made of another rubber than [material].

    A layer, sleeves, the part beyond a plane, the part within an angle, or a solid of a file.
    """

    name: Annotated[Name, Example('e.g. name = "skin"')]
    """Name in results."""
    material: Annotated[Material, Example('material = { name = "Hei-Cast 8400" }')]
    """Its rubber, like the table [material]."""
    layer: Layer | None = None
    """Under the exterior."""
    sleeve: Sleeve | None = None
    """Around chambers."""
    beyond: PositiveLength | None = None
    """All rubber above this height along the axis, up to the next such region or the tip; the plane is fixed."""

    within: tuple[Angle, Angle] | None = None
    """All rubber between two angles around the axis, from x towards y; the half-planes are fixed."""

    inside: tuple[Length, Length, Length] | None = None
    """Of a body from a file of several solids: a point in the one that is made of this rubber."""

    @model_validator(mode="after")
    def _one_shape(self) -> Region:
        if sum(shape is not None for shape in (self.layer, self.sleeve, self.beyond, self.within, self.inside)) != 1:
            raise InvalidKey("layer", "sleeve, beyond, within and inside are the shapes of a region; give one of them")
        _rising("within", self.within)
        return self

    @property
    def thickness(self) -> float:
        """Its thickness, mm; 0 beyond a plane or within an angle."""
        shape = self.layer or self.sleeve
        return 0.0 if shape is None else shape.thickness
