"""Smallest distances between patches of surfaces, bounded from both sides by branch and bound.

The lower bound is the width of a slab between the patches (`slabs`); across the common normal of facing walls it is
accurate to second order in the size of the patches; pairs that it does not clear may be cleared to third order by
quadratic polynomials (`quadratic_bounds`). The upper bound is the distance of actual points, found by Newton's
method (`closest_pair`). In pairs that may be nearer than required, the larger patch is halved, repeatedly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.doing import doing
from pneumorph.limits.tube.certify.closest_pair import between, counts, descend
from pneumorph.limits.tube.certify.quadratic_bounds import clears, workspace
from pneumorph.limits.tube.certify.slabs import farthest, linked, slab
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_DEPTH = 40  # largest number of successive halvings, of both patches together
_SHARE = 64  # pairs that a thread takes at once


class Sides(NamedTuple):
    """The patches of two surfaces, or those of one twice.

    Attributes
    ----------
    nets, others : (n, 4, 4, 3) arrays
        Control nets of the patches on either side, mm.
    boxes, other_boxes : (n, 8) arrays
        Start and width in q and in r, and the coefficients of S(v), for distances on the starting tube.
    size : (2,) array
        Circumference and length of that tube, mm.
    """

    nets: Floats
    others: Floats
    boxes: Floats
    other_boxes: Floats
    size: Floats


def spheres(nets: Floats) -> tuple[Floats, Floats]:
    """Centres (n, 3) and radii (n,) of balls around control nets (n, 4, 4, 3)."""
    points = nets.reshape(-1, 16, 3)
    centres = sum((points[:, k] / 16.0 for k in range(16)), np.zeros((len(points), 3)))
    x, y, z = np.moveaxis(points - centres[:, None], -1, 0)
    return centres, np.sqrt((x * x + y * y + z * z).max(axis=1))


def nearest_that_count(
    centres: Floats, others: Floats, count: Callable[[Ints, Ints], NDArray[np.bool_]]
) -> tuple[Ints, Floats]:
    """The nearest of the others to each centre with which it counts: its index (n,) and distance, or infinity.

    Parameters
    ----------
    centres, others : (n, 3) and (m, 3) arrays
        mm.
    count : function
        Whether pairs, (k, 1) centres and (k, l) others, count.
    """
    nearest, least = np.zeros(len(centres), dtype=np.int64), np.full(len(centres), np.inf)
    left, tree, asked = np.arange(len(centres)), KDTree(others), 1
    while len(left) and asked < 4 * len(others):
        away, near = tree.query(centres[left], k=np.arange(1, min(asked, len(others)) + 1))
        counts = count(left[:, None], near)
        first = np.argmax(counts, axis=1)
        found = counts[np.arange(len(left)), first]
        nearest[left[found]], least[left[found]] = near[found, first[found]], away[found, first[found]]
        left, asked = left[~found], max(4 * asked, 24)
    return nearest, least


def candidates(
    centres: Floats, radii: Floats, others: Floats, other_radii: Floats, reach: float, same: bool
) -> tuple[Ints, Floats]:
    """Pairs (m, 2) of patches whose balls are within reach, and the distances (m,) of these balls.

    Parameters
    ----------
    centres, others : (n, 3) arrays
        Centres of the balls on either side, mm.
    radii, other_radii : (n,) arrays
        mm.
    reach : float
        mm.
    same : bool
        Whether both sides are one surface, of which each pair is taken once.
    """
    farthest = reach + radii.max(initial=0.0) + other_radii.max(initial=0.0)
    near = KDTree(centres).sparse_distance_matrix(KDTree(others), farthest, output_type="ndarray")
    i, j, away = near["i"], near["j"], near["v"]
    away = away - radii[i] - other_radii[j]
    some = (away < reach) & ((j >= i) | (not same))
    return np.stack([i[some], j[some]], axis=1), away[some]


def approach(pairs: Ints, sides: Sides, neighbourhood: float) -> tuple[Floats, Floats]:
    """Distances (m,) of the points u, v (m, 4) of pairs of patches that are reached from their middles by `descend`.

    Parameters
    ----------
    pairs : (m, 2) array
        Indices of patches on either side.
    sides : Sides
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    nets, others, boxes, other_boxes, size = sides
    at = np.full((len(pairs), 4), 0.5)
    attained = [
        descend(nets[i], others[j], here, boxes[i], other_boxes[j], size, neighbourhood)
        for (i, j), here in zip(pairs, at, strict=True)
    ]
    return np.array(attained), at


def least_distances(
    pairs: Ints,
    sides: Sides,
    neighbourhood: float,
    asked: float,
    accuracy: tuple[float, float, float, float],
    most: int,
) -> tuple[Floats, Floats, Floats]:
    """Bound the smallest distance of every pair of patches.

    Parameters
    ----------
    pairs : (m, 2) array
        Indices of patches on either side.
    sides : Sides
    neighbourhood : float
        Only points at least this far apart on the starting tube count; all points if it is zero.
    asked : float
        Pairs that are certainly farther apart than this are not refined.
    accuracy : (gap, decided, bound, needed)
        For nearer pairs, the largest difference of both bounds is `gap`, which grows in proportion beyond the distance
        `bound`, and `decided` where they are on both sides of the distance that is `needed`.
    most : int
        Largest number of subdivisions of one pair; the remaining ones then contribute their present lower bounds.

    Returns
    -------
    lower : (m,) array
        Lower bounds.
    attained : (m,) array
        Distances of actual points.
    at : (m, 4) array
        Their u, v on both patches.
    """
    lower, attained, at = np.empty(len(pairs)), np.full(len(pairs), np.inf), np.full((len(pairs), 4), 0.5)

    def work(some: slice) -> None:
        far(f"{some.start} of {len(pairs)}")
        into = lower[some], attained[some], at[some]
        _bound(pairs[some], tuple(sides), neighbourhood, asked, accuracy, most, into)

    with doing("pairs of patches") as far:
        each(work, [slice(first, first + _SHARE) for first in range(0, len(pairs), _SHARE)])
    return lower, attained, at


@numba.njit(cache=True, nogil=True)
def _bound(pairs, sides, neighbourhood, asked, accuracy, most, into):
    """The bounds of some pairs, see `least_distances`; fills its results, which are `into`."""
    nets, others, boxes, other_boxes, size = sides
    lower, attained, at = into
    gap, decided, bound, needed = accuracy
    way, here, whole = np.empty(3), np.empty(4), np.empty(8)
    for c in range(8):
        whole[c] = c % 2
    starts, room = np.empty((2, 5, 3)), workspace()
    parts, halves, extents, span = np.empty((2, 4, 4, 3)), np.empty((2, 4, 4, 3)), np.empty((2, 2)), np.empty(8)
    # Pairs of parts still to look at: nets, ranges of u and v, bounds so far and halvings.
    stack, ranges = np.empty((_DEPTH + 2, 2, 4, 4, 3)), np.empty((_DEPTH + 2, 8))
    bounds, depths = np.empty(_DEPTH + 2), np.empty(_DEPTH + 2, dtype=np.int64)
    for k in range(len(pairs)):
        a, b, box_a, box_b = nets[pairs[k, 0]], others[pairs[k, 1]], boxes[pairs[k, 0]], other_boxes[pairs[k, 1]]
        place = at[k]
        if neighbourhood > 0.0 and farthest(box_a, box_b, whole, size) < neighbourhood:
            lower[k] = np.inf
            continue
        for c in range(3):
            way[c] = 0.0
        least = slab(a, b, way)
        if neighbourhood > 0.0 and least < asked:
            least = max(least, linked(a, b, box_a, box_b, whole, size, neighbourhood))
        if least < asked and clears(a, b, box_a, box_b, whole, size, neighbourhood, asked, room):
            least = asked
        lower[k] = least
        if least >= asked:
            continue

        # Where points of the whole patches come nearest; a start at the corners and the middles of both.
        _starts(a, starts[0])
        _starts(b, starts[1])
        best = np.inf
        for start in range(25):
            one, other = start // 5, start % 5
            away = _away(starts[0, one], starts[1, other])
            if away < best:
                here[0], here[1] = (one % 2, one // 2) if one < 4 else (0.5, 0.5)
                here[2], here[3] = (other % 2, other // 2) if other < 4 else (0.5, 0.5)
                if counts(box_a, box_b, here, size, neighbourhood):
                    best = away
                    for c in range(4):
                        place[c] = here[c]
        # Nearest points are sought only where they may be nearer than asked: seeking takes as long as several halvings.
        if best < np.inf:
            if best < asked:
                best = descend(a, b, place, box_a, box_b, size, neighbourhood)
            between(a, b, place, way)

        certified = np.inf
        _copy(a, stack[0, 0])
        _copy(b, stack[0, 1])
        for c in range(8):
            ranges[0, c] = whole[c]
        bounds[0], depths[0] = least, 0
        height, looked = 1, 0
        while height:
            height -= 1
            enough = asked
            if best < np.inf:
                enough = best - gap * max(1.0, best / bound)
                if best >= needed - decided:
                    enough = max(enough, min(needed, best - decided))
                enough = min(asked, enough)
            looked += 1
            if bounds[height] >= enough or depths[height] >= _DEPTH or looked > most:
                certified = min(certified, bounds[height])
                continue
            least, depth = bounds[height], depths[height]
            for side in range(2):
                _copy(stack[height, side], parts[side])
                for axis in range(2):
                    extents[side, axis] = _extent(parts[side], axis)
            for c in range(8):
                span[c] = ranges[height, c]
            side = 0 if max(extents[0, 0], extents[0, 1]) >= max(extents[1, 0], extents[1, 1]) else 1
            axis = 0 if extents[side, 0] > extents[side, 1] else 1
            _halve(parts[side], axis, halves[0], halves[1])
            entry = 4 * side + (2 if axis == 0 else 0)
            middle = 0.5 * (span[entry] + span[entry + 1])
            for half in range(2):
                for c in range(8):
                    ranges[height, c] = span[c]
                ranges[height, entry + 1 - half] = middle
                if neighbourhood > 0.0 and farthest(box_a, box_b, ranges[height], size) < neighbourhood:
                    continue
                child_a, child_b = stack[height, 0], stack[height, 1]
                _copy(halves[half], stack[height, side])
                _copy(parts[1 - side], stack[height, 1 - side])
                bounds[height] = max(least, slab(child_a, child_b, way))
                if neighbourhood > 0.0 and bounds[height] < enough:
                    link = linked(child_a, child_b, box_a, box_b, ranges[height], size, neighbourhood)
                    bounds[height] = max(bounds[height], link)
                if bounds[height] < enough and clears(
                    child_a, child_b, box_a, box_b, ranges[height], size, neighbourhood, enough, room
                ):
                    bounds[height] = enough
                if bounds[height] >= enough:
                    certified = min(certified, bounds[height])
                    continue
                _middle(child_a, starts[0, 4])
                _middle(child_b, starts[1, 4])
                away = _away(starts[0, 4], starts[1, 4])
                for c in range(4):
                    here[c] = 0.5 * (ranges[height, 2 * c] + ranges[height, 2 * c + 1])
                if away < best and counts(box_a, box_b, here, size, neighbourhood):
                    if away < asked:
                        away = descend(a, b, here, box_a, box_b, size, neighbourhood)
                    best = away
                    for c in range(4):
                        place[c] = here[c]
                    between(a, b, here, way)
                depths[height] = depth + 1
                height += 1
        if asked <= best < np.inf and certified < asked:
            best = descend(a, b, place, box_a, box_b, size, neighbourhood)
        lower[k], attained[k] = max(certified, 0.0), best


@numba.njit(cache=True)
def _starts(net, points):
    """The corners of a patch and its middle, into `points` (5, 3)."""
    for c in range(3):
        points[0, c], points[1, c] = net[0, 0, c], net[0, 3, c]
        points[2, c], points[3, c] = net[3, 0, c], net[3, 3, c]
    _middle(net, points[4])


@numba.njit(cache=True)
def _middle(net, point):
    """The middle of a patch."""
    for c in range(3):
        total = 0.0
        for i in range(4):
            row = net[i, 0, c] + 3.0 * (net[i, 1, c] + net[i, 2, c]) + net[i, 3, c]
            total += row if i % 3 == 0 else 3.0 * row
        point[c] = total / 64.0


@numba.njit(cache=True)
def _away(one, other):
    """Distance of two points."""
    return np.sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2)


@numba.njit(cache=True)
def _copy(source, target):
    """Copy a net."""
    for i in range(4):
        for j in range(4):
            for c in range(3):
                target[i, j, c] = source[i, j, c]


@numba.njit(cache=True)
def _extent(net, axis):
    """Square of the longer chord of a net between its opposite sides, along the edges."""
    longest = 0.0
    for k in range(0, 4, 3):
        square = 0.0
        for c in range(3):
            step = net[3, k, c] - net[0, k, c] if axis == 0 else net[k, 3, c] - net[k, 0, c]
            square += step * step
        longest = max(longest, square)
    return longest


@numba.njit(cache=True)
def _halve(net, axis, first, second):
    """Control nets of both halves of a patch, by de Casteljau's algorithm."""
    for k in range(4):
        for c in range(3):
            if axis == 0:
                p0, p1, p2, p3 = net[0, k, c], net[1, k, c], net[2, k, c], net[3, k, c]
            else:
                p0, p1, p2, p3 = net[k, 0, c], net[k, 1, c], net[k, 2, c], net[k, 3, c]
            p01, p12, p23 = 0.5 * (p0 + p1), 0.5 * (p1 + p2), 0.5 * (p2 + p3)
            p012, p123 = 0.5 * (p01 + p12), 0.5 * (p12 + p23)
            middle = 0.5 * (p012 + p123)
            if axis == 0:
                first[0, k, c], first[1, k, c], first[2, k, c], first[3, k, c] = p0, p01, p012, middle
                second[0, k, c], second[1, k, c], second[2, k, c], second[3, k, c] = middle, p123, p23, p3
            else:
                first[k, 0, c], first[k, 1, c], first[k, 2, c], first[k, 3, c] = p0, p01, p012, middle
                second[k, 0, c], second[k, 1, c], second[k, 2, c], second[k, 3, c] = middle, p123, p23, p3
