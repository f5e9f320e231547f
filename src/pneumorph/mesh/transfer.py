"""Transfer of a nodal field from one mesh of a body to another."""

from __future__ import annotations

import numba
import numpy as np
from scipy.spatial import KDTree

from pneumorph.mesh.tets import TET_EDGES, TET_RULE, TetMesh, tet_shape

_NEAREST = 24  # elements, nearest by their centroids, that may contain a point
_TRIES = 4  # the most likely of these, for which the curved map is inverted
_ITERATIONS = 6  # of Newton's method
_INSIDE = -1e-6  # barycentric coordinate from which a point counts as inside: rounding of Newton's method
_OUTSIDE = -0.15  # smallest barycentric coordinate; points farther outside are moved back before the field is evaluated
_SLOPES = np.vstack([-np.ones(3), np.eye(3)])  # of the barycentric coordinates


def transfer(mesh: TetMesh, field: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Evaluate a field given at the nodes of a mesh at other points.

    Parameters
    ----------
    mesh : TetMesh
        The old mesh, with the node positions for which ``field`` was computed.
    field : (N, m) float
        Values at the nodes.
    points : (n, 3) float
        Points of the same body. For those slightly outside the old mesh, whose boundary approximates the surface
        differently, the field is extrapolated from the nearest element.

    Returns
    -------
    (n, m) float
    """
    return at_places(mesh, field, locate(mesh, points))


def at_places(mesh: TetMesh, field: np.ndarray, places: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Evaluate a field (N, m) given at the nodes of a mesh at places in its elements, see `locate`; (n, m)."""
    element, xi = places
    return np.einsum("pa,pam->pm", tet_shape(xi), field[mesh.tets[element]])


def between_points(values: np.ndarray, places: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Evaluate values (…, 4, E) at the quadrature points of elements, linear within each, at places; (…, n)."""
    element, xi = places
    return np.einsum("...qp,pq->...p", values[..., element], _barycentric(xi) @ np.linalg.inv(_barycentric(TET_RULE)))


def quadrature_points(tets: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Places (4 E, 3) of the quadrature points of tetrahedra (E, 10) with nodes X (N, 3), the first of each first."""
    return np.einsum("qa,eai->qei", tet_shape(TET_RULE), X[tets]).reshape(-1, 3)


def _barycentric(xi: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (n, 4) of local ones (n, 3)."""
    return np.column_stack([1.0 - xi.sum(axis=1), xi])


def linear(mesh: TetMesh, values: np.ndarray) -> np.ndarray:
    """Values (N,) at all nodes of the field that interpolates the corner values linearly."""
    everywhere = values.copy()
    everywhere[mesh.tets[:, 4:]] = values[mesh.tets[:, :4]][:, TET_EDGES].mean(axis=2)
    return everywhere


def locate(mesh: TetMesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The element (n,) that contains each point, or is nearest to it, and the local coordinates (n, 3) in it."""
    corners = mesh.points[mesh.tets[:, :4]]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    nearest = KDTree(corners.mean(axis=1)).query(points, min(_NEAREST, len(corners)))[1].reshape(len(points), -1)
    element, xi, best_margin = _located(mesh.points, mesh.tets, inverse, nearest, points)
    # Move points far outside towards the centroid until no barycentric coordinate is below the bound.
    pull = np.clip((0.25 - _OUTSIDE) / (0.25 - np.minimum(best_margin, _OUTSIDE)), 0.0, 1.0)[:, None]
    return element, 0.25 + pull * (xi - 0.25)


@numba.njit(cache=True, nogil=True)
def _located(places, tets, inverse, nearest, points):
    """The best of the nearest elements of each point, the local coordinates in it and their margin."""
    count, most = nearest.shape
    element, local, best = np.zeros(count, np.int64), np.zeros((count, 3)), np.full(count, -np.inf)
    starts, margins, tried, xi = np.empty((most, 3)), np.empty(most), np.empty(most, np.bool_), np.empty(3)
    for p in range(count):
        # The straight elements show which candidates to try first.
        for k in range(most):
            e = nearest[p, k]
            for i in range(3):
                starts[k, i] = 0.0
                for j in range(3):
                    starts[k, i] += inverse[e, i, j] * (points[p, j] - places[tets[e, 0], j])
            margins[k] = _margin(starts[k, 0], starts[k, 1], starts[k, 2])
            tried[k] = False
        for _ in range(min(_TRIES, most)):
            chosen = -1
            for k in range(most):
                if not tried[k] and (chosen < 0 or margins[k] > margins[chosen]):
                    chosen = k
            tried[chosen], e = True, nearest[p, chosen]
            for i in range(3):
                xi[i] = min(max(starts[chosen, i], -0.5), 1.5)
            for _ in range(_ITERATIONS):
                if _newton_step(places, tets, e, points, p, xi) < 1e-14:
                    break
            margin = _margin(xi[0], xi[1], xi[2])
            if margin > best[p]:
                element[p], best[p] = e, margin
                for i in range(3):
                    local[p, i] = xi[i]
            if best[p] >= _INSIDE:
                break
    return element, local, best


@numba.njit(cache=True, nogil=True)
def _margin(x, y, z):
    """The smallest barycentric coordinate, negative outside the element."""
    return min(min(x, y), min(z, 1.0 - x - y - z))


@numba.njit(cache=True, nogil=True)
def _newton_step(places, tets, e, points, p, xi):
    """Move the local coordinates in a quadratic element towards those of a point; returns by how much."""
    w, x, y, z = 1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]
    barycentric = (w, x, y, z)
    rx, ry, rz = points[p, 0], points[p, 1], points[p, 2]
    ax = ay = az = bx = by = bz = cx = cy = cz = 0.0
    for node in range(10):
        px, py, pz = places[tets[e, node], 0], places[tets[e, node], 1], places[tets[e, node], 2]
        if node < 4:
            own = barycentric[node]
            value, slope = own * (2.0 * own - 1.0), 4.0 * own - 1.0
            da, db, dc = slope * _SLOPES[node, 0], slope * _SLOPES[node, 1], slope * _SLOPES[node, 2]
        else:
            i, j = TET_EDGES[node - 4, 0], TET_EDGES[node - 4, 1]
            one, other = 4.0 * barycentric[i], 4.0 * barycentric[j]
            value = one * barycentric[j]
            da = one * _SLOPES[j, 0] + other * _SLOPES[i, 0]
            db = one * _SLOPES[j, 1] + other * _SLOPES[i, 1]
            dc = one * _SLOPES[j, 2] + other * _SLOPES[i, 2]
        rx, ry, rz = rx - value * px, ry - value * py, rz - value * pz
        ax, ay, az = ax + da * px, ay + da * py, az + da * pz
        bx, by, bz = bx + db * px, by + db * py, bz + db * pz
        cx, cy, cz = cx + dc * px, cy + dc * py, cz + dc * pz
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    determinant = ax * ux + ay * uy + az * uz
    # The map is singular far outside an element: any bounded step will do, for the candidate is not chosen.
    step = (rx, ry, rz)
    if abs(determinant) >= 1e-12:
        step = (
            (ux * rx + uy * ry + uz * rz) / determinant,
            ((cy * az - cz * ay) * rx + (cz * ax - cx * az) * ry + (cx * ay - cy * ax) * rz) / determinant,
            ((ay * bz - az * by) * rx + (az * bx - ax * bz) * ry + (ax * by - ay * bx) * rz) / determinant,
        )
    moved = 0.0
    for i in range(3):
        before = xi[i]
        xi[i] = min(max(before + step[i], -0.5), 1.5)
        moved = max(moved, abs(xi[i] - before))
    return moved
