"""The faces of the solids in a file, in curved triangles of any size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b
from typing import Literal

import numpy as np

from pneumorph.cad.netgen_process import call
from pneumorph.processes import temporary_folder

Format = Literal["step", "brep"]

MOST_FACES = 5_000
"""Faces of a solid: thousands come from triangles or threads, which no elements can resolve."""

SECONDS = 60.0
"""How long reading and meshing a file may take; hundreds of faces take some seconds."""


@dataclass(frozen=True, eq=False)
class Faces:
    """Six-node triangles of the faces of solids, whose nodes are on the exact faces.

    Attributes
    ----------
    points : (n, 3) float
        mm.
    triangles : (m, 6) int
        Corners, then mid-side nodes of the edges 01, 12, 20; normals point out of the solid.
    face : (m,) int
        The face of each.
    names : tuple of str
        Of the faces; "" for one without a name.
    solids : int
        How many there are.
    """

    points: np.ndarray
    triangles: np.ndarray
    face: np.ndarray
    names: tuple[str, ...]
    solids: int

    @property
    def diagonal(self) -> float:
        """Of the box that holds all points, mm."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def read_faces(data: bytes, form: Format, scale: float = 1.0, size: float = 0.0) -> Faces:
    """The faces of the solids in the bytes of a file.

    Parameters
    ----------
    data : what the file contains.
    form : its format.
    scale : factor on its coordinates.
    size : desired edge length, mm; 0 for a coarse outline.

    Raises
    ------
    ComputationError
        If they cannot be read or meshed; a sentence whose subject is the file.
    """
    return _read(data, form, scale, size)


@lru_cache(maxsize=4)
def _read(data: bytes, form: Format, scale: float, size: float) -> Faces:
    key = blake2b(data, digest_size=16).hexdigest()
    with temporary_folder() as folder:
        path = folder / f"body.{form}"
        path.write_bytes(data)
        points, triangles, face, names, solids = call(
            "solids", str(path), key, scale, size, MOST_FACES, seconds=SECONDS
        )
    # Only nodes of triangles, in the order of their numbers.
    used, numbers = np.unique(triangles, return_inverse=True)
    return Faces(points[used], numbers.reshape(-1, 6), face, tuple(names), solids)
