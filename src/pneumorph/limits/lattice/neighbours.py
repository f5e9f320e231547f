"""Which triangles of a surface are near each other along it: these are no folds."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.geometry.lattice.pieces import Patches
from pneumorph.limits.lattice.triangles import distances

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def balls(corners: Floats) -> tuple[Floats, Floats]:
    """Centres (n, 3) and radii (n,) of balls that contain triangles (n, 3, 3)."""
    centres = corners.mean(axis=1)
    return centres, np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)


def close_pairs(one: Floats, other: Floats, within: Floats | float, own: bool = False) -> tuple[Ints, Ints]:
    """All pairs of triangles (n, 3, 3) and (m, 3, 3) whose balls are within distances (n,) of each other.

    They are found cell by cell of a grid, and are in ascending order.

    Parameters
    ----------
    one, other : (n, 3, 3) and (m, 3, 3) arrays
        Corners, mm.
    within : float or (n,) array
        mm.
    own : bool
        Whether both are the same triangles: then only pairs i ≤ j are returned.
    """
    (here, small), (there, large) = balls(one), balls(other)
    if not len(here) or not len(there):
        return np.zeros(0, int), np.zeros(0, int)
    reach = small + within
    size = max(float(reach.max() + large.max()), 1e-9)
    lower, upper = there.min(axis=0), there.max(axis=0)
    # No more cells than a few for each triangle.
    size = max(size, float(np.cbrt(np.prod(upper - lower + size) / (4.0 * len(there)))))
    counts = ((upper - lower) / size).astype(int) + 1
    cells = np.minimum(((there - lower) / size).astype(int), counts - 1)
    cell = (cells[:, 0] * counts[1] + cells[:, 1]) * counts[2] + cells[:, 2]
    order = np.argsort(cell, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=int(counts.prod())))])
    grid = lower, size, counts, start, order
    return _close(here, reach, there, large, grid, own)


@numba.njit(cache=True, nogil=True)
def _close(here, reach, there, large, grid, own):
    """The pairs that `close_pairs` returns; of the triangles in a cell `order` has the numbers, from `start` on."""
    lower, size, counts, start, order = grid
    first, second = np.empty(1024, np.int64), np.empty(1024, np.int64)
    low, high, most, count = np.empty(3, np.int64), np.empty(3, np.int64), large.max(), 0
    for i in range(len(here)):
        begun = count
        for k in range(3):
            far, middle = reach[i] + most, here[i, k] - lower[k]
            low[k] = max(int(np.floor((middle - far) / size)), 0)
            high[k] = min(int(np.floor((middle + far) / size)), counts[k] - 1)
        if low[2] > high[2]:
            continue
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                row = (x * counts[1] + y) * counts[2]
                for place in range(start[row + low[2]], start[row + high[2] + 1]):
                    j = order[place]
                    if own and j < i:
                        continue
                    away = 0.0
                    for k in range(3):
                        away += (here[i, k] - there[j, k]) ** 2
                    if away <= (reach[i] + large[j]) ** 2:
                        if count == len(first):
                            first, second = np.append(first, first), np.append(second, second)
                        first[count], second[count] = i, j
                        count += 1
        second[begun:count].sort()
    return first[:count].copy(), second[:count].copy()


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
