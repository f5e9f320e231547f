"""Read the faces of a body in a file, in triangles of any size."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from hashlib import blake2b
from typing import Literal

import numpy as np

from pneumorph.cad.faces import Faces, compact
from pneumorph.cad.netgen_process import call
from pneumorph.cad.shells import shells_of
from pneumorph.cad.stl import Surface
from pneumorph.cad.triangles import READERS, remeshed, surface_in, with_middles
from pneumorph.doing import doing
from pneumorph.errors import MeshError
from pneumorph.processes import temporary_folder

Format = Literal["step", "brep", "stl", "obj", "3mf"]

FORMATS: dict[str, Format] = {
    **{".step": "step", ".stp": "step", ".brep": "brep", ".brp": "brep"},
    **{".stl": "stl", ".obj": "obj", ".3mf": "3mf"},
}
"""By suffixes."""

MOST_FACES = 5_000
"""Faces of a solid: thousands come from triangles or threads, which no elements can resolve."""

SECONDS = 60.0
"""How long reading and meshing a file may take; hundreds of faces take some seconds."""

COARSE = 25.0
"""Edges of a coarse outline of triangles along the diagonal of a body."""

_FACE = {"step": re.compile(rb"\b(?:ADVANCED_FACE|FACE_SURFACE)\s*\("), "brep": re.compile(rb"^Fa\s*$", re.MULTILINE)}
"""What stands once for every face of a file."""


def read_faces(data: bytes, form: Format, scale: float = 1.0, size: float = 0.0, cuts: tuple[int, ...] = ()) -> Faces:
    """The faces of the solids in the bytes of a file.

    Parameters
    ----------
    data : what the file contains.
    form : its format.
    scale : factor on its coordinates.
    size : desired edge length, mm; 0 for a coarse outline.
    cuts : axes, 0 to 2; only faces at positive coordinates along these, which are open there. Not of triangles.

    Raises
    ------
    ComputationError
        If they cannot be read or meshed; a sentence whose subject is the file.
    """
    with doing("reading the body's file"):
        return _read(data, form, scale, size, cuts)


@lru_cache(maxsize=6)
def _read(data: bytes, form: Format, scale: float, size: float, cuts: tuple[int, ...]) -> Faces:
    if form in READERS:
        return _of_triangles(data, form, scale, size)
    # Reading tens of thousands of faces takes minutes, so they are counted first.
    if (count := len(_FACE[form].findall(data))) > MOST_FACES:
        raise MeshError(f"has {count} faces, more than {MOST_FACES}; simplify it in CAD")
    with in_file(data, form) as (path, key):
        points, triangles, face, names, sides = call(
            "solids", path, key, scale, size, MOST_FACES, cuts, seconds=SECONDS
        )
    return compact(points, triangles, face, tuple(names), sides)


@contextmanager
def in_file(data: bytes, form: Format) -> Iterator[tuple[str, str]]:
    """The path of a file with these bytes for a while, and a key that no file of another content has."""
    with temporary_folder() as folder:
        path = folder / f"body.{form}"
        path.write_bytes(data)
        yield str(path), blake2b(data, digest_size=16).hexdigest()


def _of_triangles(data: bytes, form: Format, scale: float, size: float) -> Faces:
    points, triangles = surface_in(data, form)
    surface = Surface(scale * points, triangles)
    rough = compact(*with_middles(*surface), np.arange(len(triangles)))
    shells_of(rough)
    size = size or rough.diagonal / COARSE
    return compact(*remeshed(surface, size, SECONDS))
