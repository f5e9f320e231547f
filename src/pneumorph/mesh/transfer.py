"""Transfer of a nodal field from one mesh of a body to another."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from pneumorph.mesh.tets import TET_EDGES, TetMesh, tet_gradient, tet_shape

_NEAREST = 24  # elements, nearest by their centroids, that may contain a point
_TRIES = 4  # the most likely of these, for which the curved map is inverted
_INSIDE = -1e-6
_OUTSIDE = -0.15  # smallest barycentric coordinate; points farther outside are moved back before the field is evaluated


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
    element, xi = locate(mesh, points)
    return np.einsum("pa,pam->pm", tet_shape(xi), field[mesh.tets[element]])


def nearest_elements(mesh: TetMesh, other: TetMesh) -> np.ndarray:
    """The element of a mesh (E,) whose centroid is nearest to that of each element of another."""
    here, there = (each.points[each.tets[:, :4]].mean(axis=1) for each in (mesh, other))
    return np.asarray(KDTree(here).query(there)[1])


def linear(mesh: TetMesh, values: np.ndarray) -> np.ndarray:
    """Values (N,) at all nodes of the field that interpolates the corner values linearly."""
    everywhere = values.copy()
    everywhere[mesh.tets[:, 4:]] = values[mesh.tets[:, :4]][:, TET_EDGES].mean(axis=2)
    return everywhere


def locate(mesh: TetMesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The element (n,) that contains each point, or is nearest to it, and the local coordinates (n, 3) in it."""
    nodes = mesh.points[mesh.tets]
    corners = nodes[:, :4]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    nearest = KDTree(corners.mean(axis=1)).query(points, min(_NEAREST, len(nodes)))[1].reshape(len(points), -1)
    # The straight elements show which candidates to try first.
    straight = np.einsum("pkij,pkj->pki", inverse[nearest], points[:, None] - corners[nearest, 0], optimize=True)
    order = np.argsort(-_margin(straight), axis=1)
    best_margin = np.full(len(points), -np.inf)
    element, xi = np.zeros(len(points), dtype=int), np.zeros((len(points), 3))
    for attempt in range(min(_TRIES, nearest.shape[1])):
        open_points = np.nonzero(best_margin < _INSIDE)[0]
        candidate = nearest[open_points, order[open_points, attempt]]
        local = _invert(nodes[candidate], points[open_points], straight[open_points, order[open_points, attempt]])
        margin = _margin(local)
        better = margin > best_margin[open_points]
        where = open_points[better]
        best_margin[where], element[where], xi[where] = margin[better], candidate[better], local[better]
    # Move points far outside towards the centroid until no barycentric coordinate is below the bound.
    pull = np.clip((0.25 - _OUTSIDE) / (0.25 - np.minimum(best_margin, _OUTSIDE)), 0.0, 1.0)[:, None]
    return element, 0.25 + pull * (xi - 0.25)


def _margin(xi: np.ndarray) -> np.ndarray:
    """The smallest barycentric coordinate, negative outside the element."""
    return np.minimum(xi.min(axis=-1), 1.0 - xi.sum(axis=-1))


def _invert(nodes: np.ndarray, points: np.ndarray, start: np.ndarray, iterations: int = 6) -> np.ndarray:
    """Local coordinates of points in quadratic elements, by Newton's method from the given start."""
    xi = np.clip(start, -0.5, 1.5)
    for _ in range(iterations):
        defect = points - np.einsum("pa,pai->pi", tet_shape(xi), nodes)
        jacobian = np.einsum("pai,pak->pik", nodes, tet_gradient(xi))
        # Where the map is singular, far outside an element, any bounded step will do: the candidate is not chosen.
        jacobian[np.abs(np.linalg.det(jacobian)) < 1e-12] = np.eye(3)
        xi = np.clip(xi + np.linalg.solve(jacobian, defect[..., None])[..., 0], -0.5, 1.5)
    return xi
