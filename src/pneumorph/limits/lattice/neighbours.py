"""Which triangles of a surface are near each other along it: these are no folds."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import KDTree

from pneumorph.geometry.lattice.pieces import Patches
from pneumorph.limits.lattice.triangles import distances

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def balls(corners: Floats) -> tuple[Floats, Floats]:
    """Centres (n, 3) and radii (n,) of balls that contain triangles (n, 3, 3)."""
    centres = corners.mean(axis=1)
    return centres, np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)


def close_pairs(one: Floats, other: Floats, within: Floats | float) -> tuple[Ints, Ints]:
    """All pairs of triangles (n, 3, 3) and (m, 3, 3) whose balls are within distances (n,) of each other."""
    (here, small), (there, large) = balls(one), balls(other)
    if not len(here) or not len(there):
        return np.zeros(0, int), np.zeros(0, int)
    reach = small + within
    longest = float(reach.max() + large.max())
    near = KDTree(here).sparse_distance_matrix(KDTree(there), longest, output_type="ndarray")
    i, j = near["i"].astype(int), near["j"].astype(int)
    number = np.sort((i * len(other) + j)[near["v"] <= reach[i] + large[j]])
    return number // len(other), number % len(other)


@dataclass(frozen=True, eq=False)
class Links:
    """Which of `count` triangles are connected: `numbers` are a·count + b of the pairs a, b, in ascending order."""

    numbers: Ints
    count: int

    def hold(self, a: Ints, b: Ints) -> NDArray[np.bool_]:
        """Whether pairs (n,) of triangles are connected."""
        asked = a.astype(np.int64) * self.count + b
        return self.numbers[np.minimum(np.searchsorted(self.numbers, asked), len(self.numbers) - 1)] == asked


def linked(patches: Patches, neighbourhood: float) -> Links:
    """Which triangles are connected: by triangles that are nearer to the first than a neighbourhood, mm.

    Distances are those of the flat triangles in the reference.
    """
    flat = patches.nodes[:, :3]
    i, j = close_pairs(flat, flat, neighbourhood)
    near = distances(flat, flat, i, j)[0] <= neighbourhood
    i, j = i[near], j[near]
    count = len(flat)
    within = sparse.csr_array((np.ones(len(i), bool), (i, j)), (count, count))
    _, corner = np.unique(np.round(flat.reshape(-1, 3), 9), axis=0, return_inverse=True)
    at = sparse.csr_array((np.ones(3 * count), (np.repeat(np.arange(count), 3), corner)))
    beside = sparse.csr_array(at @ at.T)
    reached = np.zeros(within.nnz, bool)
    _flood(within.indptr, within.indices, beside.indptr, beside.indices, reached)
    rows = np.repeat(np.arange(count), np.diff(within.indptr))
    return Links(np.sort(rows[reached] * count + within.indices[reached]), count)


@numba.njit(cache=True, nogil=True)
def _flood(start, near, first, beside, reached):
    """Mark those of the near triangles of each that are reached from it by triangles beside each other."""
    count = len(start) - 1
    place, stack = np.full(count, -1), np.empty(count, np.int64)
    for a in range(count):
        for k in range(start[a], start[a + 1]):
            place[near[k]] = k
        stack[0], height = a, 1
        reached[place[a]] = True
        while height:
            height -= 1
            b = stack[height]
            for k in range(first[b], first[b + 1]):
                c = beside[k]
                if place[c] >= 0 and not reached[place[c]]:
                    reached[place[c]] = True
                    stack[height] = c
                    height += 1
        for k in range(start[a], start[a + 1]):
            place[near[k]] = -1
