"""The table [make] of a problem file: what a mould and the parts around the body are made with."""

from math import radians
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, Strict

from pneumorph import units
from pneumorph.problem.material import library
from pneumorph.problem.table import Quantity, Table


def _small(draft: float) -> float:
    if draft > radians(5.0):
        raise ValueError('is more than 5 deg; write e.g. "1 deg"')
    return draft


def _known(silicone: str) -> str:
    if silicone not in library():
        raise ValueError(f"is not a rubber of the library; choose one of {', '.join(library())}")
    return silicone


PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]
Clearance = Annotated[float, Quantity(units.LENGTH, "not negative")]
Draft = Annotated[float, Quantity(units.ANGLE, "not negative"), AfterValidator(_small)]
Number = Annotated[float, Strict()]
Silicone = Annotated[str, AfterValidator(_known)]


class FlangeSpec(Table):
    """The rubber flange at the base, which is clamped: its width beyond the body, and its thickness."""

    width: PositiveLength = 5.0
    """Width beyond the body."""
    thickness: PositiveLength = 3.0
    """Thickness."""


class PrinterSpec(Table):
    """The printer: the size of the largest part that it prints, and its thinnest wall."""

    volume: tuple[PositiveLength, PositiveLength, PositiveLength] = (220.0, 220.0, 250.0)
    """Largest part along x, y, z."""
    wall: PositiveLength = 0.8
    """Thinnest wall."""


class MakeSpec(Table):
    """How the body is made: in a mould, with a clamped flange at the base.

    The `method` "split mould" is a printed mould with one core for every chamber. With "silicone mould", parts of the
    body between planes along its axis are printed as masters, negatives are cast around them of the rubber `silicone`,
    and parts of rubber are cast in the negatives and glued; under its weight a negative may sag by `negative_sag`.
    `tube` is the outer diameter of the supply tubes; ports are 10 % narrower, so that tubes fit tightly. `mould_wall`
    is the least thickness of the mould, `clearance` the gap between parts that slide on each other. `shrinkage` is the
    relative shrinkage of the rubber as it cures. `draft` is the angle of faces that are not the rubber's: where plates
    embrace the outer mould, of stems inside plates, and of boxes around silicone. When a piece of the mould is pulled
    off, the rubber may be stretched up to `release_stretch`, and so may a silicone negative. `core_sag` is the largest
    lateral deflection of a core while the rubber is poured. `waste` is the fraction of rubber that stays in cups and
    channels. Tubes in the ports may change the motion of the tip by the fraction `port_effect`. Pieces larger than the
    `printer` makes them are split.
    """

    method: Literal["split mould", "silicone mould"] = "split mould"
    """The kind of mould."""
    tube: PositiveLength = 4.0
    """Outer diameter of the supply tubes; ports are 10 % narrower."""
    flange: FlangeSpec = FlangeSpec()
    """Rubber flange at the base."""
    mould_wall: PositiveLength = 6.0
    """Least thickness of the mould."""
    clearance: Clearance = 0.15
    """Gap between parts that slide on each other."""
    shrinkage: Annotated[Number, Field(ge=0, lt=0.2)] = 0.0
    """Relative shrinkage of the rubber as it cures."""
    draft: Draft = radians(1.0)
    """Draft of faces that do not touch the rubber; at most 5°."""
    release_stretch: Annotated[Number, Field(gt=1)] = 1.5
    """Largest stretch of the rubber when a piece is pulled off."""
    core_sag: PositiveLength = 0.1
    """Largest lateral deflection of a core."""
    silicone: Silicone = "Elastosil M4601"
    """Rubber of silicone moulds, a name of the library."""
    negative_sag: PositiveLength = 0.2
    """Largest displacement of a silicone negative by its weight."""
    waste: Annotated[Number, Field(ge=0, lt=5)] = 0.2
    """Fraction of rubber that remains in cups and channels."""
    port_effect: Annotated[Number, Field(gt=0)] = 0.1
    """Largest relative change of the motion by the tubes."""
    printer: PrinterSpec = PrinterSpec()
    """The printer of the mould."""
