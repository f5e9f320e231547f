"""Uniform refinement: every tetrahedron is divided into eight, so that the finer elements contain the coarser ones.

A part of a quadratic element is a quadratic element of the same geometry, so the refined mesh has the same volumes,
and any field of the coarser mesh is one of the finer mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, TURNED, TetMesh, is_cut, tet_shape

PARTS_OF_TET = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [6, 8, 4, 5], [6, 8, 5, 9], [6, 8, 9, 7], [6, 8, 7, 4]]
)
"""Corners of the eight parts, as nodes of the whole: one at each corner, and four around the diagonal of the middle."""

PARTS_OF_TRIANGLE = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Corners of the four parts of a six-node triangle, as nodes of the whole."""

LOCAL = np.concatenate(
    [np.vstack([np.zeros(3), np.eye(3)]), np.vstack([np.zeros(3), np.eye(3)])[TET_EDGES].mean(axis=1)]
)
"""Local coordinates (10, 3) of the nodes of a tetrahedron."""


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined mesh, whose first nodes are those of the coarser one, and P (N, N_coarse) from values there to here.

    `ends` (n, 2) are the corners between which the mid-side nodes `mids` (n,) of the coarser mesh are.
    """

    mesh: TetMesh
    P: sparse.csr_array
    mids: np.ndarray
    ends: np.ndarray


def refine(mesh: TetMesh) -> Refined:
    """Divide every element into eight.

    Parameters
    ----------
    mesh : without covers.

    Raises
    ------
    ValueError
        If it has covers: quadrature points on parts of faces are not divided.
    """
    if mesh.covers:
        raise ValueError("meshes with covers are not refined")
    parts = _oriented()
    corners = mesh.tets[:, parts]
    edges = np.sort(corners[:, :, TET_EDGES], axis=-1)
    pairs, first, which = np.unique(edges.reshape(-1, 2), axis=0, return_index=True, return_inverse=True)
    count = len(mesh.points)
    tets = np.concatenate([corners, count + which.reshape(edges.shape[:3])], axis=2).reshape(-1, 10)
    weights = tet_shape(LOCAL[parts[:, TET_EDGES]].mean(axis=2)).reshape(-1, 10)
    element, place = np.divmod(first, len(weights))
    rows = np.repeat(np.arange(len(pairs)), 10)
    new = sparse.csr_array((weights[place].ravel(), (rows, mesh.tets[element].ravel())), (len(pairs), count))
    P = sparse.csr_array(sparse.vstack([sparse.eye_array(count), new]))
    numbers = sparse.csr_array((np.arange(1, len(pairs) + 1), (pairs[:, 0], pairs[:, 1])), (count, count))

    def between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """The nodes in the middle of edges of the refined mesh."""
        return count - 1 + numbers[np.minimum(one, other).ravel(), np.maximum(one, other).ravel()].reshape(one.shape)

    def divided(corners: np.ndarray) -> np.ndarray:
        """Six-node triangles with the given corners (n, 3)."""
        ends = corners[:, TRIANGLE_EDGES]
        return np.concatenate([corners, between(ends[..., 0], ends[..., 1])], axis=1)

    images = np.arange(count)
    nodes, sources = mesh.tied
    images[sources] = nodes
    faces = {name: divided(face[:, PARTS_OF_TRIANGLE].reshape(-1, 3)) for name, face in mesh.faces.items()}
    for name in faces:
        if is_cut(name) and name.endswith(" image"):
            # In the order of the first cut, seen from the other side.
            own = mesh.faces[name.removesuffix(" image")][:, PARTS_OF_TRIANGLE].reshape(-1, 3)
            faces[name] = divided(images[own][:, TURNED[:3]])
    regions = {name: (8 * own[:, None] + np.arange(8)).ravel() for name, own in mesh.regions.items()}
    caps = {name: _caps(each, between) for name, each in mesh.caps.items()}
    mids, at = np.unique(mesh.tets[:, 4:], return_index=True)
    ends = mesh.tets[:, TET_EDGES].reshape(-1, 2)[at]
    fine = replace(mesh, points=P @ mesh.points, tets=tets, faces=faces, regions=regions, caps=caps)
    return Refined(fine, P, mids, ends)


def _oriented() -> np.ndarray:
    """The parts of a tetrahedron, with positive volumes."""
    places = LOCAL[PARTS_OF_TET]
    positive = np.linalg.det(places[:, 1:] - places[:, :1]) > 0
    return np.where(positive[:, None], PARTS_OF_TET, PARTS_OF_TET[:, [0, 2, 1, 3]])


def _caps(caps: np.ndarray, between) -> np.ndarray:
    """Each divided where its curved edge is: its nodes are a centre, both ends of the edge, and its middle."""
    centre, one, other, middle = caps.T
    halves = [(centre, one, middle, between(one, middle)), (centre, middle, other, between(middle, other))]
    return np.concatenate([np.column_stack(half) for half in halves])
