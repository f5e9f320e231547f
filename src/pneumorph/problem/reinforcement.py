"""Thin reinforcements along surfaces of the body: the tables [[membrane]], strain-limiting layers, and [[fibres]]."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from pneumorph import units
from pneumorph.problem.models import MOST_CHAMBERS, Length, Name, Number
from pneumorph.problem.regions import Angle
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.problem.variable import Share, Variable
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import MIRRORS, NORMALS

if TYPE_CHECKING:
    from pneumorph.problem.whole import Problem

EXTERIOR = "exterior"
"""The name of the body's outer surface."""

MOST_REINFORCEMENTS = 20

PositiveStiffness = Annotated[float, Quantity(units.STIFFNESS, "positive")]

_EPS = 1e-9


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
    """Surfaces on which it lies: "exterior", or names of chambers; flat ends are not covered."""
    span: tuple[Length, Length] | None = None
    """Its extent along z; by default the whole surface."""
    angles: tuple[Angle, Angle] | None = None
    """Its extent around the axis of the surface, from x towards y; by default all around."""

    @property
    def words(self) -> str:
        """What it is and where, as it is written in the file; of what is designed, its value at the start."""
        joints = {"surfaces": ", ", "span": " to ", "angles": " to "}
        table = self.model_dump(mode="json", exclude={"name"}, exclude_none=True)
        for key, datum in data_of(self).items():
            number, *unit = str(datum.quantity.write(datum.start)).split(" ", 1)
            table[key] = " ".join([f"{float(number):.4g}", *unit])
        if table.get("coverage") == "1":
            del table["coverage"]
        parts = [f"{key} {joints[key].join(value) if key in joints else value}" for key, value in table.items()]
        return f'{self.kind} "{self.name}" ({", ".join(parts)})'

    @model_validator(mode="after")
    def _in_order(self) -> _Reinforcement:
        if self.span is not None and self.span[0] >= self.span[1]:
            raise InvalidKey("span", "does not rise; put the lower end first")
        if self.angles is not None and not 0.0 < self.angles[1] - self.angles[0] < 2.0 * math.pi - _EPS:
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
    wrinkling: Annotated[Number, Field(gt=0, le=1)] = 0.01
    """Compressive strain at which it wrinkles; its compressive force is below the stiffness times this strain."""


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
    buckling: Annotated[Number, Field(gt=0, le=1)] = 0.01
    """Compressive strain at which fibres buckle; their compressive force is below the stiffness times this strain."""

    @model_validator(mode="after")
    def _at_most_around(self) -> FibresSpec:
        if max(-self.winding.min, self.winding.max) > math.pi / 2.0 + _EPS:
            raise InvalidKey("winding", 'is beyond a right angle; write e.g. winding = "70 deg"')
        return self

    @property
    def handed(self) -> bool:
        """Whether a mirror image of them is another winding."""
        winding = self.winding
        return self.families == 1 and (winding.free or _EPS < abs(winding.start) < math.pi / 2.0 - _EPS)


Reinforcement = MembraneSpec | FibresSpec


def reinforcements(problem: Problem) -> tuple[Reinforcement, ...]:
    """All of a problem."""
    return (*problem.membrane, *problem.fibres)


def data_of(each: _Reinforcement) -> dict[str, Variable]:
    """What of one may be designed, by its key."""
    return {key: getattr(each, key) for key in DATA if hasattr(each, key)}


def designed(problem: Problem) -> dict[str, dict[str, Variable]]:
    """What is designed of the reinforcements of a problem: by their names, then by key."""
    found = {
        each.name: {key: datum for key, datum in data_of(each).items() if datum.free}
        for each in reinforcements(problem)
    }
    return {name: data for name, data in found.items() if data}


def starting_from(problem: Problem, values: Mapping[str, Mapping[str, float]]) -> Problem:
    """The problem with other values at the start of what is designed, by name and key, in N/mm, rad and 1."""

    def changed(each: Any) -> Any:
        data = data_of(each)
        return each.model_copy(
            update={
                key: data[key].model_copy(update={"start": value}) for key, value in values.get(each.name, {}).items()
            }
        )

    return problem.model_copy(
        update={"membrane": tuple(map(changed, problem.membrane)), "fibres": tuple(map(changed, problem.fibres))}
    )


def faults(problem: Problem) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with the reinforcements of a problem whose chambers are in order."""
    body, size = problem.body, problem.mesh.size
    known = {EXTERIOR: (body.radius, (0.0, body.length))}
    known |= {chamber.name: (chamber.radius, chamber.span) for chamber in body.chamber}
    names: list[str] = []
    for table in ("membrane", "fibres"):
        for index, each in enumerate(getattr(problem, table)):
            key = f"{table}[{index}]"
            if each.name in names:
                yield f"{key}.name", f'"{each.name}" is used twice; give each membrane and all fibres different names'
            names.append(each.name)
            for name in each.surfaces:
                if name == EXTERIOR and EXTERIOR in (chamber.name for chamber in body.chamber):
                    yield f"{key}.surfaces", f'"{EXTERIOR}" is a chamber too; give that another name'
                elif name not in known:
                    yield f"{key}.surfaces", f'there is no surface "{name}"; the surfaces are {", ".join(known)}'
                elif each.surfaces.count(name) > 1:
                    yield f"{key}.surfaces", f'has "{name}" twice; name each surface once'
                    break
                else:
                    yield from _part(key, each, name, *known[name], size)


def _part(
    key: str, each: Reinforcement, name: str, radius: float, span: tuple[float, float], size: float
) -> Iterator[tuple[str, str]]:
    if each.span is not None:
        start, end = each.span
        if start < span[0] - _EPS or end > span[1] + _EPS:
            yield f"{key}.span", f'reaches beyond "{name}" ({span[0]:g} to {span[1]:g} mm); make it shorter'
        elif end - start < size - _EPS:
            yield f"{key}.span", f"is shorter than mesh.size = {size:g} mm; make it longer or use a finer mesh"
    if each.angles is not None and (each.angles[1] - each.angles[0]) * radius < size:
        yield f"{key}.angles", f"cover less than mesh.size = {size:g} mm; change them or use a finer mesh"


def surrounds(problem: Problem) -> bool:
    """Whether every reinforcement goes all the way around."""
    return all(each.angles is None for each in reinforcements(problem))


def keeps(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every reinforcement to itself."""
    matrix = np.diag(np.array(MIRRORS[plane], float))
    chambers, length = problem.body.chamber, problem.body.length
    names = [chamber.name for chamber in chambers]
    for each in reinforcements(problem):
        if isinstance(each, FibresSpec) and each.handed:
            return False
        # The middle of the part lies in the plane through the axis of its surface.
        if each.angles is not None and abs((math.cos, math.sin)[NORMALS[plane]](sum(each.angles) / 2.0)) > 1e-6:
            return False
        on = [name for name in each.surfaces if name != EXTERIOR]
        images = [image(chambers, names.index(name), matrix, length) for name in on]
        if any(number is None or names[number] not in on for number in images):
            return False
    return True
