"""Uniform refinement: every tetrahedron is divided into eight, so that the finer elements contain the coarser ones.

A part of a quadratic element is a quadratic element of the same geometry, so the refined mesh has the same volumes,
and any field of the coarser mesh is one of the finer mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.clip import clipped, triangles_of
from pneumorph.mesh.tets import RULE, TET_EDGES, TRIANGLE_EDGES, TURNED, Covered, TetMesh, is_cut, tet_shape

PARTS_OF_TET = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [6, 8, 4, 5], [6, 8, 5, 9], [6, 8, 9, 7], [6, 8, 7, 4]]
)
"""Corners of the eight parts, as nodes of the whole: one at each corner, and four around the diagonal of the middle."""

PARTS_OF_TRIANGLE = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Corners of the four parts of a six-node triangle, as nodes of the whole."""

NODES_OF_TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
"""Local coordinates (6, 2) of the nodes of a triangle."""

LOCAL = np.concatenate(
    [np.vstack([np.zeros(3), np.eye(3)]), np.vstack([np.zeros(3), np.eye(3)])[TET_EDGES].mean(axis=1)]
)
"""Local coordinates (10, 3) of the nodes of a tetrahedron."""


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined mesh, whose first nodes are those of the coarser one.

    Attributes
    ----------
    mesh : TetMesh
    P : (N, N_coarse) sparse
        From values at the nodes of the coarser mesh to those here, of fields that are quadratic in its elements.
    linear : (N, N_coarse) sparse
        The same for fields that are linear there, by their values at corners: zeros but at corners here.
    mids : (n,) int
        Mid-side nodes of the coarser mesh, which are corners here.
    """

    mesh: TetMesh
    P: sparse.csr_array
    linear: sparse.csr_array
    mids: np.ndarray


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of tetrahedra or triangles: the `owner` (n,) of each, its corners (n, k), and where they are in the owner.

    `local` (n, k, k − 1) are coordinates of the owner.
    """

    owner: np.ndarray
    corners: np.ndarray
    local: np.ndarray


def refine(mesh: TetMesh) -> Refined:
    """Divide every element into eight.

    What is covered of a face is divided with it, and has as many points in every part as it had in the whole.
    """
    parts = _oriented()
    corners = mesh.tets[:, parts]
    edges = np.sort(corners[:, :, TET_EDGES], axis=-1)
    count = len(mesh.points)
    # Single numbers are sorted several times faster than pairs.
    keys, first, which = np.unique(edges[..., 0].ravel() * count + edges[..., 1].ravel(), True, True)
    pairs = np.column_stack(np.divmod(keys, count))
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
    covers = {}
    for name, own in mesh.covers.items():
        corners, owner = own.nodes[:, PARTS_OF_TRIANGLE].reshape(-1, 3), np.repeat(np.arange(len(own.nodes)), 4)
        local = np.tile(NODES_OF_TRIANGLE[PARTS_OF_TRIANGLE], (len(own.nodes), 1, 1))
        covers[name] = covered_parts(own, Parts(owner, corners, local), divided(corners))
    mids, at = np.unique(mesh.tets[:, 4:], return_index=True)
    ends = mesh.tets[:, TET_EDGES].reshape(-1, 2)[at]
    own = np.unique(mesh.tets[:, :4])
    entries = np.concatenate([np.ones(len(own)), np.full(2 * len(mids), 0.5)])
    places = np.concatenate([own, np.repeat(mids, 2)]), np.concatenate([own, ends.ravel()])
    linear = sparse.csr_array((entries, places), (count + len(pairs), count))
    fine = replace(mesh, points=P @ mesh.points, tets=tets, faces=faces, regions=regions, covers=covers, caps=caps)
    return Refined(fine, P, linear, mids)


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


def covered_parts(own: Covered, parts: Parts, nodes: np.ndarray) -> Covered:
    """The points of what is covered on each part of the faces, whose nodes are (n, 6)."""
    places, along = own.points[..., :2], own.points[..., 3:]
    # What is covered of a face is a triangle, with the points of the rule in it.
    edges = 2.0 * (places[:, 1:] - places[:, :1])
    first = places[:, 0] - edges.sum(axis=1) / 6.0
    origin = parts.local[:, :1]
    # From coordinates of the whole to those of the part.
    inward = np.linalg.inv(parts.local[:, 1:] - origin)
    start, sides = (first[parts.owner, None] - origin) @ inward, edges[parts.owner] @ inward
    within = _barycentric(np.concatenate([start, start + sides], axis=1)).swapaxes(1, 2)
    pieces = [
        (part, piece)
        for part in np.flatnonzero((within.max(axis=2) > 0.0).all(axis=1))
        for piece in triangles_of(clipped(within[part]))
    ]
    chosen = np.array([part for part, _ in pieces], int)
    piece = np.array([piece for _, piece in pieces]).reshape(-1, 3, 2)
    across = piece[:, 1:] - piece[:, :1]
    inner = piece[:, :1] + RULE @ across
    weights = np.abs(np.linalg.det(across @ sides[chosen]))[:, None, None] / 6.0
    # Directions are linear between the points of the whole.
    directions = (2.0 * _barycentric(inner) - 1.0 / 3.0) @ along[parts.owner[chosen]] @ inward[chosen]
    there = start[chosen] + inner @ sides[chosen]
    points = [there, np.broadcast_to(weights, (len(chosen), 3, 1)), directions]
    return Covered(nodes[chosen], np.concatenate(points, axis=2))


def _barycentric(local: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (..., 3) of places (..., 2) in a triangle."""
    return np.concatenate([1.0 - local.sum(axis=-1, keepdims=True), local], axis=-1)
