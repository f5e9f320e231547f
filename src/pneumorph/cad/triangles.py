"""The faces of a body in a file of triangles: its surface is remeshed with triangles of another size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pneumorph.cad.netgen_process import call
from pneumorph.cad.obj import read_obj
from pneumorph.cad.stl import Surface, read_triangles
from pneumorph.cad.threemf import read_3mf
from pneumorph.errors import MeshError
from pneumorph.processes import temporary_folder

READERS: dict[str, Callable[[bytes, int], Surface]] = {"stl": read_triangles, "obj": read_obj, "3mf": read_3mf}

MOST_TRIANGLES = 50_000
"""Triangles of a body that is read: more resolve nothing that elements can."""

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def surface_in(data: bytes, form: str) -> Surface:
    """The points and triangles in the bytes of a file.

    Raises
    ------
    MeshError
        If it has none, or too many; a sentence whose subject is the file.
    """
    try:
        return READERS[form](data, MOST_TRIANGLES)
    except ValueError as error:
        raise MeshError(str(error)) from None


def with_middles(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and six-node triangles with mid-side nodes in the middle of straight edges."""
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middles = points[edges].mean(axis=1)
    return np.concatenate([points, middles]), np.hstack([triangles, len(points) + number.reshape(-1, 3)])


def remeshed(surface: Surface, size: float, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, six-node triangles with edges of about a size in mm, and the smooth part of each.

    All nodes are on the triangles of the surface.

    Raises
    ------
    ComputationError
        If it cannot be remeshed; a sentence whose subject is the file.
    """
    points, triangles = surface
    corners = points[triangles]
    records = np.zeros(len(triangles), _RECORD)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    records["normal"], records["corners"] = normals / np.where(lengths > 0.0, lengths, 1.0), corners
    with temporary_folder() as folder:
        path = folder / "body.stl"
        path.write_bytes(bytes(80) + np.array([len(triangles)], "<u4").tobytes() + records.tobytes())
        found, new, part = call("triangles", str(path), size, seconds=seconds)
    nodes, six = with_middles(found, new)
    return nearest_on(surface, nodes), six, part


def nearest_on(surface: Surface, nodes: np.ndarray) -> np.ndarray:
    """The places on a surface that are nearest to nodes (n, 3)."""
    # Loads Numba, which most problems are read without.
    from pneumorph.cad.boxes import boxes_of, nearest

    return nearest(boxes_of(surface.points, surface.triangles), nodes).place
