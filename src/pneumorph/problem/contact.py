"""Contact of the body with itself, and rigid obstacles."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag, model_validator

from pneumorph.errors import short
from pneumorph.problem.directions import Direction, Number, unit_vector
from pneumorph.problem.models import Length, PositiveLength
from pneumorph.problem.names import Name
from pneumorph.problem.table import TAG, Example, InvalidKey, Table

Place = tuple[Length, Length, Length]


class ContactSpec(Table):
    """Contact, which keeps deformed surfaces apart at the states of all tasks.

    Surfaces nearer to each other than the distance push each other away, the harder the nearer they are; none ever goes
    through another. With contact or obstacles the whole body is solved, not half of it.
    """

    self: Annotated[bool, Strict()] = True
    """Whether the surfaces of the body and its chambers may touch each other; false saves time."""
    distance: PositiveLength | None = None
    """At which surfaces begin to push; less than any wall or gap. By default a twentieth of mesh.size."""
    friction: Annotated[Number, Field(ge=0, le=10)] = 0.0
    """Coefficient of friction on obstacles, in `pneumorph simulate` alone: what it leads to depends on the way."""


class _Obstacle(Table):
    name: Annotated[Name, Example('e.g. name = "table"')]
    """By which results name the obstacle."""


class PlaneSpec(_Obstacle):
    """A half-space, such as a table or a wall."""

    kind: Literal["plane"]
    """The kind of obstacle."""
    point: Annotated[Place, Example('e.g. point = ["0 mm", "0 mm", "-5 mm"]')]
    """A point of its surface."""
    normal: Annotated[Direction, Example("e.g. normal = [0, 0, 1]")]
    """Direction out of the obstacle, to the body's side; of any length."""

    @model_validator(mode="after")
    def _unit_normal(self) -> PlaneSpec:
        object.__setattr__(self, "normal", unit_vector("normal", self.normal))
        return self


class SphereSpec(_Obstacle):
    """A ball."""

    kind: Literal["sphere"]
    """The kind of obstacle."""
    center: Annotated[Place, Example('e.g. center = ["20 mm", "0 mm", "60 mm"]')]
    """Its centre."""
    radius: PositiveLength
    """Its radius."""


class CylinderSpec(_Obstacle):
    """A solid cylinder with flat ends."""

    kind: Literal["cylinder"]
    """The kind of obstacle."""
    center: Annotated[Place, Example('e.g. center = ["20 mm", "0 mm", "60 mm"]')]
    """Its centre."""
    axis: Annotated[Direction, Example("e.g. axis = [0, 1, 0]")]
    """Direction of its axis, of any length."""
    radius: PositiveLength
    """Its radius."""
    length: PositiveLength
    """Its length along the axis."""

    @model_validator(mode="after")
    def _unit_axis(self) -> CylinderSpec:
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        return self


class BoxSpec(_Obstacle):
    """A box with edges along x, y and z."""

    kind: Literal["box"]
    """The kind of obstacle."""
    center: Annotated[Place, Example('e.g. center = ["20 mm", "0 mm", "60 mm"]')]
    """Its centre."""
    size: Annotated[
        tuple[PositiveLength, PositiveLength, PositiveLength], Example('e.g. size = ["10 mm", "20 mm", "10 mm"]')
    ]
    """Its edges along x, y and z."""


KINDS = ("plane", "sphere", "cylinder", "box")


def _of_a_known_kind(data: Any) -> Any:
    kind = data.get("kind") if isinstance(data, dict) else getattr(data, "kind", None)
    if not isinstance(kind, str) or kind not in KINDS:
        wrong = "is missing" if kind is None else f'"{short(kind)}" is not a known kind of obstacle'
        raise InvalidKey("kind", f"{wrong}; use one of {', '.join(KINDS)}")
    return data


def _tag(data: Any) -> str:
    return TAG + (data["kind"] if isinstance(data, dict) else data.kind)


ObstacleSpec = Annotated[
    Annotated[PlaneSpec, Tag(TAG + "plane")]
    | Annotated[SphereSpec, Tag(TAG + "sphere")]
    | Annotated[CylinderSpec, Tag(TAG + "cylinder")]
    | Annotated[BoxSpec, Tag(TAG + "box")],
    Discriminator(_tag),
    BeforeValidator(_of_a_known_kind),
]
