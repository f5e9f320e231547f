"""Thin reinforcements along surfaces of the body: the tables [[membrane]], strain-limiting layers, and [[fibres]]."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from pneumorph import units
from pneumorph.problem.directions import Direction
from pneumorph.problem.models import MOST_CHAMBERS, Length, Name, Number
from pneumorph.problem.regions import Angle
from pneumorph.problem.solid import Selection
from pneumorph.problem.table import ROUNDING, Example, InvalidKey, Quantity, Table
from pneumorph.problem.variable import Share, Variable

EXTERIOR = "exterior"
"""The name of the body's outer surface."""

MOST_REINFORCEMENTS = 20
"""Of a body."""

MOST_FACES = 100
"""Selections of faces on which one lies."""

PositiveStiffness = Annotated[float, Quantity(units.STIFFNESS, "positive")]


class Stiffness(Variable):
    """A stiffness per width in N/mm: fixed, or free between min and max and designed along with the shape."""

    quantity: ClassVar = Quantity(units.STIFFNESS, "positive")

    start: PositiveStiffness
    """Stiffness of the start."""
    min: Annotated[PositiveStiffness, Example('e.g. min = "5 N/mm"')]
    """Lower bound."""
    max: PositiveStiffness
    """Upper bound."""


class Winding(Variable):
    """A winding angle in rad: fixed, or free between min and max and designed along with the shape."""

    quantity: ClassVar = Quantity(units.ANGLE)

    start: Angle
    """Angle of the start."""
    min: Annotated[Angle, Example('e.g. min = "30 deg"')]
    """Lower bound."""
    max: Angle
    """Upper bound."""


_MOST_COMPRESSED = 0.01
"""The largest strain about which sheets wrinkle and fibres buckle by default."""

_THICKNESS = 0.1
"""Thickness in mm of a sheet whose wrinkling strain is not given."""

PositiveShare = Annotated[Number, Field(gt=0, le=1)]


class Coverage(Variable):
    """The covered fraction of a surface: fixed, or free between min and max and designed along with the shape."""

    quantity: ClassVar = Share()

    start: PositiveShare
    """Coverage at the start."""
    min: Annotated[PositiveShare, Example("e.g. min = 0.2")]
    """Lower bound."""
    max: PositiveShare
    """Upper bound."""


DATA = ("stiffness", "winding", "coverage")
"""The keys of a reinforcement that may be designed."""


class _Reinforcement(Table):
    kind: ClassVar[str]
    """What it is, in words."""

    name: Annotated[Name, Example('e.g. name = "paper"')]
    """Name in results and pictures."""
    surfaces: tuple[Name, ...] = Field(default=(EXTERIOR,), min_length=1, max_length=MOST_CHAMBERS)
    """Surfaces on which it lies: "exterior", or names of chambers; flat ends, base and tip are not covered."""
    on: Annotated[tuple[Selection, ...], Field(min_length=1, max_length=MOST_FACES)] | None = None
    """Of a body from a file: the faces on which it lies, in place of whole surfaces."""
    span: tuple[Length, Length] | None = None
    """Its extent along z; by default the whole surface."""
    angles: tuple[Angle, Angle] | None = None
    """Its extent around the axis of the surface, from x towards y; by default all around."""

    @property
    def words(self) -> str:
        """What it is and where, as it is written in the file; of what is designed, its value at the start."""
        joints = {"surfaces": ", ", "span": " to ", "angles": " to "}
        table = self.model_dump(mode="json", exclude={"name", "on"}, exclude_none=True)
        for key, datum in data_of(self).items():
            number, *unit = str(datum.quantity.write(datum.start)).split(" ", 1)
            table[key] = " ".join([f"{float(number):.4g}", *unit])
        if table.get("coverage") == "1":
            del table["coverage"]
        if self.on is not None:
            table["surfaces"] = [f"faces {each.where}" for each in self.on]
        parts = [f"{key} {joints[key].join(value) if key in joints else value}" for key, value in table.items()]
        return f'{self.kind} "{self.name}" ({", ".join(parts)})'

    @property
    def handed(self) -> bool:
        """Whether its mirror image is another one."""
        return False

    @model_validator(mode="after")
    def _in_order(self) -> _Reinforcement:
        if self.on is not None and self.surfaces != (EXTERIOR,):
            raise InvalidKey("on", "is given together with surfaces; leave one of them out")
        if self.span is not None and self.span[0] >= self.span[1]:
            raise InvalidKey("span", "does not rise; put the lower end first")
        if self.angles is not None and not 0.0 < self.angles[1] - self.angles[0] < 2.0 * math.pi - ROUNDING:
            raise InvalidKey("angles", 'must rise, by less than 360 deg; write e.g. angles = ["-90 deg", "90 deg"]')
        return self


class MembraneSpec(_Reinforcement):
    """A sheet of paper or fabric that is bonded to a surface: isotropic in its plane, without bending stiffness.

    Span and angles are those of the starting body; in every design the sheet moves with the surface.
    """

    kind: ClassVar = "a sheet"

    stiffness: Annotated[Stiffness, Example('e.g. stiffness = "200 N/mm", the modulus times the thickness')]
    """Young's modulus in its plane times its thickness; may be designed."""
    coverage: Coverage = Coverage(start=1.0, min=1.0, max=1.0)
    """Covered fraction of its part of the surface, for a sheet with strips or holes; may be designed."""
    poisson: Annotated[Number, Field(ge=0, lt=1)] = 0.3
    """Poisson's ratio in its plane."""
    wrinkling: Annotated[Number, Field(gt=0, le=1)] | None = None
    """Compressive strain at which it wrinkles; by default 0.01, or less if sheet or rubber would wrinkle before."""


class FibresSpec(_Reinforcement):
    """Fibres wound around a surface at an angle to its lines from base to tip, bonded to it.

    Angle and stiffness refer to the undeformed body of every design. Fibres only resist stretch along them.
    """

    kind: ClassVar = "fibres"

    stiffness: Annotated[Stiffness, Example('e.g. stiffness = "50 N/mm", E·A of a fibre over their distance')]
    """Of each family: Young's modulus times the cross-section of a fibre, over their distance; may be designed."""
    winding: Annotated[Winding, Example('e.g. winding = "70 deg"')]
    """Angle from the lines from base to tip, 90 deg around the tube; positive is right-handed; may be designed."""
    families: Literal[1, 2] = 2
    """2: fibres at plus and minus the angle; 1: at plus the angle only, which twists the body."""
    buckling: Annotated[Number, Field(gt=0, le=1)] | None = None
    """Compressive strain at which fibres buckle; by default 0.01, or less if the rubber would wrinkle before."""
    along: Direction | None = None
    """Of a body from a file: the direction, laid on the faces, in place of the lines from base to tip."""

    @model_validator(mode="after")
    def _at_most_around(self) -> FibresSpec:
        if max(-self.winding.min, self.winding.max) > math.pi / 2.0 + ROUNDING:
            raise InvalidKey("winding", 'is beyond a right angle; write e.g. winding = "70 deg"')
        return self

    @property
    def handed(self) -> bool:
        winding = self.winding
        return self.families == 1 and (winding.free or ROUNDING < abs(winding.start) < math.pi / 2.0 - ROUNDING)


Reinforcement = MembraneSpec | FibresSpec


def wrinkling_of(spec: MembraneSpec, shear_modulus: float, size: float) -> float:
    """The strain about which a sheet wrinkles, on rubber of a shear modulus in MPa with a mesh of a size in mm.

    If it is not given, ¼ (3 Ē_r/Ē_s)^(2/3) with the moduli in plane strain of the rubber and of a sheet 0.1 mm thick of
    the stiffness at the start (Allen 1969, Analysis and Design of Structural Sandwich Panels, ch. 8); no more than what
    the rubber supports.
    """
    if spec.wrinkling is not None:
        return spec.wrinkling
    sheet = spec.stiffness.start / _THICKNESS / (1 - spec.poisson**2)
    return min(_supported(spec, shear_modulus, size), 0.25 * (3 * 4 * shear_modulus / sheet) ** (2 / 3))


def buckling_of(spec: FibresSpec, shear_modulus: float, size: float) -> float:
    """The strain about which fibres buckle, like `wrinkling_of`: if it is not given, what the rubber supports."""
    return spec.buckling or _supported(spec, shear_modulus, size)


def _supported(spec: Reinforcement, shear_modulus: float, size: float) -> float:
    """The strain at which the compressive force is μh/π, or `_MOST_COMPRESSED` if that is less.

    A rubber half-space supports what lies on it against waves of length h, the shortest on a mesh of that size, up to
    this force per width: against the wave w cos(2πx/h) it presses with 4πμw/h (Biot 1965, Mechanics of Incremental
    Deformations). Under more, the mesh would wrinkle, though wrinkles are in the energy of the sheet already.
    """
    return min(_MOST_COMPRESSED, shear_modulus * size / math.pi / spec.stiffness.start)


def data_of(each: _Reinforcement) -> dict[str, Variable]:
    """What of one may be designed, by its key."""
    return {key: getattr(each, key) for key in DATA if hasattr(each, key)}
