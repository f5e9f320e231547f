"""The tables of a problem file as frozen models: body, end-effector, gravity, tasks, limits, mesh and optimiser.

Field names are the keys of the file. After reading, every quantity is a float in mm, N, MPa, t, s, rad.
"""

import math
import warnings
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, Strict, TypeAdapter, ValidationError, model_validator
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.errors import Renamed
from pneumorph.problem.components import COMPONENT_OF, Component, renamed
from pneumorph.problem.directions import Direction, Number, unit_vector
from pneumorph.problem.envelope import Envelope
from pneumorph.problem.names import Name
from pneumorph.problem.objectives import ObjectiveSpec
from pneumorph.problem.objectives.table import RotationVector
from pneumorph.problem.outline import Outline, arc
from pneumorph.problem.section import Section
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.problem.variable import Variable
from pneumorph.symmetry.images import WITHIN, snapped
from pneumorph.symmetry.part import MOST_TURNS

RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{port}{number}" for port in ("COM", "LPT") for number in range(1, 10))}
"""Names of devices on Windows, which no file there can have."""

MOST_CHAMBERS, MOST_TASKS, MOST_OBSTACLES = 100, 50, 20
"""Of a problem: every chamber is compared with every other, every task is an equilibrium of its own."""

Length = Annotated[float, Quantity(units.LENGTH)]
PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]
Curvature = Annotated[float, Quantity(units.CURVATURE, "positive")]
GaugePressure = Annotated[float, Quantity(units.PRESSURE)]
Stiffness = Annotated[float, Quantity(units.STIFFNESS, "not negative")]
RotationalStiffness = Annotated[float, Quantity(units.ROTATIONAL_STIFFNESS, "not negative")]
Force = Annotated[float, Quantity(units.FORCE)]
Moment = Annotated[float, Quantity(units.MOMENT)]
Whole = Annotated[int, Strict()]
_SECTION: TypeAdapter[Section] = TypeAdapter(Section)


class Ripple(Table):
    """Sinusoidal variation of the starting radii along z; with lobes it winds around the axis as a helix.

    Negative lobes wind the opposite way. A plain tube, with or without rings, is its own mirror image, so it does not
    twist, and no small change of shape has a first-order effect on twist: start a twisting actuator from a helix.
    """

    amplitude: PositiveLength
    """Largest deviation of the radii from the mean."""
    period: PositiveLength
    """Distance of successive waves along z."""
    lobes: Annotated[Whole, Field(ge=-12, le=12)] = 0
    """Number of waves around the axis; 0 gives rings, other numbers helices."""


class Symmetry(Table):
    """Symmetries of the shape in every design.

    The mirror planes xz and yz contain the axis, xy cuts the body at half its length. `rotation` is the order of the
    rotational symmetry about z. The point symmetry, and the half turn about x or y, are about the body's centre.
    """

    mirror: Annotated[tuple[Literal["xz", "yz", "xy"], ...], Field(max_length=3)] = ()
    """Mirror planes."""
    rotation: Annotated[Whole, Field(ge=1, le=MOST_TURNS)] = 1
    """Order of the rotational symmetry about z; 1 is none."""
    point: Annotated[bool, Strict()] = False
    """Whether the shape is point symmetric about its centre."""
    half_turn: Literal["x", "y"] | None = None
    """Axis of a half turn about the centre."""


class _Tube(Table):
    """What the tables of tubes have in common: a cylinder, or a prism of another section, that may be tapered."""

    if TYPE_CHECKING:
        radius: float
        section: Section | None
        taper: float

    @model_validator(mode="before")
    @classmethod
    def _radius_of_the_section(cls, data: Any) -> Any:
        """The radius follows from a section; a file that is written has both."""
        if not isinstance(data, dict) or data.get("section") is None:
            return data
        section = data["section"]
        try:
            outline = _SECTION.validate_python(section).outline
        except ValidationError:
            return {"radius": "1 mm"} | data  # reported with the key of the section
        reach = Quantity(units.LENGTH).write(outline.reach)
        given = data.get("radius", reach)
        if abs((Quantity(units.LENGTH).read(given) if isinstance(given, str) else given) - outline.reach) > WITHIN:
            raise InvalidKey(
                "radius", f"is not {outline.reach:g} mm, that of the circle around the section; leave it out"
            )
        return {"radius": reach} | data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        described = handler(schema)
        own = handler.resolve_ref_schema(described)
        own["required"] = [key for key in own["required"] if key != "radius"]
        own["anyOf"] = [{"required": ["radius"]}, {"required": ["section"]}]
        return described

    @property
    def outline(self) -> Outline:
        """The cross-section at the base's end, about the tube's own axis."""
        return self.section.outline if self.section else Outline(arc([0.0, 0.0], self.radius, 0.0, 2.0 * math.pi)[:-1])

    @property
    def round(self) -> bool:
        """Whether it is a cylinder."""
        return self.section is None and self.taper == 1.0

    @property
    def mean_radius(self) -> float:
        """Radius of the circle as long as its outline, mm."""
        return self.section.outline.length / (2.0 * math.pi) if self.section else self.radius

    @property
    def area(self) -> float:
        """Mean area of its cross-sections, mm²."""
        area = self.section.outline.area if self.section else math.pi * self.radius**2
        return area * (1.0 + self.taper + self.taper**2) / 3.0

    @property
    def least_radius(self) -> float:
        """Least radius of curvature of its cross-sections, mm."""
        return min(1.0, self.taper) * (1.0 / self.section.outline.curvature if self.section else self.radius)


class ChamberSpec(_Tube):
    """A starting chamber: a tube parallel to z, with flat or hemispherical ends."""

    name: Annotated[Name, Example('e.g. name = "A"')]
    """Name of the chamber in tasks and results."""
    radius: PositiveLength
    """Radius of the cylinder, or of the circle around its section; leave it out where there is a section."""
    section: Section | None = None
    """Cross-section, where it is no circle: ellipse, rectangle, polygon, half-round or points."""
    taper: Annotated[Number, Field(ge=0.2, le=5)] = 1.0
    """Size of the cross-section at the tip's end relative to that at the base's; between them it changes linearly."""
    center: Annotated[tuple[Length, Length], Example('e.g. center = ["0 mm", "0 mm"]')]
    """Position of its axis in x and y."""
    span: Annotated[tuple[Length, Length], Example('e.g. span = ["3 mm", "77 mm"]')]
    """Its extent along z."""
    ends: Literal["flat", "pole"] = "flat"
    """Flat ends, or hemispheres that close in a pole."""
    ripple: Ripple | None = None
    """Initial ripple of this chamber, instead of the body's."""
    copies: Annotated[Whole, Field(ge=1, le=24)] = 1
    """Number of such chambers around the body's axis, equally spaced; copies of "A" are named A1, A2, …"""

    @model_validator(mode="after")
    def _copies_are_apart(self) -> "ChamberSpec":
        if self.copies > 1 and math.hypot(*self.center) < WITHIN:
            raise InvalidKey("copies", "would all be in one place; move center away from the body's axis")
        return self

    def all_copies(self) -> "list[ChamberSpec]":
        """This chamber and its copies around the axis, numbered from 1; the chamber itself if it is alone."""
        if self.copies == 1:
            return [self]
        (x, y), angles = self.center, [2.0 * math.pi * number / self.copies for number in range(self.copies)]
        centers = [(x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)) for a in angles]
        sections = [self.section and self.section.turned(a) for a in angles]
        return [
            self.model_copy(update={"name": f"{self.name}{number}", "center": center, "copies": 1, "section": section})
            for number, (center, section) in enumerate(zip(centers, sections, strict=True), 1)
        ]

    def is_image_of(self, other: "ChamberSpec", matrix: np.ndarray) -> bool:
        """Whether its ends and its cross-section are those of another chamber's image, see `symmetry.images.image`."""
        if self.ends != other.ends or (
            (self.taper, other.taper) != (1.0, 1.0) and self.taper != other.taper ** matrix[2, 2]
        ):
            return False
        return (self.section is other.section is None) or self.outline.is_image_of(other.outline, matrix)

    def at(self, place: np.ndarray) -> "ChamberSpec":
        """The chamber at another centre, span and radius (5,), see `symmetry.images.place`."""
        x, y, start, end, radius = place.tolist()
        return self.model_copy(update={"center": (x, y), "span": (start, end), "radius": radius})


class BodySpec(_Tube):
    """The starting body: a tube from z = 0 to z = length with chambers in it; control_density in 1/mm."""

    length: PositiveLength
    """Length of the body, constant in all designs."""
    radius: PositiveLength
    """Radius of the cylinder, or of the circle around its section; leave it out where there is a section."""
    section: Section | None = None
    """Cross-section, where it is no circle: ellipse, rectangle, polygon, half-round or points."""
    taper: Annotated[Number, Field(ge=0.2, le=5)] = 1.0
    """Size of the cross-section at the tip's end relative to that at the base's; between them it changes linearly."""
    control_density: Annotated[float, Quantity(units.PER_LENGTH, "positive")] = 0.6
    """Control points per length, around and along."""
    ripple: Ripple | None = None
    """Initial ripple of the exterior and of chambers without their own."""
    symmetry: Symmetry = Symmetry()
    """Symmetries of every design."""
    chamber: Annotated[tuple[ChamberSpec, ...], Example("a table [[body.chamber]]")] = Field(
        min_length=1, max_length=MOST_CHAMBERS
    )
    """The chambers, each a table [[body.chamber]]."""

    @model_validator(mode="after")
    def _all_chambers_in_their_places(self) -> "BodySpec":
        chambers = [each for chamber in self.chamber for each in chamber.all_copies()]
        places = snapped(chambers, self.symmetry, self.length)
        object.__setattr__(self, "chamber", tuple(map(ChamberSpec.at, chambers, places)))
        return self

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The centres (3,) of base and tip, mm."""
        return np.zeros(3), np.array([0.0, 0.0, self.length])

    def across(self, normal: np.ndarray) -> list[tuple[float, float]]:
        """From where to where each chamber is along a normal (3,) across the axis, mm."""
        middles = [float(np.dot([*chamber.center, 0.0], normal)) for chamber in self.chamber]
        return [(at - each.radius, at + each.radius) for at, each in zip(middles, self.chamber, strict=True)]

    def ripple_of(self, chamber: ChamberSpec) -> Ripple | None:
        """The ripple a chamber starts with: its own or, if it has none, the body's."""
        return chamber.ripple or self.ripple


class Spring(Table):
    """Springs between the end-effector and the ground: N/mm along x, y, z and N·mm/rad about x, y, z.

    `axial` may also be written `extension`, and `torsion` `twist`.
    """

    shift_x: Stiffness = 0.0
    """Stiffness against motion along x."""
    shift_y: Stiffness = 0.0
    """Stiffness against motion along y."""
    axial: Stiffness = 0.0
    """Stiffness against motion along z."""
    bending_x: RotationalStiffness = 0.0
    """Stiffness against rotation about x."""
    bending_y: RotationalStiffness = 0.0
    """Stiffness against rotation about y."""
    torsion: RotationalStiffness = 0.0
    """Stiffness against rotation about z."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_motions(cls, data: Any) -> Any:
        return renamed(data, COMPONENT_OF)


class EndEffector(Table):
    """What the tip carries: a rigid plate with springs, a force (N) and a moment (N·mm), or nothing ("free").

    `hold` lists motions of the plate that a guide prevents; "axial" may also be written "extension", "torsion" "twist".
    """

    kind: Literal["plate", "free"] = "plate"
    """A rigid plate that is bonded to the tip, or a free tip."""
    spring: Spring = Spring()
    """Springs from the plate to the ground."""
    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    """Dead force on the plate: x, y, z."""
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    """Moment on the plate about x, y, z."""
    hold: Annotated[tuple[Component, ...], Field(max_length=12)] = ()
    """Motions of the plate that a guide blocks."""

    @model_validator(mode="after")
    def _nothing_on_a_free_tip(self) -> "EndEffector":
        for key in ("spring", "force", "moment", "hold"):
            if self.kind == "free" and getattr(self, key) != type(self).model_fields[key].default:
                raise InvalidKey(key, f'needs a plate, but the tip is free; use kind = "plate" or leave {key} out')
        return self


class Gravity(Table):
    """Acceleration in mm/s², and its direction, which is normalised."""

    acceleration: Annotated[float, Quantity(units.ACCELERATION, "not negative")] = units.STANDARD_GRAVITY
    """Magnitude of the acceleration."""
    direction: Annotated[Direction, Example("e.g. direction = [0, 0, -1]")]
    """Its direction, of any length; the body's axis is z, from the base to the tip."""

    @model_validator(mode="after")
    def _unit_direction(self) -> "Gravity":
        object.__setattr__(self, "direction", unit_vector("direction", self.direction))
        return self


class Pressure(Variable):
    """The gauge pressure of a chamber in MPa: fixed, or free between min and max and designed along with the shape."""

    quantity: ClassVar = Quantity(units.PRESSURE)

    start: GaugePressure
    """Pressure of the start."""
    min: Annotated[GaugePressure, Example('e.g. min = "0 kPa"')]
    """Lower bound; negative is vacuum."""
    max: GaugePressure
    """Upper bound."""


class Task(Table):
    """One task: the pressures of the chambers, and an objective."""

    name: Annotated[Name, Example('e.g. name = "extend"')]
    """By which results name the task."""
    weight: Annotated[Number, Field(gt=0)] = 1.0
    """Factor of its objective in the sum over tasks."""
    pressure: Annotated[
        dict[Name, Pressure], Field(max_length=MOST_CHAMBERS), Example('e.g. pressure = { A = "60 kPa" }')
    ]
    """Gauge pressure of each chamber; 0 for a chamber without an entry."""
    move: (
        Annotated[
            dict[Name, tuple[Length, Length, Length]],
            Field(max_length=MOST_OBSTACLES),
            Example('e.g. move = { plate = ["0 mm", "0 mm", "-3 mm"] }'),
        ]
        | None
    ) = None
    """Displacements of obstacles from their original positions: x, y, z; also into the space of the body at rest."""
    turn: (
        Annotated[
            dict[Name, RotationVector],
            Field(max_length=MOST_OBSTACLES),
            Example('e.g. turn = { plate = ["0 deg", "0 deg", "30 deg"] }'),
        ]
        | None
    ) = None
    """Rotation vectors of obstacles, about the centre, point or position of each."""
    objective: Annotated[ObjectiveSpec, Example('e.g. objective = { kind = "maximize", motion = "extension" }')]
    """The objective of the shape and the free pressures."""

    @property
    def moves(self) -> dict[str, tuple[float, float, float]]:
        """Displacements of obstacles in mm; the others are not displaced."""
        return self.move or {}

    @property
    def turns(self) -> dict[str, tuple[float, float, float]]:
        """Rotation vectors of obstacles in rad; the others are not turned."""
        return self.turn or {}

    @property
    def poses(self) -> dict[str, tuple[float, ...]]:
        """Displacements in mm and rotation vectors in rad (6,) of obstacles; the others are in their places."""
        still = (0.0, 0.0, 0.0)
        names = dict.fromkeys([*self.moves, *self.turns])
        return {name: (*self.moves.get(name, still), *self.turns.get(name, still)) for name in names}


class Fold(Table):
    """Least distance within one surface, between points that are not neighbours on the starting tube (23)."""

    distance: PositiveLength = 1.0
    """Least distance."""
    neighbourhood: PositiveLength = 2.0
    """Points nearer than this on the starting tube are neighbours and do not count."""


class Stretch(Table):
    """Limit of h₃ in 1/mm²: the stretch gradient per millimetre ("per_mm"), or (29) as printed in the paper."""

    limit: Curvature = 0.1
    """Largest value."""
    form: Literal["per_mm", "printed"] = "per_mm"
    """Per millimetre, or as printed in the paper."""

    @model_validator(mode="before")
    @classmethod
    def _limit_alone(cls, data: Any) -> Any:
        if isinstance(data, dict):
            return data
        Quantity(units.CURVATURE, "positive").read(data)
        return {"limit": data}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [Quantity(units.CURVATURE, "positive").json_schema(), handler(schema)]}


class Scaling(Table):
    """How lengths at a surface of a body from a file may change relative to the file, in any direction."""

    least: Annotated[Number, Field(gt=0, lt=1)] = 0.5
    """Least ratio."""
    largest: Annotated[Number, Field(gt=1, le=100)] = 2.0
    """Largest ratio."""


class Limits(Table):
    """Limits that every design satisfies; the defaults are those of the paper's Table I.

    Curvature, skew and stretch are for tubes, scaling is for bodies from files.
    """

    wall: PositiveLength = 2.0
    """Least distance of two surfaces, and of a chamber from the end planes."""
    fold: Fold = Fold()
    """Least width of slots and ridges."""
    curvature: Curvature = 0.3
    """Largest (k₁² + k₂²)/2 of the principal curvatures."""
    skew: Annotated[Number, Field(gt=0, lt=1)] = 0.2
    """Largest cos² of the angle between parameter lines."""
    stretch: Stretch = Stretch()
    """Largest squared relative change of the spacing of parameter lines per length."""
    scaling: Scaling | None = None
    """Least and largest change of lengths at the surfaces of a body from a file."""
    envelope: Envelope | None = None
    """The space that must contain the exterior."""
    strain: Annotated[Number, Field(gt=0)] | None = None
    """Largest stretch in every task, divided by the range of the rubber (`valid_stretch`); usually 1."""
    margin: Annotated[Number, Field(gt=1)] | None = None
    """Least ratio of the pressure at which a chamber balloons to the working pressure, in every task; e.g. 1.3."""


class MeshSpec(Table):
    """Desired edge length in mm, and kind of the tetrahedra.

    Mixed elements interpolate the pressure in the rubber separately and do not lock; "auto" uses them for nearly
    incompressible rubbers.
    """

    size: PositiveLength = 2.0
    """Desired edge length of the tetrahedra."""
    element: Literal["auto", "quadratic", "mixed"] = "auto"
    """Kind of the elements."""


def _method(name: Any) -> Any:
    if name != "lbfgs":
        return name
    warnings.warn('optimizer.method: "lbfgs" is now called "sqp"; please write that', Renamed, stacklevel=2)
    return "sqp"


class OptimizerSpec(Table):
    """First step in mm, method of the sub-problem, and largest number of designs.

    "sqp" (sequential quadratic programming) was formerly called "lbfgs", which is still accepted.
    """

    step: PositiveLength = 0.2
    """Largest motion of a control point in the first step."""
    method: Annotated[Literal["sqp", "dfp"], BeforeValidator(_method)] = "sqp"
    """How steps are computed."""
    iterations: Annotated[Whole, Field(ge=1, le=100_000)] = 40
    """Largest number of designs after the start."""
