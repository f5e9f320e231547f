"""The faces of a body in a file, in curved triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

TURNED = [0, 2, 1, 5, 4, 3]
"""The nodes of a six-node triangle seen from its other side."""


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
    solid : (m,) int
        The solid of each triangle, from 0.
    between : (k, 6) int
        Triangles where two solids meet; normals point from the first of them to the second.
    sides : (k, 2) int
        These two.
    """

    points: np.ndarray
    triangles: np.ndarray
    face: np.ndarray
    names: tuple[str, ...]
    solid: np.ndarray
    between: np.ndarray
    sides: np.ndarray

    def around(self, solid: int) -> np.ndarray:
        """The triangles (t, 6) around one of the solids, normals outwards."""
        own = [self.triangles[self.solid == solid], self.between[self.sides[:, 0] == solid]]
        return np.concatenate([*own, self.between[self.sides[:, 1] == solid][:, TURNED]])

    @property
    def diagonal(self) -> float:
        """Of the box that holds all points, mm."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def compact(
    points: np.ndarray,
    triangles: np.ndarray,
    face: np.ndarray,
    names: tuple[str, ...] = (),
    sides: np.ndarray | None = None,
) -> Faces:
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
    sides : (T, 2) int, optional
        The solids that the normal of each triangle points from and to, −1 for none; by default all bound the only one.
    """
    if sides is None:
        sides = np.tile([0, -1], (len(triangles), 1))
    turned = sides[:, 0] < 0
    triangles, sides = triangles.copy(), np.where(turned[:, None], sides[:, ::-1], sides)
    triangles[turned] = triangles[turned][:, TURNED]
    used, numbers = np.unique(triangles, return_inverse=True)
    numbers, outside = numbers.reshape(-1, 6), sides[:, 1] < 0
    inner = numbers[~outside], sides[~outside]
    return Faces(points[used], numbers[outside], face[outside], names, sides[outside, 0], *inner)
