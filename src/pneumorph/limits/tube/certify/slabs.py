"""Lower bounds of the distance between two patches.

A patch lies in the convex hull of its control net, and two hulls are at least as far apart as the width of any slab
that separates them. Hulls of neighbouring patches of one tube overlap, although the points that count are a
neighbourhood apart on the starting tube. For these both patches are expanded to first order, so that the bound can
use the difference of the points' parameters.

Control nets of both patches are (2, 48): along v, along u, and component, mm.
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.limits.tube.certify.closest_pair import around

_DIRECTIONS = 4
"""That between the middles, a given one, and the normals of both patches."""
MEAN = np.array([0.125, 0.375, 0.375, 0.125])
"""Shares of four control points in the middle of a curve."""
_SLOPE = np.array([-0.375, -0.375, 0.375, 0.375])
"""The same in its slope there, for a parameter from -1 to 1."""


@numba.njit(cache=True)
def slab(nets, directions):
    """Lower bound of the distance between two nets' hulls: the widest separating slab across four directions.

    Parameters
    ----------
    nets : (2, 48) array
    directions : (4, 3) array
        The second is given; the others are overwritten.
    """
    for c in range(3):
        directions[0, c] = 0.0
        for point in range(0, 48, 3):
            directions[0, c] += nets[1, point + c] - nets[0, point + c]
        # Cross products of the diagonals.
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        for side in range(2):
            p1, p2 = nets[side, 45 + c1] - nets[side, c1], nets[side, 45 + c2] - nets[side, c2]
            q1, q2 = nets[side, 36 + c1] - nets[side, 9 + c1], nets[side, 36 + c2] - nets[side, 9 + c2]
            directions[2 + side, c] = p1 * q2 - p2 * q1
    best = 0.0
    for d in range(_DIRECTIONS):
        x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            continue
        low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
        for point in range(0, 48, 3):
            on_a = x * nets[0, point] + y * nets[0, point + 1] + z * nets[0, point + 2]
            on_b = x * nets[1, point] + y * nets[1, point + 1] + z * nets[1, point + 2]
            low_a, high_a = min(low_a, on_a), max(high_a, on_a)
            low_b, high_b = min(low_b, on_b), max(high_b, on_b)
        best = max(best, max(low_b - high_a, low_a - high_b) / length)
    return best


@numba.njit(cache=True)
def linked(nets, path, neighbourhood, directions, heights):
    """Lower bound of the distance of points a neighbourhood apart on the starting tube; infinite if there are none.

    Along the direction between the patches' centres, the coordinate of either patch is a linear function of the
    parameters plus a remainder that its net bounds. The mean of both slopes multiplies the difference δ of the points
    on the starting tube. δ lies in a rectangle outside a disc around zero, where a linear function has its minimum at a
    corner or where a side meets the circle. Steps around the tube are arcs, shortened to their chords, by which the
    neighbourhood is defined. The difference of the slopes enters with its absolute value; it is small where the
    distance is smallest.

    Parameters
    ----------
    nets : (2, 48) array
    path : (3, 2) array
        See `steps`.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm.
    directions, heights : (4, 3) and (6, 4) arrays
        Overwritten.
    """
    for c in range(3):
        directions[0, c] = 0.0
        for i in range(4):
            for j in range(4):
                at = 12 * i + 3 * j + c
                directions[0, c] += MEAN[i] * MEAN[j] * (nets[1, at] - nets[0, at])
    length = np.sqrt(directions[0, 0] ** 2 + directions[0, 1] ** 2 + directions[0, 2] ** 2)
    if length == 0.0:
        return 0.0
    bound = 0.0
    for side in range(2):
        middle, sign = 0.0, 2.0 * side - 1.0
        heights[4 + side, 0], heights[4 + side, 1] = 0.0, 0.0
        for i in range(4):
            for j in range(4):
                at, height = 12 * i + 3 * j, 0.0
                for c in range(3):
                    height += directions[0, c] * nets[side, at + c]
                heights[i, j] = height / length
                middle += MEAN[i] * MEAN[j] * heights[i, j]
                heights[4 + side, 0] += MEAN[i] * _SLOPE[j] * heights[i, j]
                heights[4 + side, 1] += _SLOPE[i] * MEAN[j] * heights[i, j]
        least = np.inf
        for i in range(4):
            for j in range(4):
                along = heights[4 + side, 0] * (2.0 * j / 3.0 - 1.0) + heights[4 + side, 1] * (2.0 * i / 3.0 - 1.0)
                least = min(least, sign * (heights[i, j] - middle - along))
        bound += sign * middle + least
    best, radius = np.inf, neighbourhood * neighbourhood
    for k in range(2):
        heights[4, k] /= path[1, k]
        heights[5, k] /= path[2, k]
        mean = 0.5 * (heights[4, k] + heights[5, k])
        bound -= mean * path[0, k] + 0.5 * abs(heights[5, k] - heights[4, k]) * (path[1, k] + path[2, k])
        heights[4, k] = mean
    for k in range(2):
        m = 1 - k
        for side in range(-1, 2, 2):
            on = path[0, k] + side * (path[1, k] + path[2, k])
            for other in range(-1, 2, 2):
                corner = path[0, m] + other * (path[1, m] + path[2, m])
                if on * on + corner * corner >= radius:
                    best = min(best, heights[4, k] * on + heights[4, m] * corner)
                if on * on <= radius:
                    at_circle = other * np.sqrt(radius - on * on)
                    if abs(at_circle - path[0, m]) <= path[1, m] + path[2, m]:
                        best = min(best, heights[4, k] * on + heights[4, m] * at_circle)
    return bound + best


@numba.njit(cache=True)
def steps(boxes, pair, span, size, neighbourhood, path):
    """Upper bound of the distance on the starting tube, mm, between points of two ranges; and whether `path` is known.

    Parameters
    ----------
    boxes, pair, size
        See `closest_pair.apart`.
    span : (8,) array
        Ranges of u and v on both patches.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm.
    path : (3, 2) array
        Overwritten by the step (q, r) on the starting tube between the middles of both ranges, and half of either
        range, mm. Points that count are a neighbourhood apart by these, see `linked`.
    """
    shrink = np.inf
    for k in range(2):
        path[0, k] = 0.0
        for side in range(2):
            start, width = boxes[pair[side], 2 * k], boxes[pair[side], 2 * k + 1]
            low, high = span[4 * side + 2 * k], span[4 * side + 2 * k + 1]
            path[0, k] += (2.0 * side - 1.0) * (start + 0.5 * (low + high) * width)
            path[1 + side, k] = 0.5 * (high - low) * width
            if k == 1:
                shrink = min(shrink, _most(boxes, pair[side], low, high))
    for row in range(3):
        path[row, 1] *= size[1]
    turn = (path[0, 0] + 0.5) % 1.0 - 0.5
    up = abs(path[0, 1]) + path[1, 1] + path[2, 1]
    diameter = size[0] * shrink / np.pi
    reach = np.hypot(diameter * np.sin(np.pi * min(abs(turn) + path[1, 0] + path[2, 0], 0.5)), up)
    if shrink <= 0.0:
        return reach, False
    # The largest ratio of chord to arc outside the neighbourhood, for the steps along r between these patches.
    chord = np.sqrt(max(neighbourhood * neighbourhood - up * up, 0.0))
    arc = diameter * np.arcsin(min(chord / diameter, 1.0))
    scale = size[0] * shrink * (chord / arc if arc > 0.0 else 1.0)
    path[0, 0] = scale * turn
    path[1, 0] *= scale
    path[2, 0] *= scale
    return reach, True


@numba.njit(cache=True)
def _most(boxes, k, low, high):
    """Upper bound of S of a patch between two places: that of its chord plus its largest deviation from the chord."""
    bend = max(abs(2.0 * boxes[k, 6] + 6.0 * boxes[k, 7] * low), abs(2.0 * boxes[k, 6] + 6.0 * boxes[k, 7] * high))
    return max(around(boxes, k, low), around(boxes, k, high)) + bend * (high - low) ** 2 / 8.0
