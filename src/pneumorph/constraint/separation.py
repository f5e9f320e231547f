"""Smallest distances between patches of surfaces, bounded from both sides by branch and bound.

The lower bound is the width of a slab between the patches (`slabs`); across the common normal of facing walls it is
accurate to second order in the size of the patches. The upper bound is the distance of actual points, found by Newton's
method (`closest`). In pairs that may be nearer than required, the larger patch is halved, repeatedly.
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.constraint.closest import apart, between, descend, distance
from pneumorph.constraint.slabs import farthest, linked, slab

_DEPTH = 40  # largest number of successive halvings, of both patches together


@numba.njit(cache=True)
def spheres(nets):
    """Centres (n, 3) and radii (n,) of balls around control nets (n, 4, 4, 3)."""
    n = len(nets)
    centres, radii = np.zeros((n, 3)), np.zeros(n)
    for k in range(n):
        for i in range(4):
            for j in range(4):
                for c in range(3):
                    centres[k, c] += nets[k, i, j, c] / 16.0
        for i in range(4):
            for j in range(4):
                away = 0.0
                for c in range(3):
                    away += (nets[k, i, j, c] - centres[k, c]) ** 2
                radii[k] = max(radii[k], np.sqrt(away))
    return centres, radii


@numba.njit(cache=True)
def nearest_centres(centres, others, boxes, other_boxes, size, neighbourhood):
    """Smallest distance between centres of patches a neighbourhood apart (infinite if none), and their indices."""
    best, first, second = np.inf, 0, 0
    for i in range(len(centres)):
        for j in range(len(others)):
            if neighbourhood > 0.0 and apart(boxes[i], other_boxes[j], 0.5, 0.5, 0.5, 0.5, size) < neighbourhood:
                continue
            away = 0.0
            for c in range(3):
                away += (centres[i, c] - others[j, c]) ** 2
            if away < best:
                best, first, second = away, i, j
    return np.sqrt(best), first, second


@numba.njit(cache=True)
def candidates(centres, radii, others, other_radii, reach, same):
    """Pairs (m, 2) of patches whose balls are within reach, and the distances (m,) of these balls."""
    count, found, away = 0, np.empty((0, 2), dtype=np.int64), np.empty(0)
    for fill in range(2):
        if fill:
            found, away = np.empty((count, 2), dtype=np.int64), np.empty(count)
            count = 0
        for i in range(len(centres)):
            for j in range(i if same else 0, len(others)):
                square = 0.0
                for c in range(3):
                    square += (centres[i, c] - others[j, c]) ** 2
                room = reach + radii[i] + other_radii[j]
                if square < room * room:
                    if fill:
                        found[count, 0], found[count, 1] = i, j
                        away[count] = np.sqrt(square) - radii[i] - other_radii[j]
                    count += 1
    return found, away


@numba.njit(cache=True, parallel=True)
def least_distances(pairs, nets, others, boxes, other_boxes, size, neighbourhood, asked, gap, bound, most, seen, at):
    """Bound the smallest distance of every pair of patches; returns lower bounds (m,) in mm.

    Parameters
    ----------
    pairs : (m, 2) array
    nets, others : (n, 4, 4, 3) arrays
        Control nets of the patches on either side.
    boxes, other_boxes : (n, 8) arrays
        Start and width in q and in r, and the coefficients of S(v), for distances on the starting tube.
    size : (float, float)
        Circumference and length of that tube.
    neighbourhood : float
        Only points at least this far apart on the starting tube count; all points if it is zero.
    asked : float
        Pairs that are certainly farther apart than this are not refined.
    gap, bound : float
        For nearer pairs, the largest difference of both bounds; it grows in proportion beyond the distance `bound`.
    most : int
        Largest number of subdivisions of one pair; the remaining ones then contribute their present lower bounds.
    seen, at : (m,) and (m, 4) arrays
        Output: distances of actual points, and their u, v on both patches.
    """
    lower = np.empty(len(pairs))
    for k in numba.prange(len(pairs)):
        i, j = pairs[k]
        lower[k] = _one(
            nets[i],
            others[j],
            boxes[i],
            other_boxes[j],
            size,
            neighbourhood,
            asked,
            gap,
            bound,
            most,
            seen,
            at,
            k,
        )
    return lower


@numba.njit(cache=True)
def _one(a, b, box_a, box_b, size, neighbourhood, asked, gap, bound, most, seen, at, k):
    """Lower bound for one pair; writes to seen[k] and at[k]."""
    here, way = np.full(4, 0.5), np.zeros(3)
    seen[k], at[k] = np.inf, 0.5
    whole = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    if neighbourhood > 0.0 and farthest(box_a, box_b, whole, size) < neighbourhood:
        return np.inf
    least = slab(a, b, way)
    if neighbourhood > 0.0 and least < asked:
        least = max(least, linked(a, b, box_a, box_b, whole, size, neighbourhood))
    if least >= asked:
        return least

    # Closest points of the whole patches, searched from the best of all corners and centres.
    best = np.inf
    for p in range(5):
        for r in range(5):
            trial = np.array([0.5, 0.5, 0.5, 0.5])
            if p < 4:
                trial[0], trial[1] = p % 2, p // 2
            if r < 4:
                trial[2], trial[3] = r % 2, r // 2
            away = distance(a, b, trial, box_a, box_b, size, neighbourhood)
            if away < best:
                best, here = away, trial
    if best < np.inf:
        # Far above the required distance the exact minimum does not matter.
        seen[k] = descend(a, b, here, box_a, box_b, size, neighbourhood) if best < 1.3 * asked else best
        at[k] = here
        between(a, b, here, way)

    certified = np.inf
    stack_a, stack_b = np.empty((_DEPTH + 2, 4, 4, 3)), np.empty((_DEPTH + 2, 4, 4, 3))
    ranges, bounds, depths = np.empty((_DEPTH + 2, 8)), np.empty(_DEPTH + 2), np.empty(_DEPTH + 2, dtype=np.int64)
    stack_a[0], stack_b[0], ranges[0], bounds[0], depths[0] = a, b, whole, least, 0
    height, looked = 1, 0
    first, second = np.empty((4, 4, 3)), np.empty((4, 4, 3))
    while height:
        height -= 1
        enough = asked
        if seen[k] < np.inf:
            enough = min(asked, seen[k] - gap * max(1.0, seen[k] / bound))
        looked += 1
        if bounds[height] >= enough or depths[height] >= _DEPTH or looked > most:
            certified = min(certified, bounds[height])
            continue
        part_a, part_b, span = stack_a[height].copy(), stack_b[height].copy(), ranges[height].copy()
        least, depth = bounds[height], depths[height]
        along_a, along_b = _extent(part_a, 0), _extent(part_b, 0)
        around_a, around_b = _extent(part_a, 1), _extent(part_b, 1)
        on_a = max(along_a, around_a) >= max(along_b, around_b)
        axis = (0 if along_a > around_a else 1) if on_a else (0 if along_b > around_b else 1)
        _halve(part_a if on_a else part_b, axis, first, second)
        entry = (0 if on_a else 4) + (2 if axis == 0 else 0)
        middle = 0.5 * (span[entry] + span[entry + 1])
        for half in range(2):
            child = first if half == 0 else second
            child_a, child_b = (child, part_b) if on_a else (part_a, child)
            ranges[height] = span
            ranges[height, entry + 1 - half] = middle
            if neighbourhood > 0.0 and farthest(box_a, box_b, ranges[height], size) < neighbourhood:
                continue
            bounds[height] = max(least, slab(child_a, child_b, way))
            if neighbourhood > 0.0 and bounds[height] < enough:
                link = linked(child_a, child_b, box_a, box_b, ranges[height], size, neighbourhood)
                bounds[height] = max(bounds[height], link)
            if bounds[height] >= enough:
                certified = min(certified, bounds[height])
                continue
            for c in range(4):
                here[c] = 0.5 * (ranges[height, 2 * c] + ranges[height, 2 * c + 1])
            away = distance(a, b, here, box_a, box_b, size, neighbourhood)
            if away < seen[k]:
                if away < 1.1 * asked:
                    away = descend(a, b, here, box_a, box_b, size, neighbourhood)
                seen[k] = away
                at[k] = here
                between(a, b, here, way)
            stack_a[height], stack_b[height], depths[height] = child_a, child_b, depth + 1
            height += 1
    return max(certified, 0.0)


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
