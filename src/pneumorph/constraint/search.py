"""Nearest samples within a distance, found through a grid of cubes.

Only samples in the cubes around a point are looked at. For the short distances of limits this takes a fifth of the time
of a search tree, whose building alone costs as much. Queries are shared among threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_SHARE = 2048  # queries that a thread takes at once
_MOST = 64  # cubes along each side of the box around all samples


class Cubes(NamedTuple):
    """Samples sorted by the cubes that contain them.

    Attributes
    ----------
    corner : (3,) array
        Lower corner of the first cube, mm.
    side : float
        Side of the cubes, mm.
    size : (3,) array
        Cubes in each direction.
    first : (m + 1,) array
        Index of each cube's first sample in `order`, and the number of all samples.
    order : (n,) array
        The samples.
    """

    corner: Floats
    side: float
    size: Ints
    first: Ints
    order: Ints


def cubes(x: Floats, reach: float) -> Cubes:
    """Sort samples at x (n, 3) for queries within `reach` mm."""
    corner, extent = x.min(axis=0), np.ptp(x, axis=0)
    side = max(reach, float(extent.max()) / _MOST, 1e-9)
    size = (extent / side).astype(np.int64) + 1
    place = np.minimum(((x - corner) / side).astype(np.int64), size - 1)
    number = (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2]
    first = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=int(size.prod())))])
    return Cubes(corner, side, size, first, np.argsort(number, kind="stable"))


def nearest_samples(points: Floats, x: Floats, reach: float) -> tuple[Floats, Ints]:
    """Distance (n,) from each point to the nearest sample, and its index; infinite and 0 if none is within `reach`."""
    none = np.zeros((1, 3))
    return _searched(points, none, x, none, reach, 0.0)


def facing_samples(points: Floats, ways: Floats, x: Floats, normals: Floats, reach: float) -> tuple[Floats, Ints]:
    """The same in the metric |x − y|² + |n − m|² of places and scaled normals, (n, 3) each."""
    return _searched(points, ways, x, normals, reach, 1.0)


def _searched(
    points: Floats, ways: Floats, x: Floats, normals: Floats, reach: float, weight: float
) -> tuple[Floats, Ints]:
    sorted_ = cubes(x, reach)
    distance, near = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)

    def work(some: slice) -> None:
        ways_here = ways[some] if weight else ways
        _search(points[some], ways_here, x, normals, tuple(sorted_), reach, weight, distance[some], near[some])

    each(work, [slice(first, first + _SHARE) for first in range(0, max(len(points), 1), _SHARE)])
    return distance, near


@numba.njit(cache=True, nogil=True)
def _search(points, ways, x, normals, sorted_, reach, weight, distance, near):
    """Fill distance and near; of equally near samples the one with the smallest index is taken."""
    corner, side, size, first, order = sorted_
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for k in range(len(points)):
        for c in range(3):
            low[c] = max(int(np.floor((points[k, c] - reach - corner[c]) / side)), 0)
            high[c] = min(int(np.floor((points[k, c] + reach - corner[c]) / side)), size[c] - 1)
        if low[2] > high[2]:
            continue
        best, found = reach * reach, -1
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                row = (i * size[1] + j) * size[2]
                # Cubes along z are neighbours in memory.
                for place in range(first[row + low[2]], first[row + high[2] + 1]):
                    other = order[place]
                    away = 0.0
                    for c in range(3):
                        away += (points[k, c] - x[other, c]) ** 2
                    if weight and away < best:
                        for c in range(3):
                            away += (ways[k, c] - normals[other, c]) ** 2
                    if away < best or (away == best and found > other):
                        best, found = away, other
        if found >= 0:
            distance[k], near[k] = np.sqrt(best), found
