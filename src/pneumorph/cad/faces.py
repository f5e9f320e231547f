"""The faces of a body in a file, in curved triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
    """

    points: np.ndarray
    triangles: np.ndarray
    face: np.ndarray
    names: tuple[str, ...]

    @property
    def diagonal(self) -> float:
        """Of the box that holds all points, mm."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def compact(points: np.ndarray, triangles: np.ndarray, face: np.ndarray, names: tuple[str, ...] = ()) -> Faces:
    """Faces with nodes of triangles only, in the order of their numbers.

    Parameters
    ----------
    points : (N, 3) array
        Of all nodes, mm.
    triangles : (T, 6) int
        With mid-side nodes.
    face : (T,) int
        The face of each triangle.
    names : tuple of str
        Of the faces.
    """
    used, numbers = np.unique(triangles, return_inverse=True)
    return Faces(points[used], numbers.reshape(-1, 6), face, names)
