"""Contact of the body with itself, and rigid obstacles."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import (
    Field,
    GetJsonSchemaHandler,
    Strict,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema
from scipy.spatial.transform import Rotation

from pneumorph import units
from pneumorph.cad import stl
from pneumorph.problem.beside import with_file
from pneumorph.problem.directions import Direction, Number
from pneumorph.problem.kinds import by_kind, known
from pneumorph.problem.models import Length, PositiveLength, RotationalStiffness, Stiffness
from pneumorph.problem.names import Name
from pneumorph.problem.table import TAG, Example, Quantity, Table
from pneumorph.problem.triangles import with_triangles

Angle = Annotated[float, Quantity(units.ANGLE)]
Place = tuple[Length, Length, Length]

ACTIVATION = 1 / 20
"""The default of `contact.distance`, as a fraction of mesh.size."""

PoseMotion = Literal["x", "y", "z", "turn_x", "turn_y", "turn_z"]


class ContactSpec(Table):
    """Contact between deformed surfaces, in the states of all tasks.

    Surfaces that are nearer than the distance exert contact forces, which grow as the gap falls, so they never
    penetrate each other. With contact a sector of the body may be solved, but no half or quarter; with obstacles the
    whole body is solved.
    """

    self: Annotated[bool, Strict()] = True
    """Whether contact between surfaces of the body and its chambers is computed; false saves time."""
    distance: PositiveLength | None = None
    """Distance below which contact forces act; less than any wall or gap. By default a twentieth of mesh.size."""
    friction: Annotated[Number, Field(ge=0, le=10)] = 0.0
    """Coefficient of friction on obstacles, only for `pneumorph simulate`, since results depend on the loading path."""


class _Obstacle(Table):
    placed_by: ClassVar[str] = "center"
    """The key that says where it is."""

    name: Annotated[Name, Example('e.g. name = "table"')]
    """Name of the obstacle in results."""

    @property
    def a_point(self) -> np.ndarray | None:
        """A point (3,) of it, mm; None for a half-space, which cannot be inside anything."""
        return np.array(getattr(self, self.placed_by))


class FreeSpring(Table):
    """Springs between a free obstacle and its set pose: N/mm along x, y, z and N·mm/rad about x, y, z."""

    x: Stiffness = 0.0
    """Stiffness against motion along x."""
    y: Stiffness = 0.0
    """Stiffness against motion along y."""
    z: Stiffness = 0.0
    """Stiffness against motion along z."""
    turn_x: RotationalStiffness = 0.0
    """Stiffness against the rotation vector's component about x."""
    turn_y: RotationalStiffness = 0.0
    """Stiffness against the rotation vector's component about y."""
    turn_z: RotationalStiffness = 0.0
    """Stiffness against the rotation vector's component about z."""


class FreeSpec(Table):
    """A free rigid obstacle, which moves and rotates under forces from the pose that the task sets.

    It rests on the body and on planes, or hangs on springs; contact with other obstacles is not computed. It needs a
    support in every direction: an obstacle that slides or falls freely has no equilibrium.
    """

    mass: Annotated[float, Quantity(units.MASS, "not negative")] = 0.0
    """Mass, which has weight if there is a table [gravity]."""
    hold: Annotated[tuple[PoseMotion, ...], Field(max_length=6)] = ()
    """Held motions, which follow the task exactly."""
    spring: FreeSpring = FreeSpring()
    """Springs to the pose set by the task."""


class _Body(_Obstacle):
    free: FreeSpec | None = None
    """Makes the obstacle a free rigid body, with its mass, springs and held motions; else it is fixed."""


class PlaneSpec(_Obstacle):
    """A half-space, such as a table or a wall."""

    free: ClassVar[None] = None
    """Planes are never free."""
    placed_by: ClassVar[str] = "point"

    kind: Literal["plane"]
    """The kind of obstacle."""
    point: Annotated[Place, Example('e.g. point = ["0 mm", "0 mm", "-5 mm"]')]
    """A point of its surface."""
    normal: Annotated[Direction, Example("e.g. normal = [0, 0, 1]")]
    """Direction out of the obstacle, to the body's side; of any length."""

    @property
    def a_point(self) -> None:
        return None


class SphereSpec(_Body):
    """A ball."""

    kind: Literal["sphere"]
    """The kind of obstacle."""
    center: Annotated[Place, Example('e.g. center = ["20 mm", "0 mm", "60 mm"]')]
    """Its centre."""
    radius: PositiveLength
    """Its radius."""


class CylinderSpec(_Body):
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


class BoxSpec(_Body):
    """A box with edges along x, y and z."""

    kind: Literal["box"]
    """The kind of obstacle."""
    center: Annotated[Place, Example('e.g. center = ["20 mm", "0 mm", "60 mm"]')]
    """Its centre."""
    size: Annotated[
        tuple[PositiveLength, PositiveLength, PositiveLength], Example('e.g. size = ["10 mm", "20 mm", "10 mm"]')
    ]
    """Lengths of its edges along x, y and z."""


class TriangulatedSpec(_Body):
    """A body by its surface of triangles, from an STL file in mm.

    `file` is its path, from the folder of the problem file. On reading, the triangles are stored as `triangles`, so
    that a run does not depend on the file. The file's body is scaled, turned about the file's origin, and displaced.
    """

    placed_by: ClassVar[str] = "position"

    kind: Literal["mesh"]
    """The kind of obstacle."""
    triangles: Annotated[
        str, Strict(), Example('a file next to the problem file, e.g. file = "part.stl"'), Field(max_length=1_000_000)
    ]
    """Its closed surface, compressed; `file` is given in its place."""
    scale: Annotated[Number, Field(gt=0)] = 1.0
    """Factor of its size; 1000 for a file in metres."""
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Rotation vector of the body, about the file's origin."""
    position: Place = (0.0, 0.0, 0.0)
    """Position of the file's origin."""

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        return with_triangles(data, info)

    @field_validator("triangles")
    @classmethod
    def _is_a_surface(cls, text: str) -> str:
        stl.unpack(text)
        return text

    @property
    def surface(self) -> stl.Surface:
        """The surface in the file, mm."""
        return stl.unpack(self.triangles)

    @property
    def a_point(self) -> np.ndarray:
        first = self.scale * self.surface.points[0]
        return Rotation.from_rotvec(self.rotation).apply(first) + np.array(self.position)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        description = 'Path of an STL file in mm, from the folder of the problem file, e.g. file = "part.stl".'
        return with_file(schema, handler, "triangles", description)


KINDS = ("plane", "sphere", "cylinder", "box", "mesh")


ObstacleSpec = Annotated[
    Annotated[PlaneSpec, Tag(TAG + "plane")]
    | Annotated[SphereSpec, Tag(TAG + "sphere")]
    | Annotated[CylinderSpec, Tag(TAG + "cylinder")]
    | Annotated[BoxSpec, Tag(TAG + "box")]
    | Annotated[TriangulatedSpec, Tag(TAG + "mesh")],
    by_kind(),
    known(KINDS, "obstacle"),
]
