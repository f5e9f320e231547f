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
_FARTHEST = 7**3  # most cubes within reach of one, whose side is at least half of the reach
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
    extent = max(float(np.ptp(component)) for component in x.T)
    side = max(reach / 2.0, extent / _MOST, 1e-9)
    number, corner, size = _numbers(x, side)
    first = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=int(size.prod())))])
    return Cubes(corner, side, size, first, np.argsort(number, kind="stable"))


def _numbers(x: Floats, side: float) -> tuple[Ints, Floats, Ints]:
    """Numbers (n,) of the cubes that contain places (n, 3), the corner of the first, and how many there are along each
    axis."""
    corner = np.array([component.min() for component in x.T])
    place = ((x - corner) / side).astype(np.int64)
    size = np.array([component.max() + 1 for component in place.T])
    return (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2], corner, size


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
    distance, near = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    near_by = _around(points, x, reach) if len(points) else np.zeros(0, dtype=np.int64)
    x, normals = x[near_by], normals[near_by] if weight else normals
    if not len(x):
        return distance, near
    sorted_ = cubes(x, reach)
    x, least, most = x[sorted_.order], normals, normals
    if weight:
        normals = normals[sorted_.order]
        filled = np.flatnonzero(np.diff(sorted_.first))
        least, most = np.full((2, len(sorted_.first) - 1, 3), np.inf)
        least[filled] = np.minimum.reduceat(normals, sorted_.first[filled])
        most[filled] = np.maximum.reduceat(normals, sorted_.first[filled])
    samples = x, normals, least, most
    # Queries that lie in one cube of the same size look at the same cubes.
    group = _numbers(points, sorted_.side)[0]
    order = np.argsort(group, kind="stable")
    group, points, ways = group[order], points[order], ways[order] if weight else ways

    def work(some: slice) -> None:
        asked = group[some], points[some], ways[some] if weight else ways, order[some]
        _search(asked, samples, tuple(sorted_), reach, weight, distance, near)

    each(work, [slice(first, first + _SHARE) for first in range(0, len(points), _SHARE)])
    return distance, np.where(np.isfinite(distance), near_by[near], 0)


def _around(points: Floats, x: Floats, reach: float) -> Ints:
    """The samples in the box around all points, and as much beyond it as the reach: of a part of a body, a part."""
    inside = np.ones(len(x), dtype=bool)
    # By columns: along the first axis of three columns NumPy is six times as slow.
    for at, component in zip(points.T, x.T, strict=True):
        inside &= (component >= at.min() - _CERTAIN * reach) & (component <= at.max() + _CERTAIN * reach)
    return np.flatnonzero(inside)


@numba.njit(cache=True, nogil=True)
def _search(asked, samples, sorted_, reach, weight, distance, near):
    """Fill distance and near; of equally near samples the one with the smallest index is taken.

    `asked` are groups of queries in their order, their places and ways, and their indices in what is filled. `samples`
    are places and normals in the order of the cubes, as they are neighbours in memory then, and the least and largest
    components of the normals in each cube: a wall's own samples have none that come near.
    """
    group, points, ways, number = asked
    x, normals, least, most = samples
    first, order = sorted_[3:]
    box, ranges = np.empty((4, 3)), np.empty((3, 2), dtype=np.int64)
    found, away, start = np.empty(_FARTHEST, dtype=np.int64), np.empty(_FARTHEST), np.empty((_FARTHEST, 3))
    into = found, away, start
    side = sorted_[1]
    begin = 0
    while begin < len(points):
        end = begin
        box[::2], box[1::2] = np.inf, -np.inf
        while end < len(points) and group[end] == group[begin]:
            for c in range(3):
                box[0, c], box[1, c] = min(box[0, c], points[end, c]), max(box[1, c], points[end, c])
                if weight:
                    box[2, c], box[3, c] = min(box[2, c], ways[end, c]), max(box[3, c], ways[end, c])
            end += 1
        count = _near_cubes(box, samples, sorted_, reach, weight, ranges, into)
        for k in range(begin, end):
            best, nearest = reach * reach, -1
            for m in range(count):
                if away[m] > _CERTAIN * best:
                    break
                cube, beside = found[m], 0.0
                for c in range(3):
                    beside += _between(points[k, c], points[k, c], start[m, c], start[m, c] + side)
                    if weight:
                        beside += _between(ways[k, c], ways[k, c], least[cube, c], most[cube, c])
                if beside > _CERTAIN * best:
                    continue
                for place in range(first[cube], first[cube + 1]):
                    square = 0.0
                    for c in range(3):
                        square += (points[k, c] - x[place, c]) ** 2
                    if weight and square < best:
                        for c in range(3):
                            square += (ways[k, c] - normals[place, c]) ** 2
                    if square < best or (square == best and nearest > order[place]):
                        best, nearest = square, order[place]
            if nearest >= 0:
                distance[number[k]], near[number[k]] = np.sqrt(best), nearest
        begin = end


@numba.njit(cache=True, nogil=True)
def _near_cubes(box, samples, sorted_, reach, weight, ranges, into):
    """Fill `into` with the cubes that have samples within reach of a box, the nearest first; returns how many.

    `box` are the least and largest components of places and of ways.
    """
    least, most = samples[2:]
    corner, side, size, first = sorted_[:4]
    found, away, start = into
    for c in range(3):
        ranges[c, 0] = max(int(np.floor((box[0, c] - reach - corner[c]) / side)), 0)
        ranges[c, 1] = min(int(np.floor((box[1, c] + reach - corner[c]) / side)), size[c] - 1) + 1
    count = 0
    for i in range(ranges[0, 0], ranges[0, 1]):
        at_i = corner[0] + i * side
        ahead = _between(box[0, 0], box[1, 0], at_i, at_i + side)
        for j in range(ranges[1, 0], ranges[1, 1]):
            at_j = corner[1] + j * side
            beside = ahead + _between(box[0, 1], box[1, 1], at_j, at_j + side)
            for k in range(ranges[2, 0], ranges[2, 1]):
                cube = (i * size[1] + j) * size[2] + k
                if first[cube] == first[cube + 1]:
                    continue
                at_k = corner[2] + k * side
                square = beside + _between(box[0, 2], box[1, 2], at_k, at_k + side)
                if weight:
                    for c in range(3):
                        square += _between(box[2, c], box[3, c], least[cube, c], most[cube, c])
                if square > _CERTAIN * reach * reach:
                    continue
                m = count
                while m and away[m - 1] > square:
                    found[m], away[m], start[m] = found[m - 1], away[m - 1], start[m - 1]
                    m -= 1
                found[m], away[m] = cube, square
                start[m, 0], start[m, 1], start[m, 2] = at_i, at_j, at_k
                count += 1
    return count


@numba.njit(cache=True, nogil=True)
def _between(low, high, start, end):
    """Square of the distance between two ranges."""
    return max(start - high, low - end, 0.0) ** 2
