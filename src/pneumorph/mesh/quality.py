"""Quality of quadratic tetrahedra."""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.mesh.tets import TET_EDGES, TET_RULE, tet_gradient

_CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
_POINTS = np.concatenate([TET_RULE, _CORNERS, _CORNERS[TET_EDGES].mean(axis=1)])
_GRADIENTS = np.ascontiguousarray(tet_gradient(_POINTS))  # (14, 10, 3)


def scaled_jacobian(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Quality of each element: √2·min det(dX/dξ) / ℓ³ with ℓ the root mean square of the six corner distances.

    The minimum is over quadrature points, corners and mid-side nodes. A regular straight tetrahedron has quality 1, one
    that is inverted at any of these points has a negative quality.

    Parameters
    ----------
    points : (N, 3) float
    tets : (M, 10) int

    Returns
    -------
    (M,) float
    """
    return _each(np.ascontiguousarray(points, dtype=float), tets)


@numba.njit(cache=True, nogil=True)
def _each(points, tets):
    qualities, nodes = np.empty(len(tets)), np.empty((10, 3))
    for e in range(len(tets)):
        for a in range(10):
            for i in range(3):
                nodes[a, i] = points[tets[e, a], i]
        qualities[e] = of_element(nodes)
    return qualities


@numba.njit(cache=True, nogil=True)
def of_element(nodes):
    """`scaled_jacobian` of one element with these nodes (10, 3)."""
    least, tangents = np.inf, np.empty((3, 3))
    for g in range(len(_GRADIENTS)):
        tangents.fill(0.0)
        for a in range(10):
            for k in range(3):
                for i in range(3):
                    tangents[k, i] += _GRADIENTS[g, a, k] * nodes[a, i]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = tangents
        determinant = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        least = min(least, determinant)
    squares = 0.0
    for a in range(4):
        for b in range(a):
            for i in range(3):
                squares += (nodes[a, i] - nodes[b, i]) ** 2
    return np.sqrt(2.0) * least / (squares / 6.0) ** 1.5
