"""The table of the space that must contain a body."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, GetJsonSchemaHandler, Strict, ValidationInfo, model_validator
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.cad.stl import Surface, unpack
from pneumorph.problem.directions import Direction
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.problem.triangles import with_triangles

Length = Annotated[float, Quantity(units.LENGTH)]
Place = tuple[Length, Length, Length]
Plane = tuple[Direction, float]

SAME = 1e-9
"""Differences of parts of unit vectors, and of lengths in mm, that are none."""


class HalfSpace(Table):
    """What is on one side of a plane."""

    point: Annotated[Place, Example('e.g. point = ["0 mm", "9 mm", "0 mm"]')]
    """A point of the plane."""
    normal: Annotated[Direction, Example("e.g. normal = [0, 1, 0]")]
    """Direction out of the space that must contain the body, of any length."""


class Envelope(Table):
    """The space that must contain the exterior: a cylinder about z, a box, half-spaces, or what they share.

    For a body from a file it may be any space in place of these, whose closed surface is in the STL file `file`, in mm.
    On reading, its triangles are stored as `triangles`, so that a run does not depend on the file.
    """

    radius: Annotated[float, Quantity(units.LENGTH, "positive")] | None = None
    """Radius of the cylinder about z."""
    box: Annotated[tuple[Place, Place], Example('e.g. box = [["-9 mm", "-9 mm", "0 mm"], …]')] | None = None
    """Two opposite corners of the box."""
    half_space: Annotated[tuple[HalfSpace, ...], Field(max_length=20)] = ()
    """Half-spaces."""
    triangles: Annotated[str, Strict(), Field(max_length=1_000_000)] | None = None
    """The closed surface around the space, compressed; `file` is given in its place."""

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        return with_triangles(data, info)

    @model_validator(mode="after")
    def _some_space(self) -> Envelope:
        if self.triangles is not None:
            given = next((key for key in ("radius", "box", "half_space") if getattr(self, key)), None)
            if given is not None:
                raise InvalidKey(given, "is given together with the file of a space; leave one of them out")
            try:
                unpack(self.triangles)
            except ValueError as error:
                raise InvalidKey("triangles", str(error)) from None
        elif self.radius is None and self.box is None and not self.half_space:
            raise InvalidKey("radius", 'is missing; give a radius, a box or half-spaces, e.g. radius = "12 mm"')
        if self.box is not None and np.ptp(self.box, axis=0).min() <= 0.0:
            raise InvalidKey("box", "has no volume; give two opposite corners that differ in x, y and z")
        return self

    @property
    def planes(self) -> tuple[Plane, ...]:
        """Of the box and the half-spaces: the outward unit normal n and c, in mm, of n·x ≤ c."""
        planes = [(each.normal, float(np.dot(each.normal, each.point))) for each in self.half_space]
        if self.box is not None:
            for axis, (one, other) in zip(np.eye(3), zip(*self.box, strict=True), strict=True):
                outward, inward = (tuple((sign * axis + 0.0).tolist()) for sign in (1.0, -1.0))
                planes += [(outward, max(one, other)), (inward, -min(one, other))]
        return tuple(planes)

    @property
    def surface(self) -> Surface | None:
        """The closed surface around a space from a file, mm."""
        return None if self.triangles is None else unpack(self.triangles)

    def symmetric(self, group: list[NDArray[np.float64]], length: float) -> bool:
        """Whether it is mapped to itself by operations (3, 3) about the middle of a body of a length in mm."""
        middle = np.array([0.0, 0.0, length / 2.0])
        planes = np.array([(*normal, offset - middle @ normal) for normal, offset in self.planes]).reshape(-1, 4)
        for matrix in group:
            images = np.hstack([planes[:, :3] @ matrix.T, planes[:, 3:]])
            if (np.abs(planes[:, None] - images).max(axis=2, initial=0.0).min(axis=0, initial=np.inf) > SAME).any():
                return False
        return True

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = handler(schema)
        description = 'Path of an STL file in mm, from the folder of the problem file, e.g. file = "space.stl".'
        table = handler.resolve_ref_schema(reference)
        table["properties"]["file"] = {"type": "string", "title": "File", "description": description}
        return reference
