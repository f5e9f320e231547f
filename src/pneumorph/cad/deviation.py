"""How far the six-node triangles of a body are from the faces in its file.

Distances are measured at points of a triangle a quarter of its edges apart, and an eighth on those where they are
largest. Where triangles are small the deviation is nearly a polynomial of fourth degree that vanishes at the nodes.
Such a polynomial is nowhere more than 2.5625 and 1.22 times as large as at these points, by linear programmes for the
places of a fine grid. Triangles of an STL, OBJ or 3MF file are flat, and so are those that are made of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.spatial import KDTree

from pneumorph.cad.faces import Faces
from pneumorph.cad.netgen_process import call
from pneumorph.cad.read import Format, in_file, read_faces
from pneumorph.cad.stl import Surface
from pneumorph.cad.triangles import READERS, nearest_on, surface_in
from pneumorph.doing import doing

SAFETY = {4: 2.57, 8: 1.25}
"""Bounds of the deviation, relative to the largest at points of which so many are along an edge."""

SECONDS = 300.0
"""How long measuring may take; a thousand triangles on curved faces take some seconds."""

PLANE = 1e-9
"""Distance of nodes from a plane, relative to the diagonal of the body, up to which a face is plane."""

_WORST = 300
"""Triangles that are measured at the finer points."""


def deviations(data: bytes, form: Format, scale: float, size: float) -> np.ndarray:
    """Bounds (m,) of the distance between each triangle of a body and the faces in its file, mm.

    Parameters
    ----------
    data, form, scale, size
        See `read_faces`, which makes the triangles.

    Raises
    ------
    ComputationError
        If it cannot be measured; a sentence whose subject is the file.
    """
    with doing("measuring the triangles of the body's faces"):
        found = _deviations(data, form, scale, size)
    found.flags.writeable = False
    return found


@lru_cache(maxsize=8)
def _deviations(data: bytes, form: Format, scale: float, size: float) -> np.ndarray:
    faces = read_faces(data, form, scale, size)
    if form in READERS:
        return SAFETY[8] * _from_triangles(faces, data, form, scale)
    found, curved = np.zeros(len(faces.triangles)), np.flatnonzero(_curved(faces))
    if not len(curved):
        return found
    with in_file(data, form) as (path, key):

        def measured(places: np.ndarray, face: np.ndarray) -> np.ndarray:
            return call("distances", path, key, scale, places, face, seconds=SECONDS)[0]

        coarse = _largest(faces, curved, 4, measured)
        worst = np.argsort(-coarse)[:_WORST]
        found[curved] = SAFETY[4] * coarse
        found[curved[worst]] = SAFETY[8] * _largest(faces, curved[worst], 8, measured)
    return found


def between(points: np.ndarray, triangles: np.ndarray, parts: int) -> np.ndarray:
    """Places (m, n, 3) in mm on six-node triangles (m, 6), edges divided in so many parts, that are no nodes."""
    half = parts // 2
    every = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i) if i % half or j % half]
    b, c = np.array(every).T / parts
    a = 1.0 - b - c
    shapes = np.stack([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a], axis=1)
    return np.einsum("sn,tnk->tsk", shapes, points[triangles])


def _largest(
    faces: Faces, some: np.ndarray, parts: int, measured: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """The largest distance (k,) measured on each of some triangles (k,), mm."""
    places = between(faces.points, faces.triangles[some], parts)
    face = np.repeat(faces.face[some], places.shape[1])
    flat = places.reshape(-1, 3)
    # On an edge of two triangles of a face they are measured once.
    same = np.column_stack([np.round(flat / (PLANE * faces.diagonal)), face])
    _, once, number = np.unique(same, axis=0, return_index=True, return_inverse=True)
    return measured(flat[once], face[once])[number.reshape(places.shape[:2])].max(axis=1)


def _curved(faces: Faces) -> np.ndarray:
    """Which triangles (m,) are on faces that are not plane: edges of plane faces are edges of others too."""
    curved = np.zeros(len(faces.triangles), bool)
    for face in np.unique(faces.face):
        own = faces.face == face
        nodes = faces.points[np.unique(faces.triangles[own])]
        thickness = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)[-1]
        curved[own] = thickness > PLANE * faces.diagonal
    return curved


def _from_triangles(faces: Faces, data: bytes, form: Format, scale: float) -> np.ndarray:
    """The largest distances (m,) found between flat triangles and those of a file, in either direction, mm."""
    points, triangles = surface_in(data, form)
    theirs, ours = Surface(scale * points, triangles), Surface(faces.points, faces.triangles[:, :3])
    inner = between(faces.points, faces.triangles, 8)
    away = np.linalg.norm(nearest_on(theirs, inner.reshape(-1, 3)) - inner.reshape(-1, 3), axis=1)
    found = away.reshape(inner.shape[:2]).max(axis=1)
    nearest = nearest_on(ours, theirs.points)
    back = np.linalg.norm(nearest - theirs.points, axis=1)
    # A corner of the file is near all triangles around the vertex that is the nearest to its nearest place.
    corners = KDTree(faces.points).query(nearest)[1]
    at = np.zeros(len(faces.points))
    np.maximum.at(at, corners, back)
    return np.maximum(found, at[faces.triangles].max(axis=1))
