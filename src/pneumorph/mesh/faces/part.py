"""Faces of the part of a body that its mirror planes leave, which are parts of the faces of the whole body."""

from __future__ import annotations

import numpy as np

from pneumorph.cad.boxes import boxes_of, nearest
from pneumorph.cad.faces import TURNED, Faces
from pneumorph.cad.shells import quarters


def as_in(whole: Faces, part: Faces) -> tuple[Faces, np.ndarray, np.ndarray]:
    """The triangles of a part with the faces and solids of the whole body.

    Also the numbers of triangles of the whole body: (m,) of one of the same face for each in `Faces.triangles`, and
    (k,) of the nearest for each in `Faces.between`.
    """
    near = _nearest(whole.points, whole.triangles, part.points, part.triangles)
    twin = np.empty(len(near), int)
    for face in np.unique(part.face):
        own = part.face == face
        # Single triangles at edges may be nearer to those of other faces.
        same = np.bincount(whole.face[near[own]]).argmax()
        twin[own] = np.flatnonzero(whole.face == same)[0]
    between, sides, meeting = part.between.copy(), part.sides, np.zeros(0, int)
    if len(between):
        meeting = _nearest(whole.points, whole.between, part.points, between)
        normals = [
            _normals(points, some) for points, some in ((whole.points, whole.between[meeting]), (part.points, between))
        ]
        against = np.einsum("ti,ti->t", *normals) < 0.0
        between[against] = between[against][:, TURNED]
        sides = whole.sides[meeting]
    found = Faces(part.points, part.triangles, whole.face[twin], whole.names, whole.solid[twin], between, sides)
    return found, twin, meeting


def _nearest(points: np.ndarray, triangles: np.ndarray, places: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The number of the triangle that is the nearest to the middle of each of others, all six-node ones."""
    middles = places[others[:, 3:]].mean(axis=1)
    return nearest(boxes_of(points, quarters(triangles)), middles).triangle % len(triangles)


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(points[triangles[:, :3]], 1, 0)
    return np.cross(b - a, c - a)
