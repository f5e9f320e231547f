"""Structured quadratic tetrahedral meshes of blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations

import numpy as np

from pneumorph.mesh.tets import TET_EDGES, TET_FACES, TRIANGLE_EDGES, TetMesh

Mapping = Callable[[np.ndarray], np.ndarray]


def block(counts: Sequence[int], mapping: Mapping, faces: dict[str, Mapping]) -> TetMesh:
    """A unit cube of counts[i] cells along each axis, each of six tetrahedra, with all nodes moved by `mapping`.

    `faces` has, for each name, a predicate on reference coordinates that selects the nodes of that face.
    """
    axes = [np.arange(2 * n + 1) for n in counts]
    shape = tuple(2 * n + 1 for n in counts)
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3) * 2
    tets = []
    for order in permutations(range(3)):
        corners = [np.zeros(3, int)]
        for axis in order:
            corners.append(corners[-1] + 2 * np.eye(3, dtype=int)[axis])
        if np.linalg.det(np.array(corners[1:]) - corners[0]) < 0:
            corners[1], corners[2] = corners[2], corners[1]
        nodes = corners + [(corners[i] + corners[j]) // 2 for i, j in TET_EDGES]
        tets.append([np.ravel_multi_index(tuple((cells + node).T), shape) for node in nodes])
    tets = np.concatenate([np.array(t).T for t in tets])
    reference = lattice / (2 * np.asarray(counts))
    points = mapping(reference)
    _, index, inverse = np.unique(np.round(points, 8), axis=0, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    used = inverse[tets]
    triangles = {name: _face(tets, used, inside(reference)) for name, inside in faces.items()}
    return TetMesh(points[index], used, triangles)


def _face(tets, merged, marked):
    rows = []
    for corners in TET_FACES:
        edges = list(corners)
        middle = [4 + _edge(edges[i], edges[j]) for i, j in TRIANGLE_EDGES]
        local = edges + middle
        chosen = marked[tets[:, local]].all(axis=1)
        rows.append(merged[chosen][:, local])
    return np.concatenate(rows)


def _edge(i, j):
    return next(k for k, pair in enumerate(TET_EDGES) if set(pair) == {i, j})
