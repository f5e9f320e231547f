"""The table [body] of a body from a file."""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from functools import lru_cache
from string import ascii_uppercase
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, Strict, StringConstraints, ValidationInfo, model_validator
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.cad.deviation import deviations
from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import Extreme, InBox, InPlane, Named, Parts, Where, parts_of, point_inside
from pneumorph.cad.parts import Place as PlaceOf
from pneumorph.cad.read import FORMATS, Format, read_faces
from pneumorph.cad.shells import section_area, shells_of
from pneumorph.errors import ComputationError, MeshError, short
from pneumorph.problem.beside import contents_of, file_of, stored, with_file
from pneumorph.problem.body import Ripple, Symmetry
from pneumorph.problem.directions import Number
from pneumorph.problem.gas import Gas
from pneumorph.problem.models import MOST_CHAMBERS, Length
from pneumorph.problem.names import Name
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import Part

MOST_BYTES = 30_000_000
"""Largest file with a body that is read."""

MOST_TEXT = 1_800_000
"""Characters that it may take, compressed, in a problem file."""

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
"""mm in a unit."""

_PLANE = re.compile(r"\s*([xyz])\s*=\s*(\S.*?)\s*")
_LENGTH = Quantity(units.LENGTH)

Place = tuple[Length, Length, Length]


def packed(content: bytes) -> str:
    """The bytes of a file as `SolidSpec.data` has them."""
    return base64.b64encode(zlib.compress(content, 9)).decode()


class Selection(Table):
    """Faces of a body from a file: all in a plane, all within a box, or those with a name. One of the keys is given."""

    faces: Annotated[str, StringConstraints(max_length=60)] | None = None
    """The plane in which they lie, e.g. "z = 0 mm"."""
    within: Annotated[tuple[Place, Place], Example('e.g. within = [["0 mm", "0 mm", "0 mm"], …]')] | None = None
    """Two opposite corners of a box in which they lie wholly."""
    name: Annotated[str, StringConstraints(min_length=1, max_length=100)] | None = None
    """Their name in the file."""

    @model_validator(mode="after")
    def _one_of_them(self) -> Selection:
        given = [key for key in type(self).model_fields if getattr(self, key) is not None]
        if len(given) != 1:
            wrong = "is given together with " + given[0] if given else "is missing"
            raise InvalidKey(given[1] if given else "faces", f"{wrong}; give one of faces, within and name")
        if self.faces is not None:
            _plane("faces", self.faces)
        return self

    @property
    def where(self) -> Where:
        """The same for `cad.parts`."""
        if self.faces is not None:
            return InPlane(*_plane("faces", self.faces))
        if self.within is not None:
            lower, upper = np.sort(np.array(self.within), axis=0).tolist()
            return InBox(tuple(lower), tuple(upper))
        return Named(self.name or "")


def _plane(key: str, text: str) -> tuple[int, float]:
    match = _PLANE.fullmatch(text)
    if match is None:
        raise InvalidKey(key, f'"{short(text)}" is not a plane; write e.g. {key} = "z = 0 mm"')
    axis, at = match.groups()
    try:
        return "xyz".index(axis), 0.0 if re.fullmatch(r"[+-]?0+(\.0*)?", at) else _LENGTH.read(at)
    except ValueError as error:
        raise InvalidKey(key, str(error)) from None


class VoidSpec(Table):
    """A chamber of a body from a file: a closed void in it, or one that opens through a port.

    A port stays open; a cap without mass or stiffness over its rim counts in volume and pressure alone. With `seal` an
    obstacle closes it: there is no cap, and what would act on it acts on the obstacle.
    """

    name: Annotated[Name, Example('e.g. name = "A"')]
    """Name of the chamber in tasks and results."""
    inside: Annotated[Place, Example('e.g. inside = ["0 mm", "0 mm", "40 mm"]')]
    """A point in the void."""
    port: Annotated[str, StringConstraints(max_length=60)] | None = None
    """The plane in which the rim of its opening lies, e.g. "z = 0 mm"; by default the void is closed."""
    gas: Gas | None = None
    """Gas that the chamber is sealed with; without it tasks give its pressure or its volume."""
    seal: Name | None = None
    """Name of the obstacle, a plane, on which the rim lies and which closes the port, as for a suction cup."""

    @model_validator(mode="after")
    def _port_is_a_plane(self) -> VoidSpec:
        if self.seal is not None and self.port is None:
            raise InvalidKey("seal", "is for a chamber that opens through a port; give port too")
        if self.seal is not None and self.gas is not None:
            raise InvalidKey("seal", "is for a chamber whose pressure tasks give; leave gas out")
        if self.port is not None:
            _plane("port", self.port)
        return self


class SolidSpec(Table):
    """A body from a CAD file, with a clamped base, a tip, and its closed voids as chambers.

    `file` is its path, from the folder of the problem file. On reading, its contents are stored as `data`, so that a
    run does not depend on the file, and chambers that the table does not name are called A, B, C, … from the largest
    void on, equal ones in the order of the z, y and x of their centres. `scale` multiplies all coordinates; `unit` is
    for formats that have none.
    """

    data: Annotated[
        str,
        Strict(),
        Example('a file next to the problem file, e.g. file = "finger.step"'),
        Field(max_length=MOST_TEXT),
    ]
    """The contents of the file, compressed; `file` is given in its place."""
    format: Format = "step"
    """The format of the file."""
    unit: Literal["mm", "cm", "m", "in"] = "mm"
    """Unit of the coordinates in a file that has none of its own, as STL, OBJ and BREP."""
    scale: Annotated[Number, Field(gt=0)] = 1.0
    """Factor of its size."""
    base: Selection | None = None
    """The clamped faces; by default those in the lowest plane along z."""
    tip: Selection | None = None
    """The faces that carry the end-effector; by default those in the highest plane along z."""
    symmetry: Symmetry = Symmetry()
    """Symmetries of every design: mirror planes xz and yz, and a rotation about z of order 2 or 4."""
    chamber: tuple[VoidSpec, ...] = Field(default=(), max_length=MOST_CHAMBERS)
    """Its chambers, each a table [[body.chamber]]; by default all closed voids."""

    ripple: ClassVar[Ripple | None] = None

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        path = file_of(data, info, "data", 'a CAD file; write e.g. file = "finger.step"')
        if path is None:
            return data
        shown = short(path, 120)
        form = FORMATS.get(path.suffix.lower())
        if form is None:
            known = ", ".join(FORMATS)
            raise InvalidKey("file", f"{shown} is of no known format; save it as one of {known}")
        text = packed(contents_of(path, MOST_BYTES))
        if len(text) > MOST_TEXT:
            size = f"{len(text) / 1e6:.2g} MB when compressed, more than {MOST_TEXT / 1e6:g} MB"
            raise InvalidKey("file", f"{shown} has {size}; simplify it in CAD, or make its triangles coarser")
        return stored(data, data=text, format=form)

    @model_validator(mode="after")
    def _found_in_the_file(self) -> SolidSpec:
        if self.format in ("step", "3mf") and self.unit != "mm":
            raise InvalidKey("unit", f"is in the {self.format.upper()} file itself; leave it out, or use scale")
        try:
            if not self.chamber:
                object.__setattr__(self, "chamber", self._voids())
            assert self.parts
        except ComputationError as error:
            raise InvalidKey("file", f"it {error}") from None
        return self

    @property
    def content(self) -> bytes:
        """The bytes of the file.

        Raises
        ------
        InvalidKey
            If `data` is not what was stored.
        """
        try:
            unpacked = zlib.decompressobj().decompress(base64.b64decode(self.data, validate=True), MOST_BYTES + 1)
        except (binascii.Error, zlib.error, ValueError):
            raise InvalidKey("data", "is not the contents of a file; give file in its place") from None
        if len(unpacked) > MOST_BYTES:
            raise InvalidKey("data", f"has more than {MOST_BYTES / 1e6:g} MB; simplify the body in CAD")
        return unpacked

    @property
    def factor(self) -> float:
        """mm per unit of the file as it is read, in which STEP and 3MF have mm."""
        return self.scale * UNITS[self.unit]

    def faces(self, size: float, part: Part = ()) -> Faces:
        """Its faces in triangles with edges of about this length, mm; 0 for a coarse outline.

        Those of a part are open in the mirror planes beside it.
        """
        return read_faces(self.content, self.format, self.factor, size, tuple(NORMALS[plane] for plane in part))

    def deviations(self, size: float) -> np.ndarray:
        """Bounds (m,) of the distance between each of these triangles and the faces in the file, mm."""
        return deviations(self.content, self.format, self.factor, size)

    @property
    def outline(self) -> Faces:
        """Its faces in large triangles."""
        return self.faces(0.0)

    @property
    def ends_at(self) -> tuple[Where, Where]:
        """Where base and tip are."""
        base = Extreme(-1.0) if self.base is None else self.base.where
        return base, Extreme(1.0) if self.tip is None else self.tip.where

    @property
    def chambers_at(self) -> dict[str, PlaceOf]:
        """Where chambers are, by their names."""
        ports = {each.name: None if each.port is None else InPlane(*_plane("port", each.port)) for each in self.chamber}
        return {each.name: PlaceOf(each.inside, ports[each.name]) for each in self.chamber}

    @property
    def parts(self) -> Parts:
        """The parts of its outline."""
        return parts_of(self.outline, *self.ends_at, self.chambers_at)

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The centroids (3,) of base and tip, mm."""
        return _ends(self)  # pyright: ignore[reportArgumentType]

    @property
    def length(self) -> float:
        """Distance of the centroids of base and tip, mm."""
        base, tip = self.ends
        return float(np.linalg.norm(tip - base))

    def across(self, normal: np.ndarray) -> list[tuple[float, float]]:
        """From where to where each chamber is along a normal (3,), mm."""
        faces = self.outline
        along = faces.points @ normal
        own = [along[faces.triangles[chamber.triangles]] for chamber in self.parts.chambers.values()]
        return [(float(each.min()), float(each.max())) for each in own]

    def opened(self, normal: np.ndarray, place: float) -> float:
        """The area in mm² of the chambers in a plane at a place on its normal (3,)."""
        faces = self.outline
        return sum(
            section_area(faces.points[faces.triangles[chamber.triangles, :3]], normal, place)
            for chamber in self.parts.chambers.values()
        )

    @property
    def radius(self) -> float:
        """Half the smallest width of the box that holds it, mm."""
        return float(np.ptp(self.outline.points, axis=0).min()) / 2.0

    def _voids(self) -> tuple[VoidSpec, ...]:
        voids = shells_of(self.outline).voids
        if not voids:
            raise MeshError(
                "has no closed void; add a table [[body.chamber]] with inside and port, or close its chamber"
            )
        if len(voids) > MOST_CHAMBERS:
            raise MeshError(
                f"has {len(voids)} closed voids, more than {MOST_CHAMBERS}; fill those that are no chambers"
            )
        return tuple(
            VoidSpec.model_construct(name=letters(number), inside=tuple(point_inside(self.outline, void).tolist()))
            for number, void in enumerate(voids)
        )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        description = 'Path of a CAD file, from the folder of the problem file, e.g. file = "finger.step".'
        return with_file(schema, handler, "data", description)


@lru_cache(maxsize=8)
def _ends(body: SolidSpec) -> tuple[np.ndarray, np.ndarray]:
    faces, parts = body.outline, body.parts.triangles
    centres = []
    for name in ("base", "tip"):
        corners = faces.points[faces.triangles[parts[name], :3]]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        centres.append(np.average(corners.mean(axis=1), axis=0, weights=areas))
    return centres[0], centres[1]


def letters(number: int) -> str:
    """A, B, …, Z, A1, B1, … for 0, 1, …."""
    rounds, letter = divmod(number, len(ascii_uppercase))
    return ascii_uppercase[letter] + (str(rounds) if rounds else "")
