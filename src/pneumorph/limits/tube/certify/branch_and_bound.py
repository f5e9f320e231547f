"""Smallest distances between patches of surfaces, bounded from both sides by branch and bound.

The lower bound is the width of a slab between the patches (`slabs`); across the common normal of facing walls it is
accurate to second order in the size of the patches; pairs that it does not clear may be cleared to third order by
quadratic polynomials (`quadratic_bounds`). The upper bound is the distance of actual points, found by Newton's
method (`closest_pair`). In pairs that may be nearer than required, the larger patch is halved, repeatedly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.doing import doing
from pneumorph.limits.tube.certify.closest_pair import apart, descend, distance
from pneumorph.limits.tube.certify.quadratic_bounds import clears
from pneumorph.limits.tube.certify.slabs import MEAN, linked, slab, steps
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_DEPTH = 40  # largest number of successive halvings, of both patches together
_SHARE = 256  # pairs that a thread takes at once


class Sides(NamedTuple):
    """The patches of two surfaces, those of the first before those of the second, or those of one twice.

    Attributes
    ----------
    nets, powers : (n, 48) arrays
        Control nets of the patches, and coefficients of v^i u^j; each along v, along u, and component, mm.
    boxes : (n, 8) array
        Start and width in q and in r, and the coefficients of S(v), for distances on the starting tube.
    size : (2,) array
        Circumference and length of that tube, mm.
    second : int
        Which patch is the first of the second surface.
    """

    nets: Floats
    powers: Floats
    boxes: Floats
    size: Floats
    second: int


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
    left, tree, asked = np.arange(len(centres)), KDTree(others), 2
    while len(left):
        away, near = map(np.asarray, tree.query(centres[left], k=min(asked, len(others))))
        counts = count(left[:, None], near)
        first = np.argmax(counts, axis=1)
        found = counts[np.arange(len(left)), first]
        nearest[left[found]], least[left[found]] = near[found, first[found]], away[found, first[found]]
        if asked >= len(others):
            break
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
    at, x = np.full((len(pairs), 4), 0.5), np.empty((12, 3))
    attained = [
        descend(sides.powers, sides.boxes, pair, here, sides.size, neighbourhood, x)
        for pair, here in zip(pairs + np.array([0, sides.second]), at, strict=True)
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
    both = pairs + np.array([0, sides.second])

    def work(some: slice) -> None:
        far(f"{some.start} of {len(pairs)}")
        into = lower[some], attained[some], at[some]
        _bound(both[some], sides[:4], neighbourhood, asked, accuracy, most, _room(), _scratch(), into)

    with doing("pairs of patches") as far:
        each(work, [slice(first, first + _SHARE) for first in range(0, len(pairs), _SHARE)])
    return lower, attained, at


def _room() -> tuple[Floats, ...]:
    """Arrays of `_bound`.

    For the parts of a pair that are still to be looked at, nets, ranges of u and v, and their bounds so far and numbers
    of halvings; for one of them, nets, ranges and a place; derivatives and points of both patches.
    """
    most = _DEPTH + 2
    return _arrays((most, 2, 48), (most, 8), (most, 2), (2, 48), (8,), (4,), (12, 3), (10, 3))


def _scratch() -> tuple[Floats, ...]:
    """Arrays of `_raised`: those of `steps`, `slab`, `linked` and `clears`."""
    return _arrays((3, 2), (4, 3), (6, 4), (13, 3), (4, 4), (4, 4), (4, 4), (4, 4))


def _arrays(*shapes: tuple[int, ...]) -> tuple[Floats, ...]:
    """Arrays in one piece of memory: small ones of two threads would lie in the same lines of the processor's cache."""
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    line = 8
    whole = np.empty(ends[-1] + 2 * line)
    return tuple(
        part.reshape(shape) for part, shape in zip(np.split(whole[line:-line], ends[:-1]), shapes, strict=True)
    )


@numba.njit(cache=True, nogil=True)
def _bound(pairs, sides, neighbourhood, asked, accuracy, most, room, scratch, into):
    """The bounds of some pairs, see `least_distances`; fills its results, which are `into`."""
    nets, powers, boxes, size = sides
    lower, attained, at = into
    gap, decided, bound, needed = accuracy
    stack, ranges, marks, parent, span, here, x, points = room
    directions = scratch[1]
    for k in range(len(pairs)):
        pair, place = pairs[k], at[k]
        for side in range(2):
            number = pair[side]
            for e in range(48):
                stack[0, side, e] = nets[number, e]
        for c in range(8):
            ranges[0, c] = c % 2
        for c in range(3):
            directions[1, c] = 0.0
        least = slab(stack[0], directions)
        if neighbourhood > 0.0 or least < asked:
            least = _raised(stack[0], boxes, pair, ranges[0], size, neighbourhood, asked, least, scratch)
        lower[k] = least
        if least >= asked:
            continue

        # Where points of the whole patches come nearest; a start at the corners and the middles of both.
        best = _start(stack[0], boxes, pair, size, neighbourhood, points, here, place)
        # Nearest points are sought only where they may be nearer than asked: seeking takes as long as several halvings.
        if best < asked:
            best = descend(powers, boxes, pair, place, size, neighbourhood, x)
        elif best < np.inf:
            best = distance(powers, boxes, pair, place, size, neighbourhood, x)
        if best < np.inf:
            for c in range(3):
                directions[1, c] = x[6, c] - x[0, c]

        certified = np.inf
        marks[0, 0], marks[0, 1] = least, 0.0
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
            least, depth = marks[height, 0], marks[height, 1]
            if least >= enough or depth >= _DEPTH or looked > most:
                certified = min(certified, least)
                continue
            for side in range(2):
                for e in range(48):
                    parent[side, e] = stack[height, side, e]
            cut, axis = _longest(parent)
            entry = 4 * cut + 2 * (1 - axis)
            low, high = ranges[height, entry], ranges[height, entry + 1]
            for c in range(8):
                span[c] = ranges[height, c]
            for half in range(2):
                net = stack[height]
                for e in range(48):
                    net[1 - cut, e] = parent[1 - cut, e]
                _halve(parent, cut, axis, half, net)
                for c in range(8):
                    ranges[height, c] = span[c]
                ranges[height, entry + 1 - half] = 0.5 * (low + high)
                bounded = max(least, slab(net, directions))
                if neighbourhood > 0.0 or bounded < enough:
                    bounded = _raised(net, boxes, pair, ranges[height], size, neighbourhood, enough, bounded, scratch)
                marks[height, 0] = bounded
                if bounded >= enough:
                    certified = min(certified, bounded)
                    continue
                for c in range(4):
                    here[c] = 0.5 * (ranges[height, 2 * c] + ranges[height, 2 * c + 1])
                away = distance(powers, boxes, pair, here, size, neighbourhood, x)
                if away < best:
                    if away < asked:
                        away = descend(powers, boxes, pair, here, size, neighbourhood, x)
                    best = away
                    for c in range(4):
                        place[c] = here[c]
                    for c in range(3):
                        directions[1, c] = x[6, c] - x[0, c]
                marks[height, 1] = depth + 1.0
                height += 1
        if asked <= best < np.inf and certified < asked:
            best = descend(powers, boxes, pair, place, size, neighbourhood, x)
        lower[k], attained[k] = max(certified, 0.0), best


@numba.njit(cache=True, forceinline=True)
def _raised(nets, boxes, pair, span, size, neighbourhood, enough, least, scratch):
    """A lower bound of the distance of parts of two patches that is known, raised; infinite if no points count.

    Parameters
    ----------
    nets, boxes, pair, span, size, neighbourhood
        As `steps` and `linked` have them.
    enough : float
        What is larger is not raised further, mm.
    least : float
        The bound that is known, mm.
    scratch : tuple of arrays
        See `_scratch`.
    """
    path, directions, heights, terms, M, L, H, vectors = scratch
    known = True
    if neighbourhood > 0.0:
        reach, known = steps(boxes, pair, span, size, neighbourhood, path)
        if reach < neighbourhood:
            return np.inf
    if known and least < enough:
        if neighbourhood > 0.0:
            least = max(least, linked(nets, path, neighbourhood, directions, heights))
        if least < enough and clears(nets, path, neighbourhood, enough, terms, M, L, H, vectors):
            least = enough
    return least


@numba.njit(cache=True)
def _start(nets, boxes, pair, size, neighbourhood, points, here, place):
    """The least distance between corners and middles of two patches that count, and where it is, in `place` (4,)."""
    for row in range(10):
        for c in range(3):
            points[row, c] = 0.0
            if row % 5 < 4:
                points[row, c] = nets[row // 5, 36 * (row % 5 // 2) + 9 * (row % 5 % 2) + c]
            else:
                for i in range(4):
                    for j in range(4):
                        points[row, c] += MEAN[i] * MEAN[j] * nets[row // 5, 12 * i + 3 * j + c]
    best = np.inf
    for one in range(5):
        for other in range(5):
            square = 0.0
            for c in range(3):
                square += (points[one, c] - points[5 + other, c]) ** 2
            if square < best:
                for side in range(2):
                    number = other if side else one
                    here[2 * side] = number % 2 if number < 4 else 0.5
                    here[2 * side + 1] = number // 2 if number < 4 else 0.5
                if neighbourhood == 0.0 or apart(boxes, pair, here, size) >= neighbourhood:
                    best = square
                    for c in range(4):
                        place[c] = here[c]
    return np.sqrt(best)


@numba.njit(cache=True)
def _longest(nets):
    """Which of two patches, and along which axis, has the longest chord between opposite sides."""
    longest, cut, axis = -1.0, -1, -1
    for number in range(8):
        # Of each axis, two edges.
        side, across = number // 4, number // 2 % 2
        step, first = (9, 36) if across == 0 else (36, 9)
        square = 0.0
        for c in range(3):
            at = number % 2 * first + c
            square += (nets[side, at + step] - nets[side, at]) ** 2
        if square > longest:
            longest, cut, axis = square, side, 1 - across
    return cut, axis


@numba.njit(cache=True)
def _halve(nets, side, axis, half, net):
    """Write the control net of one half of a patch to its side of `net` (2, 48), by de Casteljau's algorithm."""
    line, step = 3 if axis == 0 else 12, 12 if axis == 0 else 3
    for place in range(4):
        for first in range(line * place, line * place + 3):
            # From the end that the half has.
            if half:
                p0, way = first + 3 * step, -step
            else:
                p0, way = first, step
            a, b, c, d = nets[side, p0], nets[side, p0 + way], nets[side, p0 + 2 * way], nets[side, p0 + 3 * way]
            ab, bc, cd = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d)
            abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
            net[side, p0], net[side, p0 + way] = a, ab
            net[side, p0 + 2 * way], net[side, p0 + 3 * way] = abc, 0.5 * (abc + bcd)
