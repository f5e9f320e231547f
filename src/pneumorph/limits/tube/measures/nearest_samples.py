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
_CERTAIN = 1.0 + 1e-9  # by which a cube must be farther than the nearest sample: samples are sorted up to rounding


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
    side = max(reach / 2.0, float(extent.max()) / _MOST, 1e-9)
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
    """The same in the metric |x − y|² + |n − m|² of places and scaled normals, (n, 3) each.

    Parameters
    ----------
    points, ways : (n, 3) arrays
        Places in mm, and normals scaled by a length in mm.
    x, normals : (m, 3) arrays
        The same of the samples.
    reach : float
        mm.
    """
    return _searched(points, ways, x, normals, reach, 1.0)


def _searched(
    points: Floats, ways: Floats, x: Floats, normals: Floats, reach: float, weight: float
) -> tuple[Floats, Ints]:
    near_by = _around(points, x, reach)
    x, normals = x[near_by], normals[near_by] if weight else normals
    if not len(x):
        return np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    sorted_ = cubes(x, reach)
    x, least, most = x[sorted_.order], normals, normals
    if weight:
        normals = normals[sorted_.order]
        filled = np.flatnonzero(np.diff(sorted_.first))
        least, most = np.full((2, len(sorted_.first) - 1, 3), np.inf)
        least[filled] = np.minimum.reduceat(normals, sorted_.first[filled])
        most[filled] = np.maximum.reduceat(normals, sorted_.first[filled])
    samples = x, normals, least, most
    distance, near = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)

    def work(some: slice) -> None:
        ways_here = ways[some] if weight else ways
        _search(points[some], ways_here, samples, tuple(sorted_), reach, weight, distance[some], near[some])

    each(work, [slice(first, first + _SHARE) for first in range(0, max(len(points), 1), _SHARE)])
    return distance, np.where(np.isfinite(distance), near_by[near], 0)


def _around(points: Floats, x: Floats, reach: float) -> Ints:
    """The samples in the box around all points, and as much beyond it as the reach: of a part of a body, a part."""
    if not len(points):
        return np.arange(len(x))
    low, high = points.min(axis=0) - _CERTAIN * reach, points.max(axis=0) + _CERTAIN * reach
    inside = np.ones(len(x), dtype=bool)
    for c in range(3):
        inside &= (x[:, c] >= low[c]) & (x[:, c] <= high[c])
    return np.flatnonzero(inside)


@numba.njit(cache=True, nogil=True)
def _search(points, ways, samples, sorted_, reach, weight, distance, near):
    """Fill distance and near; of equally near samples the one with the smallest index is taken.

    `samples` are places and normals in the order of the cubes, as they are neighbours in memory then, and the least and
    largest components of the normals in each cube: a wall's own samples have none that come near.
    """
    x, normals, least, most = samples
    corner, side, size, first, order = sorted_
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for k in range(len(points)):
        for c in range(3):
            low[c] = max(int(np.floor((points[k, c] - reach - corner[c]) / side)), 0)
            high[c] = min(int(np.floor((points[k, c] + reach - corner[c]) / side)), size[c] - 1)
        best, nearest = reach * reach, -1
        for i in range(low[0], high[0] + 1):
            ahead = _outside(points[k, 0], corner[0] + i * side, corner[0] + (i + 1) * side)
            for j in range(low[1], high[1] + 1):
                beside = ahead + _outside(points[k, 1], corner[1] + j * side, corner[1] + (j + 1) * side)
                if beside > _CERTAIN * best:
                    continue
                for cube in range((i * size[1] + j) * size[2] + low[2], (i * size[1] + j) * size[2] + high[2] + 1):
                    if weight:
                        away = beside
                        for c in range(3):
                            away += _outside(ways[k, c], least[cube, c], most[cube, c])
                        if away > _CERTAIN * best:
                            continue
                    for place in range(first[cube], first[cube + 1]):
                        away = 0.0
                        for c in range(3):
                            away += (points[k, c] - x[place, c]) ** 2
                        if weight and away < best:
                            for c in range(3):
                                away += (ways[k, c] - normals[place, c]) ** 2
                        if away < best or (away == best and nearest > order[place]):
                            best, nearest = away, order[place]
        if nearest >= 0:
            distance[k], near[k] = np.sqrt(best), nearest


@numba.njit(cache=True, nogil=True)
def _outside(value, start, end):
    """Square of how far a value is from a range."""
    return max(start - value, value - end, 0.0) ** 2
