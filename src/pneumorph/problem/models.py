"""The tables of a problem file as frozen models: body, end-effector, gravity, tasks, limits, mesh and optimiser.

Field names are the keys of the file. After reading, every quantity is a float in mm, N, MPa, t, s, rad.
"""

import warnings
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    Strict,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.errors import Renamed, short
from pneumorph.problem.components import COMPONENT_OF, component_of, is_turn, renamed
from pneumorph.problem.directions import Direction, Number
from pneumorph.problem.envelope import Envelope
from pneumorph.problem.gas import ATMOSPHERE, BELOW_VACUUM
from pneumorph.problem.names import Name
from pneumorph.problem.objectives import ObjectiveSpec
from pneumorph.problem.objectives.table import RotationVector
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.problem.task_limits import TaskLimits
from pneumorph.problem.variable import Variable

RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{port}{number}" for port in ("COM", "LPT") for number in range(1, 10))}
"""Names of devices on Windows, which no file there can have."""

MOST_CHAMBERS, MOST_TASKS, MOST_OBSTACLES = 100, 50, 20
"""Of a problem: every chamber is compared with every other, every task is an equilibrium of its own."""

Length = Annotated[float, Quantity(units.LENGTH)]
PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]
PositiveShare = Annotated[float, Quantity(units.SHARE, "positive")]
Curvature = Annotated[float, Quantity(units.CURVATURE, "positive")]
GaugePressure = Annotated[float, Quantity(units.PRESSURE)]
Stiffness = Annotated[float, Quantity(units.STIFFNESS, "not negative")]
RotationalStiffness = Annotated[float, Quantity(units.ROTATIONAL_STIFFNESS, "not negative")]
Force = Annotated[float, Quantity(units.FORCE)]
Moment = Annotated[float, Quantity(units.MOMENT)]
Volume = Annotated[float, Quantity(units.VOLUME)]
PositiveVolume = Annotated[float, Quantity(units.VOLUME, "positive")]
Bending = Annotated[float, Quantity(units.PER_LENGTH, "positive")]
Whole = Annotated[int, Strict()]


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


Angle = Annotated[float, Quantity(units.ANGLE)]
Vector = tuple[Force, Force, Force]


class Hold(Table):
    """Motions of the end-effector that a guide holds, each at a value: mm along x, y, z and rad about x, y, z.

    The angles are components of the plate's rotation vector. A list of names, `["axial", "bending_x"]`, holds these
    where they are at rest. `axial` may also be written `extension`, and `torsion` `twist`.
    """

    shift_x: Length | None = None
    """Where the motion along x is held."""
    shift_y: Length | None = None
    """Where the motion along y is held."""
    axial: Length | None = None
    """Where the motion along z is held."""
    bending_x: Angle | None = None
    """Where the rotation about x is held."""
    bending_y: Angle | None = None
    """Where the rotation about y is held."""
    torsion: Angle | None = None
    """Where the rotation about z is held."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_motions(cls, data: Any) -> Any:
        if isinstance(data, str):
            raise ValueError(
                'is a list of motions that a guide keeps where they are at rest, e.g. hold = ["bending_y"], or a table '
                'with the values at which it holds them, e.g. hold = { bending_y = "30 deg" }; for one that the tip is '
                'to reach, give the objective { kind = "motion", bending_y = "30 deg" }'
            )
        if not isinstance(data, (list, tuple)):
            return renamed(data, COMPONENT_OF)
        wrong = [name for name in data if not isinstance(name, str) or component_of(name) not in cls.model_fields]
        if wrong:
            known = ", ".join(cls.model_fields)
            raise ValueError(f'"{short(wrong[0])}" is not a motion of the plate; use some of {known}')
        return {component_of(name): "0 rad" if is_turn(name) else "0 mm" for name in data}

    @property
    def values(self) -> dict[str, float]:
        """The motions that are held, each with its value in mm or rad."""
        return {name: value for name, value in self if value is not None}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = {"type": "array", "items": {"enum": [*cls.model_fields, *COMPONENT_OF]}, "maxItems": 12}
        return {"anyOf": [names, handler(schema)]}


class EndEffector(Table):
    """What the tip carries: a rigid plate with springs, a force (N) and a moment (N·mm), or nothing ("free").

    `hold` has motions of the plate that a guide prevents, or holds at a value.
    """

    kind: Literal["plate", "free"] = "plate"
    """A rigid plate that is bonded to the tip, or a free tip."""
    spring: Spring = Spring()
    """Springs from the plate to the ground."""
    force: Vector = (0.0, 0.0, 0.0)
    """Dead force on the plate: x, y, z."""
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    """Moment on the plate about x, y, z."""
    hold: Hold = Hold()
    """Motions of the plate that a guide holds: a list of names, or a table with the values at which they are held."""

    @model_validator(mode="after")
    def _nothing_on_a_free_tip(self) -> "EndEffector":
        for key in ("spring", "force", "moment", "hold"):
            if self.kind == "free" and getattr(self, key) != type(self).model_fields[key].default:
                raise InvalidKey(key, f'needs a plate, but the tip is free; use kind = "plate" or leave {key} out')
        return self


class Gravity(Table):
    """Acceleration in mm/s², and its direction, which is normalised; the word "none" stands for no acceleration."""

    acceleration: Annotated[float, Quantity(units.ACCELERATION, "not negative")] = units.STANDARD_GRAVITY
    """Magnitude of the acceleration."""
    direction: Annotated[Direction, Example("e.g. direction = [0, 0, -1]")]
    """Its direction, of any length; the body's axis is z, from the base to the tip."""

    @model_validator(mode="before")
    @classmethod
    def _or_none(cls, data: Any) -> Any:
        return {"acceleration": "0 m/s^2", "direction": [0, 0, -1]} if data == "none" else data

    @property
    def vector(self) -> tuple[float, float, float]:
        """The acceleration with its direction, mm/s²."""
        x, y, z = self.direction
        return self.acceleration * x, self.acceleration * y, self.acceleration * z

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"const": "none"}, handler(schema)]}


class Pressure(Variable):
    """The gauge pressure of a chamber in MPa: fixed, or free between min and max and designed along with the shape.

    One that is the same as that of another chamber, on whose supply it is, has what that one has.
    """

    quantity: ClassVar = Quantity(units.PRESSURE)

    start: GaugePressure
    """Pressure of the start."""
    min: Annotated[GaugePressure, Example('e.g. min = "0 kPa"')]
    """Lower bound; negative is vacuum."""
    max: GaugePressure
    """Upper bound."""
    same_as: Name | None = None
    """A chamber with which it shares one supply: nothing else is given then, e.g. B = { same_as = "A" }."""

    @model_validator(mode="after")
    def _no_less_than_vacuum(self) -> "Pressure":
        if self.min >= -ATMOSPHERE:
            return self
        raise InvalidKey("min", BELOW_VACUUM) if self.free else ValueError(BELOW_VACUUM)

    @model_serializer(mode="wrap")
    def _as_in_the_file(self, write: SerializerFunctionWrapHandler) -> Any:
        if self.same_as is not None:
            return {"same_as": self.same_as}
        # The schema is made of a pressure without values.
        known = bool(self.model_fields_set)
        return self.quantity.write(self.start) if known and not self.free else write(self)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        shared = {"type": "object", "properties": {"same_as": {"type": "string"}}, "required": ["same_as"]}
        return {"anyOf": [cls.quantity.json_schema(), handler(schema), shared]}


def _with_shared(given: Any) -> Any:
    """The pressures of a task, where one that is the same as another's has what that one has."""
    if not isinstance(given, dict):
        return given

    def whole(name: str, value: Any) -> Any:
        if not isinstance(value, dict) or value.get("same_as") is None:
            return value
        if others := [key for key in value if key != "same_as"]:
            raise InvalidKey(name, f"has same_as, which gives {others[0]} too; leave one of both out")
        leader = value["same_as"]
        first = given.get(leader) if isinstance(leader, str) else None
        if first is None or leader == name or (isinstance(first, dict) and first.get("same_as") is not None):
            raise InvalidKey(name, "has same_as, which names no other chamber with a pressure in this task; name one")
        if isinstance(first, Pressure):
            return first.model_copy(update={"same_as": leader})
        alike = first if isinstance(first, dict) else {"start": first, "min": first, "max": first}
        return alike | {"same_as": leader}

    return {name: whole(name, value) for name, value in given.items()}


class Task(Table):
    """One task: the pressures of the chambers, and an objective.

    A task may have loads of its own: each of `force`, `moment`, `spring`, `hold` and `gravity` takes the place of what
    [end_effector] or [gravity] say, as a whole.
    """

    name: Annotated[Name, Example('e.g. name = "extend"')]
    """By which results name the task."""
    weight: Annotated[Number, Field(gt=0)] = 1.0
    """Factor of its objective in the sum over tasks."""
    pressure: Annotated[
        dict[Name, Pressure],
        Field(max_length=MOST_CHAMBERS),
        BeforeValidator(_with_shared),
        Example('e.g. pressure = { A = "60 kPa" }, or pressure = {} if every chamber is filled or sealed'),
    ]
    """Gauge pressure of each chamber; 0 for a chamber without an entry, a volume or a gas."""
    pressures_of: Name | None = None
    """Another task, whose pressures this one has too, designed or not; `pressure` is left out then."""
    volume: (
        Annotated[dict[Name, Volume], Field(max_length=MOST_CHAMBERS), Example('e.g. volume = { A = "12 ml" }')] | None
    ) = None
    """Volume of liquid that is filled into chambers beyond theirs at rest, in place of a pressure, which follows."""
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
    force: Vector | None = None
    """Dead force on the plate in this task: x, y, z; by default that of [end_effector]."""
    moment: tuple[Moment, Moment, Moment] | None = None
    """Moment on the plate in this task about x, y, z; by default that of [end_effector]."""
    spring: Spring | None = None
    """Springs from the plate to the ground in this task; by default those of [end_effector]."""
    hold: Hold | None = None
    """Motions of the plate that are held in this task; by default those of [end_effector]."""
    gravity: Gravity | None = None
    """Gravity in this task, a table as [gravity], or "none"; by default that of [gravity]."""
    objective: Annotated[ObjectiveSpec, Example('e.g. objective = { kind = "maximize", motion = "extension" }')]
    """The objective of the shape and the free pressures."""
    limits: TaskLimits | None = None
    """Limits on the states of this task, in place of those of the table [limits] with the same keys."""

    @model_serializer(mode="wrap")
    def _as_in_the_file(self, write: SerializerFunctionWrapHandler) -> Any:
        written = write(self)
        if self.pressures_of is not None:
            written.pop("pressure", None)
        return written

    @property
    def volumes(self) -> dict[str, float]:
        """Volumes in mm³ that are filled into chambers."""
        return self.volume or {}

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


def _share(value: Any) -> Any:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if value != "off" and not (number and 0 < value < float("inf")):
        raise ValueError('is neither a number above 0 nor "off"; 1 is the whole range of the rubber')
    return value


class Limits(TaskLimits):
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
    bending: Bending | None = None
    """Largest second derivative of the displacement of a body from a file: plane faces become no more curved than that
    over the square of the least scaling."""
    volume: PositiveVolume | None = None
    """Largest volume of the rubber."""
    envelope: Envelope | None = None
    """The space that must contain the exterior."""
    strain: Annotated[Annotated[Number, Field(gt=0)] | Literal["off"], BeforeValidator(_share)] | None = None
    """Largest stretch in every task, divided by the range of the rubber (`valid_stretch`); "off" for no limit.

    By default 1 where all rubbers state their range, else "off".
    """
    margin: Annotated[Number, Field(ge=1, le=10)] | None = None
    """Least ratio of the pressure at which a chamber balloons to the working pressure, in every task; 1 for no limit.

    By default 1.15, or 1 where no pressure is above 0: nothing balloons under vacuum.
    """


class MeshSpec(Table):
    """Desired edge length in mm, and kind of the tetrahedra.

    Mixed elements interpolate the pressure in the rubber separately and do not lock; "auto" uses them for nearly
    incompressible rubbers.
    """

    size: PositiveLength = 2.0
    """Desired edge length of the tetrahedra; with `error`, that of the first mesh. The first designs of a run of eight
    or more may be on tetrahedra half as large again."""
    error: PositiveShare | None = None
    """Largest error of the mesh in the motion of the tip, as estimated: the edge length is chosen for it, and elements
    that contribute most are divided until it is met."""
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
