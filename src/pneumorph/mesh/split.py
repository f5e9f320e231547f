"""Bisection of long inner edges, which gives walls several edge lengths thick inner vertices."""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES

_PASSES = 10  # most passes, in each of which long edges are halved


def split_long_edges(
    points: np.ndarray, tets: np.ndarray, triangles: np.ndarray, longest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bisect inner edges longer than ``longest``, the longest first.

    Parameters
    ----------
    points : (n, 3) float
    tets : (M, 4) int
    triangles : (nt, 3) int
        Surface triangles, which are not split.
    longest : float
        Largest length of inner edges that is kept, mm.

    Returns
    -------
    points : (n + added, 3) float
    tets : (M', 4) int
    """
    for _ in range(_PASSES):
        n = len(points)
        keys, edge, elements_at = np.unique(_keys(tets[:, TET_EDGES], n), return_inverse=True, return_counts=True)
        edge = edge.reshape(-1, 6)
        a, b = keys // n, keys % n
        length = np.linalg.norm(points[a] - points[b], axis=1)
        length[np.searchsorted(keys, np.unique(_keys(triangles[:, TRIANGLE_EDGES], n)))] = 0.0
        # An edge is split if it is the longest of all elements around it, so that no element is split twice.
        rank = np.argsort(np.argsort(length, kind="stable"))
        local = rank[edge].argmax(axis=1)
        candidate = edge[np.arange(len(tets)), local]
        chosen = (np.bincount(candidate, minlength=len(keys)) == elements_at) & (length > longest)
        if not chosen.any():
            break
        middle = np.zeros(len(keys), dtype=int)
        middle[chosen] = n + np.arange(chosen.sum())
        points = np.concatenate([points, (points[a[chosen]] + points[b[chosen]]) / 2])
        hit = chosen[candidate]
        halves = [tets[hit].copy(), tets[hit].copy()]
        for half, end in zip(halves, TET_EDGES[local[hit]].T, strict=True):
            half[np.arange(len(half)), end] = middle[candidate[hit]]
        tets = np.concatenate([tets[~hit], *halves])
    return points, tets


def _keys(edges: np.ndarray, n: int) -> np.ndarray:
    """One number for each edge (…, 2), independent of its direction."""
    ends = np.sort(edges, axis=-1)
    return ends[..., 0] * n + ends[..., 1]
