"""Limits on motions: in the table [limits] for every task, in a task's own table `limits` for that one."""

from typing import Annotated, Any

from pydantic import AfterValidator, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.problem.components import MOTION_OF, renamed
from pneumorph.problem.table import Quantity, Table

PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]
PositiveAngle = Annotated[float, Quantity(units.ANGLE, "positive")]


class MotionLimits(Table):
    """Largest motions of the tip, in either direction; motions that are not given are free.

    "extension" may also be written "axial", and "twist" "torsion", as for springs.
    """

    tilt: PositiveAngle | None = None
    """Angle between the tip's normal and the axis."""
    shift: PositiveLength | None = None
    """Distance of the tip from the axis."""
    shift_x: PositiveLength | None = None
    """Motion of the tip along x."""
    shift_y: PositiveLength | None = None
    """Motion of the tip along y."""
    extension: PositiveLength | None = None
    """Motion of the tip along z."""
    bending_x: PositiveAngle | None = None
    """Rotation of the tip about x."""
    bending_y: PositiveAngle | None = None
    """Rotation of the tip about y."""
    twist: PositiveAngle | None = None
    """Rotation of the tip about z."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_springs(cls, data: Any) -> Any:
        return renamed(data, MOTION_OF)


def _nonzero(value: float) -> float:
    if value == 0.0:
        raise ValueError("is no least motion; write how far, with a minus sign for the opposite direction")
    return value


LeastLength = Annotated[float, Quantity(units.LENGTH), AfterValidator(_nonzero)]
LeastAngle = Annotated[float, Quantity(units.ANGLE), AfterValidator(_nonzero)]


class LeastMotions(Table):
    """Least motions of the tip; a negative one is a motion in the opposite direction, at least so large.

    "extension" may also be written "axial", and "twist" "torsion", as for springs.
    """

    shift_x: LeastLength | None = None
    """Motion of the tip along x."""
    shift_y: LeastLength | None = None
    """Motion of the tip along y."""
    extension: LeastLength | None = None
    """Motion of the tip along z."""
    bending_x: LeastAngle | None = None
    """Rotation of the tip about x."""
    bending_y: LeastAngle | None = None
    """Rotation of the tip about y."""
    twist: LeastAngle | None = None
    """Rotation of the tip about z."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_springs(cls, data: Any) -> Any:
        return renamed(data, MOTION_OF)


LinearStiffness = Annotated[float, Quantity(units.STIFFNESS, "positive")]
TurningStiffness = Annotated[float, Quantity(units.ROTATIONAL_STIFFNESS, "positive")]


class LeastStiffness(Table):
    """Least stiffness of the tip against motions, in the state of a task: force per motion, all others being free.

    "extension" may also be written "axial", and "twist" "torsion", as for springs.
    """

    shift_x: LinearStiffness | None = None
    """Against motion along x."""
    shift_y: LinearStiffness | None = None
    """Against motion along y."""
    extension: LinearStiffness | None = None
    """Against motion along z."""
    bending_x: TurningStiffness | None = None
    """Against rotation about x."""
    bending_y: TurningStiffness | None = None
    """Against rotation about y."""
    twist: TurningStiffness | None = None
    """Against rotation about z."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_springs(cls, data: Any) -> Any:
        return renamed(data, MOTION_OF)

    @property
    def motions(self) -> list[str]:
        """The motions that are given."""
        return [name for name, bound in self if bound is not None]


RATES = {
    "angle": Quantity(units.ANGLE_PER_PRESSURE, "positive"),
    "length": Quantity(units.LENGTH_PER_PRESSURE, "positive"),
}


class SensitivityLimits(Table):
    """Largest change of a task's own motions with the pressure of any chamber, e.g. "2 deg/kPa" or "0.5 mm/kPa".

    A task whose own motions are angles and lengths may have both.
    """

    angle: Annotated[float, RATES["angle"]] | None = None
    """Of rotations, rad/MPa."""
    length: Annotated[float, RATES["length"]] | None = None
    """Of translations, mm/MPa."""

    @model_validator(mode="before")
    @classmethod
    def _one_alone(cls, data: Any) -> Any:
        if isinstance(data, dict):
            return data
        try:
            RATES["length"].read(data)
            return {"length": data}
        except ValueError:
            # Where it is neither, the sentence speaks of an angle, of which most tasks are.
            RATES["angle"].read(data)
            return {"angle": data}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [*(rate.json_schema() for rate in RATES.values()), handler(schema)]}


class TaskLimits(Table):
    """Limits on motions of the tip; a task's own come before those of the table [limits], key by key."""

    motion: MotionLimits | None = None
    """Largest motions of the tip, e.g. { tilt = "1 deg", shift = "0.5 mm" }."""
    at_least: LeastMotions | None = None
    """Least motions of the tip, e.g. { bending_y = "30 deg" }."""
    stiffness: LeastStiffness | None = None
    """Least stiffness of the tip, e.g. { shift_x = "0.2 N/mm" }."""
    sensitivity: SensitivityLimits | None = None
    """Largest change of a task's own motion with the pressure of any chamber, e.g. "2 deg/kPa"."""
