"""Tetrahedra between the surfaces: Netgen fills the triangulated body, we add mid-side nodes and mend flat elements."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import netgen.meshing as netgen
import numpy as np

from pneumorph.errors import MeshError
from pneumorph.mesh.surface import SurfaceMesh
from pneumorph.mesh.tets import TET_EDGES, TET_FACES, TRIANGLE_EDGES


def fill(points: np.ndarray, triangles: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Fill a closed triangulated body with straight tetrahedra.

    Parameters
    ----------
    points : (n, 3) float
        Vertices; they keep their numbers.
    triangles : (nt, 3) int
        Normals point out of the solid.
    size : float
        Longest edge wanted inside, mm.

    Returns
    -------
    points : (n + interior, 3) float
    tets : (M, 4) int
        Positively oriented.

    Raises
    ------
    MeshError
        If Netgen finds no filling, as when the triangles of two walls cross.
    """
    mesh = netgen.Mesh()
    face = mesh.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    mesh.AddPoints(np.ascontiguousarray(points))
    mesh.AddElements(dim=2, index=face, data=np.ascontiguousarray(triangles, dtype=np.int32), base=0)
    with _silence():
        try:
            mesh.GenerateVolumeMesh(maxh=size)
        except Exception as error:  # Netgen raises bare Exceptions
            raise MeshError(f"the body could not be filled with tetrahedra: {error}") from error
    elements = mesh.Elements3D().NumPy()
    if not len(elements):
        raise MeshError("the body could not be filled with tetrahedra")
    # Netgen's arrays are views of memory that goes with its mesh.
    filled = np.array(mesh.Coordinates())
    tets = elements["nodes"][:, :4].astype(np.int64) - 1
    inverted = _volumes(filled, tets) < 0
    tets[inverted] = tets[inverted][:, [0, 2, 1, 3]]
    return filled, tets


@contextmanager
def _silence() -> Iterator[None]:
    """Keep Netgen, which prints from C++, off the screen."""
    netgen_level = 0
    netgen.SetMessageImportance(netgen_level)
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        for fd, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, fd)
            os.close(copy)
        os.close(nowhere)


def _volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Six times the signed volume of straight tetrahedra."""
    a, b, c, d = np.moveaxis(points[tets], 1, 0)
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
