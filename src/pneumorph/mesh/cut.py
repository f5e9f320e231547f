"""The cut face of half a body: six-node triangles in the mirror plane, bounded by the profiles of the cut surfaces."""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.plane import triangulate
from pneumorph.mesh.tets import TRIANGLE_EDGES
from pneumorph.problem.symmetry import NORMALS


def with_cut(
    faces: dict[str, np.ndarray], nodes: np.ndarray, mirror: str, size: float
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Close the surfaces of half a body by a face in its mirror plane.

    Parameters
    ----------
    faces : dict of (nf, 6) int
        Triangles of the surfaces, which are open in the plane.
    nodes : (n, 3) float
    mirror : "xz" or "yz"
    size : float
        Desired edge length away from the surfaces, mm.

    Returns
    -------
    faces : dict of (nf, 6) int
        The given ones and ``"mirror <plane>"``, whose normals point out of the meshed half.
    nodes : (n + added, 3) float
        The given ones first; those in the plane are moved into it exactly.

    Raises
    ------
    MeshError
        If profiles cross.
    """
    normal = NORMALS[mirror]
    axes = [(normal + 2) % 3, (normal + 1) % 3]  # ordered so that counter-clockwise triangles face the missing half
    rim = _open_edges(np.concatenate(list(faces.values())))
    nodes = nodes.copy()
    nodes[np.unique(rim), normal] = 0.0

    vertices, edges = np.unique(rim[:, :2], return_inverse=True)
    edges = edges.reshape(-1, 2)
    flat, middles = nodes[vertices][:, axes], nodes[rim[:, 2]][:, axes]
    inside, triangles = triangulate(flat, edges, middles, size)
    number = np.concatenate([vertices, len(nodes) + np.arange(len(inside))])
    corners = number[triangles]

    ends = np.sort(corners[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    inner, inverse = np.unique(ends, axis=0, return_inverse=True)
    mids = len(nodes) + len(inside) + np.arange(len(inner))
    # Edges of the rim have their mid-side nodes already; the other edges get consecutive numbers.
    known = {(min(a, b), max(a, b)): mid for a, b, mid in rim.tolist()}
    on_rim = np.array([edge in known for edge in map(tuple, inner.tolist())])
    mids[~on_rim] = len(nodes) + len(inside) + np.arange(np.count_nonzero(~on_rim))
    mids[on_rim] = [known[edge] for edge in map(tuple, inner[on_rim].tolist())]
    added = np.zeros((len(inside), 3))
    added[:, axes] = inside
    nodes = np.concatenate([nodes, added])
    nodes = np.concatenate([nodes, nodes[inner[~on_rim]].mean(axis=1)])
    return faces | {f"mirror {mirror}": np.hstack([corners, mids[inverse.reshape(-1, 3)]])}, nodes


def _open_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (n, 3) with only one triangle: ends, in the order of the missing second triangle, and mid-side node."""
    edges = np.concatenate([triangles[:, TRIANGLE_EDGES], triangles[:, 3:, None]], axis=2).reshape(-1, 3)
    _, first, count = np.unique(edges[:, 2], return_index=True, return_counts=True)
    return edges[first[count == 1]][:, [1, 0, 2]]
