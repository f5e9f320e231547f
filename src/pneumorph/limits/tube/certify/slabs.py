"""Lower bounds of the distance between two patches.

A patch lies in the convex hull of its control net, and two hulls are at least as far apart as the width of any slab
that separates them. Hulls of neighbouring patches of one tube overlap, although the points that count are a
neighbourhood apart on the starting tube. For these both patches are expanded to first order, so that the bound can
use the difference of the points' parameters.
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.limits.tube.certify.closest_pair import cubic

_DIRECTIONS = 4
"""The given one, that between the middles, and the normals of both patches."""


@numba.njit(cache=True)
def slab(a, b, way):
    """Lower bound of the distance between two nets' hulls: the widest separating slab across four directions."""
    directions = np.empty((_DIRECTIONS, 3))
    for c in range(3):
        middle = 0.0
        for i in range(4):
            for j in range(4):
                middle += b[i, j, c] - a[i, j, c]
        directions[0, c] = middle
        directions[1, c] = way[c]
    _normal(a, directions[2])
    _normal(b, directions[3])
    best = 0.0
    for d in range(_DIRECTIONS):
        x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            continue
        low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
        for i in range(4):
            for j in range(4):
                on_a = x * a[i, j, 0] + y * a[i, j, 1] + z * a[i, j, 2]
                on_b = x * b[i, j, 0] + y * b[i, j, 1] + z * b[i, j, 2]
                low_a, high_a = min(low_a, on_a), max(high_a, on_a)
                low_b, high_b = min(low_b, on_b), max(high_b, on_b)
        best = max(best, max(low_b - high_a, low_a - high_b) / length)
    return best


@numba.njit(cache=True)
def _normal(net, normal):
    """An approximate normal of a patch: the cross product of its diagonals."""
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        p1, p2 = net[3, 3, c1] - net[0, 0, c1], net[3, 3, c2] - net[0, 0, c2]
        q1, q2 = net[3, 0, c1] - net[0, 3, c1], net[3, 0, c2] - net[0, 3, c2]
        normal[c] = p1 * q2 - p2 * q1


@numba.njit(cache=True)
def linked(a, b, box_a, box_b, span, size, neighbourhood):
    """Lower bound of the distance of points a neighbourhood apart on the starting tube; infinite if there are none.

    Along the direction between the patches' centres, the coordinate of either patch is a linear function of the
    parameters plus a remainder that its net bounds. The mean of both slopes multiplies the difference δ of the points
    on the starting tube. δ lies in a rectangle outside a disc around zero, where a linear function has its minimum at a
    corner or where a side meets the circle. Steps around the tube are arcs, shortened to their chords, by which the
    neighbourhood is defined. The difference of the slopes enters with its absolute value; it is small where the
    distance is smallest.

    Parameters
    ----------
    a, b : (4, 4, 3) arrays
        Control nets of both patches, mm.
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    span : (8,) array
        Ranges of u and v on both patches.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    known, between, half_a, half_b = steps(box_a, box_b, span, size, neighbourhood)
    if not known:
        return 0.0
    direction = np.empty(3)
    direction[0], direction[1], direction[2] = 0.0, 0.0, 0.0
    for i in range(4):
        for j in range(4):
            weight = (1.0 if i % 3 == 0 else 3.0) * (1.0 if j % 3 == 0 else 3.0)
            for c in range(3):
                direction[c] += weight * (b[i, j, c] - a[i, j, c])
    length = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    if length == 0.0:
        return 0.0
    for c in range(3):
        direction[c] /= length
    middle_a, q_a, r_a, _, above = _linear(a, direction)
    middle_b, q_b, r_b, below, _ = _linear(b, direction)
    q_a, r_a, q_b, r_b = q_a / half_a[0], r_a / half_a[1], q_b / half_b[0], r_b / half_b[1]
    mean_q, mean_r = 0.5 * (q_a + q_b), 0.5 * (r_a + r_b)
    room_q, room_r = half_a[0] + half_b[0], half_a[1] + half_b[1]
    bound = middle_b - middle_a + below - above - mean_q * between[0] - mean_r * between[1]
    bound -= 0.5 * (abs(q_b - q_a) * room_q + abs(r_b - r_a) * room_r)

    best, radius = np.inf, neighbourhood * neighbourhood
    for side in range(-1, 2, 2):
        on_q, on_r = between[0] + side * room_q, between[1] + side * room_r
        for other in range(-1, 2, 2):
            at_r = between[1] + other * room_r
            if on_q * on_q + at_r * at_r >= radius:
                best = min(best, mean_q * on_q + mean_r * at_r)
            if on_q * on_q <= radius:
                at_r = other * np.sqrt(radius - on_q * on_q)
                if abs(at_r - between[1]) <= room_r:
                    best = min(best, mean_q * on_q + mean_r * at_r)
            if on_r * on_r <= radius:
                at_q = other * np.sqrt(radius - on_r * on_r)
                if abs(at_q - between[0]) <= room_q:
                    best = min(best, mean_q * at_q + mean_r * on_r)
    return bound + best


@numba.njit(cache=True)
def steps(box_a, box_b, span, size, neighbourhood):
    """Steps (q, r) on the starting tube between the middles of two ranges, and half of either range, in mm, as tuples.

    Points that count are a neighbourhood apart by these, see `linked`. The first value is whether there are such steps.

    Parameters
    ----------
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    span : (8,) array
        Ranges of u and v on both patches.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    shrink = min(_most(box_a[4:], span[2], span[3]), _most(box_b[4:], span[6], span[7]))
    if shrink <= 0.0:
        return False, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)
    half_a = 0.5 * (span[1] - span[0]) * box_a[1], 0.5 * (span[3] - span[2]) * box_a[3] * size[1]
    half_b = 0.5 * (span[5] - span[4]) * box_b[1], 0.5 * (span[7] - span[6]) * box_b[3] * size[1]
    around = box_b[0] - box_a[0] + 0.5 * ((span[4] + span[5]) * box_b[1] - (span[0] + span[1]) * box_a[1])
    along = box_b[2] - box_a[2] + 0.5 * ((span[6] + span[7]) * box_b[3] - (span[2] + span[3]) * box_a[3])
    along *= size[1]
    # The largest ratio of chord to arc outside the neighbourhood, for the steps along r between these patches.
    up = abs(along) + half_a[1] + half_b[1]
    chord = np.sqrt(max(neighbourhood * neighbourhood - up * up, 0.0))
    diameter = size[0] * shrink / np.pi
    arc = diameter * np.arcsin(min(chord / diameter, 1.0))
    scale = size[0] * shrink * (chord / arc if arc > 0.0 else 1.0)
    between = scale * ((around + 0.5) % 1.0 - 0.5), along
    return True, between, (scale * half_a[0], half_a[1]), (scale * half_b[0], half_b[1])


@numba.njit(cache=True)
def _linear(net, direction):
    """Coordinate of a patch along a direction: value and slopes at its centre, and bounds of the remainder."""
    value, slope_q, slope_r, below, above = 0.0, 0.0, 0.0, np.inf, -np.inf
    heights = np.empty((4, 4))
    for i in range(4):
        for j in range(4):
            heights[i, j] = 0.0
            for c in range(3):
                heights[i, j] += direction[c] * net[i, j, c]
            by_i, by_j = (1.0 if i % 3 == 0 else 3.0) / 8.0, (1.0 if j % 3 == 0 else 3.0) / 8.0
            value += by_i * by_j * heights[i, j]
            slope_q += by_i * (0.375 if j > 1 else -0.375) * heights[i, j]
            slope_r += by_j * (0.375 if i > 1 else -0.375) * heights[i, j]
    for i in range(4):
        for j in range(4):
            rest = heights[i, j] - value - slope_q * (2.0 * j / 3.0 - 1.0) - slope_r * (2.0 * i / 3.0 - 1.0)
            below, above = min(below, rest), max(above, rest)
    return value, slope_q, slope_r, below, above


@numba.njit(cache=True)
def farthest(box_a, box_b, span, size):
    """Upper bound of the distance on the starting tube for u, v in ranges (8,), first patch first.

    Parameters
    ----------
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    span : (8,) array
        Ranges of u and v on both patches.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    """
    reach = np.empty(2)
    for k in range(2):
        middle_a = box_a[2 * k] + 0.5 * (span[2 * k] + span[2 * k + 1]) * box_a[2 * k + 1]
        middle_b = box_b[2 * k] + 0.5 * (span[4 + 2 * k] + span[5 + 2 * k]) * box_b[2 * k + 1]
        between = abs(middle_a - middle_b)
        if k == 0:
            between = between % 1.0
            between = min(between, 1.0 - between)
        width = abs((span[2 * k + 1] - span[2 * k]) * box_a[2 * k + 1])
        width += abs((span[5 + 2 * k] - span[4 + 2 * k]) * box_b[2 * k + 1])
        reach[k] = between + 0.5 * width
    around = (
        np.sin(np.pi * min(reach[0], 0.5))
        / np.pi
        * min(_most(box_a[4:], span[2], span[3]), _most(box_b[4:], span[6], span[7]))
    )
    return np.hypot(around * size[0], reach[1] * size[1])


@numba.njit(cache=True)
def _most(c, low, high):
    """Upper bound of a cubic between two parameters: that of its chord plus its largest deviation from the chord."""
    bend = max(abs(2.0 * c[2] + 6.0 * c[3] * low), abs(2.0 * c[2] + 6.0 * c[3] * high))
    return max(cubic(c, low), cubic(c, high)) + bend * (high - low) ** 2 / 8.0
