"""Least distances between patches of surfaces, bounded from both sides by branch and bound.

A patch lies within the hull of its control net. Two hulls are at least as far apart as the slab between them that is
across some direction; along the common normal of facing walls that is short of the distance by terms of second order
in the patches' size only. Distances of points, found by Newton's method, bound it from above. Pairs of patches that
may be nearer than is asked are halved, the larger patch of each first.

Places of one tube that are near each other on it are not separated by their hulls: there both patches are followed to
first order, since it is the difference of their places that has to keep a distance on the starting tube.
"""

from __future__ import annotations

import numba
import numpy as np

_DEPTH = 40  # halvings of both patches together
_DIRECTIONS = 4


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
    """Least distance of the middles of two patches that are a neighbourhood apart, and which; infinite without any."""
    best, first, second = np.inf, 0, 0
    for i in range(len(centres)):
        for j in range(len(others)):
            if neighbourhood > 0.0 and _apart(boxes[i], other_boxes[j], 0.5, 0.5, 0.5, 0.5, size) < neighbourhood:
                continue
            away = 0.0
            for c in range(3):
                away += (centres[i, c] - others[j, c]) ** 2
            if away < best:
                best, first, second = away, i, j
    return np.sqrt(best), first, second


@numba.njit(cache=True)
def candidates(centres, radii, others, other_radii, reach, same):
    """Pairs (m, 2) of patches whose balls are within reach, and how far apart these are (m,)."""
    count = 0
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
    """Bound the least distance of every pair of patches; returns lower bounds (m,).

    Parameters
    ----------
    pairs : (m, 2) array
    nets, others : (n, 4, 4, 3) arrays
        Control nets of the patches on either side.
    boxes, other_boxes : (n, 8) arrays
        q and its width, r and its width, and the coefficients of S(v), for distances along the starting tube.
    size : (float, float)
        Circumference and length of that tube.
    neighbourhood : float
        Only points at least this far apart on the starting tube count; all of them if it is zero.
    asked : float
        Pairs that are farther apart need no closer look.
    gap, bound : float
        Of those nearer, the bounds shall differ by the gap at most, in proportion where farther apart than `bound`.
    most : int
        Pairs of parts looked at in one pair of patches; what is left then counts with its bound so far.
    seen, at : (m,) and (m, 4) arrays
        Filled with distances of actual points, and their u, v on both patches.
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
    """The bounds of one pair; writes to seen[k] and at[k]."""
    here, way = np.full(4, 0.5), np.zeros(3)
    seen[k], at[k] = np.inf, 0.5
    whole = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    if neighbourhood > 0.0 and _farthest(box_a, box_b, whole, size) < neighbourhood:
        return np.inf
    least = _slab(a, b, way)
    if neighbourhood > 0.0 and least < asked:
        least = max(least, _linked(a, b, box_a, box_b, whole, size, neighbourhood))
    if least >= asked:
        return least

    # Where points of the whole patches come nearest; a start at the corners and the middles of both.
    best = np.inf
    for p in range(5):
        for r in range(5):
            trial = np.array([0.5, 0.5, 0.5, 0.5])
            if p < 4:
                trial[0], trial[1] = p % 2, p // 2
            if r < 4:
                trial[2], trial[3] = r % 2, r // 2
            away = _distance(a, b, trial, box_a, box_b, size, neighbourhood)
            if away < best:
                best, here = away, trial
    if best < np.inf:
        # Where points come nowhere near what is asked, it does not matter how near exactly.
        seen[k] = _descend(a, b, here, box_a, box_b, size, neighbourhood) if best < 1.3 * asked else best
        at[k] = here
        _between(a, b, here, way)

    certified = np.inf
    stack_a, stack_b = np.empty((_DEPTH + 2, 4, 4, 3)), np.empty((_DEPTH + 2, 4, 4, 3))
    ranges, bounds, depths = np.empty((_DEPTH + 2, 8)), np.empty(_DEPTH + 2), np.empty(_DEPTH + 2, dtype=np.int64)
    stack_a[0], stack_b[0], ranges[0], bounds[0], depths[0] = a, b, whole, least, 0
    held, looked = 1, 0
    first, second = np.empty((4, 4, 3)), np.empty((4, 4, 3))
    while held:
        held -= 1
        enough = asked
        if seen[k] < np.inf:
            enough = min(asked, seen[k] - gap * max(1.0, seen[k] / bound))
        looked += 1
        if bounds[held] >= enough or depths[held] >= _DEPTH or looked > most:
            certified = min(certified, bounds[held])
            continue
        part_a, part_b, span = stack_a[held].copy(), stack_b[held].copy(), ranges[held].copy()
        least, depth = bounds[held], depths[held]
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
            ranges[held] = span
            ranges[held, entry + 1 - half] = middle
            if neighbourhood > 0.0 and _farthest(box_a, box_b, ranges[held], size) < neighbourhood:
                continue
            bounds[held] = max(least, _slab(child_a, child_b, way))
            if neighbourhood > 0.0 and bounds[held] < enough:
                linked = _linked(child_a, child_b, box_a, box_b, ranges[held], size, neighbourhood)
                bounds[held] = max(bounds[held], linked)
            if bounds[held] >= enough:
                certified = min(certified, bounds[held])
                continue
            for c in range(4):
                here[c] = 0.5 * (ranges[held, 2 * c] + ranges[held, 2 * c + 1])
            away = _distance(a, b, here, box_a, box_b, size, neighbourhood)
            if away < seen[k]:
                if away < 1.1 * asked:
                    away = _descend(a, b, here, box_a, box_b, size, neighbourhood)
                seen[k] = away
                at[k] = here
                _between(a, b, here, way)
            stack_a[held], stack_b[held], depths[held] = child_a, child_b, depth + 1
            held += 1
    return max(certified, 0.0)


@numba.njit(cache=True)
def _slab(a, b, way):
    """Lower bound of the distance of two nets' hulls: the widest slab between them across some directions."""
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
        x, y, z = directions[d]
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
def _linked(a, b, box_a, box_b, span, size, neighbourhood):
    """Lower bound of the distance of places at least a neighbourhood apart on the starting tube; infinite without any.

    Across the direction from the middle of the one patch to that of the other, both are linear in their steps from the
    middle, but for what their nets tell. The mean of both slopes counts by the difference δ of the places on the
    starting tube, which is in a rectangle without a disc around zero: a linear function is least at a corner, or where
    a side meets the circle. What the slopes differ by counts in full, but where the distance is least they are alike.
    """
    shrink = min(_most(box_a[4:], span[2], span[3]), _most(box_b[4:], span[6], span[7]))
    if shrink <= 0.0:
        return 0.0
    between, half_a, half_b = np.empty(2), np.empty(2), np.empty(2)
    for k in range(2):
        scale = size[k] * (shrink if k == 0 else 1.0)
        between[k] = box_b[2 * k] + 0.5 * (span[4 + 2 * k] + span[5 + 2 * k]) * box_b[2 * k + 1]
        between[k] -= box_a[2 * k] + 0.5 * (span[2 * k] + span[2 * k + 1]) * box_a[2 * k + 1]
        if k == 0:
            between[k] = (between[k] + 0.5) % 1.0 - 0.5
        between[k] *= scale
        half_a[k] = 0.5 * (span[2 * k + 1] - span[2 * k]) * box_a[2 * k + 1] * scale
        half_b[k] = 0.5 * (span[5 + 2 * k] - span[4 + 2 * k]) * box_b[2 * k + 1] * scale
    direction = np.zeros(3)
    for i in range(4):
        for j in range(4):
            weight = (1.0 if i % 3 == 0 else 3.0) * (1.0 if j % 3 == 0 else 3.0)
            for c in range(3):
                direction[c] += weight * (b[i, j, c] - a[i, j, c])
    length = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    if length == 0.0:
        return 0.0
    direction /= length
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
def _linear(net, direction):
    """A patch across a direction: value and slopes to its sides at the middle, and bounds of what is left of it."""
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
def _normal(net, normal):
    """A vector across a patch: the product of its diagonals."""
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        p1, p2 = net[3, 3, c1] - net[0, 0, c1], net[3, 3, c2] - net[0, 0, c2]
        q1, q2 = net[3, 0, c1] - net[0, 3, c1], net[3, 0, c2] - net[0, 3, c2]
        normal[c] = p1 * q2 - p2 * q1


@numba.njit(cache=True)
def _extent(net, axis):
    """Square of the longest chord of a net from one side to the other."""
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
    """Control nets of both halves, by de Casteljau's construction."""
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


@numba.njit(cache=True)
def _apart(box_a, box_b, u_a, v_a, u_b, v_b, size):
    """Distance of two points along the starting tube, see `distance._apart`."""
    aside = abs(box_a[0] + u_a * box_a[1] - box_b[0] - u_b * box_b[1]) % 1.0
    aside = min(aside, 1.0 - aside) * min(_cubic(box_a[4:], v_a), _cubic(box_b[4:], v_b))
    up = box_a[2] + v_a * box_a[3] - box_b[2] - v_b * box_b[3]
    return np.hypot(aside * size[0], up * size[1])


@numba.njit(cache=True)
def _farthest(box_a, box_b, span, size):
    """An upper bound of that distance for u and v within ranges (8,): u, v of the one patch, u, v of the other."""
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
    around = min(reach[0], 0.5) * min(_most(box_a[4:], span[2], span[3]), _most(box_b[4:], span[6], span[7]))
    return np.hypot(around * size[0], reach[1] * size[1])


@numba.njit(cache=True)
def _cubic(c, v):
    return c[0] + v * (c[1] + v * (c[2] + v * c[3]))


@numba.njit(cache=True)
def _most(c, low, high):
    """An upper bound of a cubic between two parameters: of its chord, and how far it may bulge beyond."""
    bend = max(abs(2.0 * c[2] + 6.0 * c[3] * low), abs(2.0 * c[2] + 6.0 * c[3] * high))
    return max(_cubic(c, low), _cubic(c, high)) + bend * (high - low) ** 2 / 8.0


@numba.njit(cache=True)
def _weights(t, values):
    """Bernstein polynomials (3, 4) and their first two derivatives at t."""
    s = 1.0 - t
    values[0, 0], values[0, 1], values[0, 2], values[0, 3] = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
    values[1, 0], values[1, 1] = -3 * s * s, 3 * s * s - 6 * s * t
    values[1, 2], values[1, 3] = 6 * s * t - 3 * t * t, 3 * t * t
    values[2, 0], values[2, 1], values[2, 2], values[2, 3] = 6 * s, 6 * t - 12 * s, 6 * s - 12 * t, 6 * t


@numba.njit(cache=True)
def _derivatives(net, u, v, out):
    """Position and derivatives u, v, uu, uv, vv of a patch, into out (6, 3)."""
    by_u, by_v = np.empty((3, 4)), np.empty((3, 4))
    _weights(u, by_u)
    _weights(v, by_v)
    out[:] = 0.0
    for i in range(4):
        for j in range(4):
            w0, w1, w2 = by_v[0, i] * by_u[0, j], by_v[0, i] * by_u[1, j], by_v[1, i] * by_u[0, j]
            w3, w4, w5 = by_v[0, i] * by_u[2, j], by_v[1, i] * by_u[1, j], by_v[2, i] * by_u[0, j]
            for c in range(3):
                p = net[i, j, c]
                out[0, c] += w0 * p
                out[1, c] += w1 * p
                out[2, c] += w2 * p
                out[3, c] += w3 * p
                out[4, c] += w4 * p
                out[5, c] += w5 * p


@numba.njit(cache=True)
def _point(net, u, v, out):
    """Position of a point of a patch."""
    s, t = 1.0 - u, 1.0 - v
    out[:] = 0.0
    for i in range(4):
        wv = t * t * t if i == 0 else 3 * t * t * v if i == 1 else 3 * t * v * v if i == 2 else v * v * v
        for j in range(4):
            wu = s * s * s if j == 0 else 3 * s * s * u if j == 1 else 3 * s * u * u if j == 2 else u * u * u
            for c in range(3):
                out[c] += wv * wu * net[i, j, c]


@numba.njit(cache=True)
def _between(a, b, here, way):
    """Vector from the one point to the other at u, v of both patches (4,)."""
    x, y = np.empty(3), np.empty(3)
    _point(a, here[0], here[1], x)
    _point(b, here[2], here[3], y)
    for c in range(3):
        way[c] = y[c] - x[c]


@numba.njit(cache=True)
def _distance(a, b, here, box_a, box_b, size, neighbourhood):
    """Distance of two points; infinite within the neighbourhood."""
    if neighbourhood > 0.0 and _apart(box_a, box_b, here[0], here[1], here[2], here[3], size) < neighbourhood:
        return np.inf
    way = np.empty(3)
    _between(a, b, here, way)
    return np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)


@numba.njit(cache=True)
def _descend(a, b, here, box_a, box_b, size, neighbourhood):
    """Move two points to a least distance within their patches, by damped Newton steps; returns it."""
    best = _distance(a, b, here, box_a, box_b, size, neighbourhood)
    x, y = np.empty((6, 3)), np.empty((6, 3))
    slope, H, trial = np.empty(4), np.empty((4, 4)), np.empty(4)
    damping, fresh = 1e-3, True
    for _ in range(16):
        if fresh:
            _derivatives(a, here[0], here[1], x)
            _derivatives(b, here[2], here[3], y)
            slope[:], H[:] = 0.0, 0.0
            for c in range(3):
                away = x[0, c] - y[0, c]
                for m in range(2):
                    slope[m] += away * x[1 + m, c]
                    slope[2 + m] -= away * y[1 + m, c]
                    for n in range(2):
                        H[m, n] += x[1 + m, c] * x[1 + n, c] + away * x[3 + m + n, c]
                        H[2 + m, 2 + n] += y[1 + m, c] * y[1 + n, c] - away * y[3 + m + n, c]
                        H[m, 2 + n] -= x[1 + m, c] * y[1 + n, c]
            for m in range(2):
                for n in range(2):
                    H[2 + n, m] = H[m, 2 + n]
            for m in range(4):
                if (here[m] <= 0.0 and slope[m] > 0.0) or (here[m] >= 1.0 and slope[m] < 0.0):
                    slope[m] = 0.0
                    H[m, :], H[:, m] = 0.0, 0.0
                    H[m, m] = 1.0
        scale = max(H[0, 0], H[1, 1], H[2, 2], H[3, 3], 1e-12)
        if not _solve(H, damping * scale, slope, trial):
            damping, fresh = 8.0 * damping, False
            continue
        moved = 0.0
        for m in range(4):
            trial[m] = min(max(here[m] - trial[m], 0.0), 1.0)
            moved = max(moved, abs(trial[m] - here[m]))
        away = _distance(a, b, trial, box_a, box_b, size, neighbourhood)
        if away < best:
            fresh = True
            settled = best - away < 1e-7 * best
            best = away
            here[:] = trial
            damping *= 0.1
            if settled:
                break
        else:
            damping, fresh = 8.0 * damping, False
        if moved < 1e-9:
            break
    return best


@numba.njit(cache=True)
def _solve(H, shift, slope, step):
    """Solve (H + shift) step = slope by Cholesky's method; false where the matrix is not positive definite."""
    L = np.zeros((4, 4))
    for i in range(4):
        for j in range(i + 1):
            total = H[i, j] + (shift if i == j else 0.0)
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if total <= 0.0:
                    return False
                L[i, i] = np.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    for i in range(4):
        step[i] = slope[i]
        for k in range(i):
            step[i] -= L[i, k] * step[k]
        step[i] /= L[i, i]
    for i in range(3, -1, -1):
        for k in range(i + 1, 4):
            step[i] -= L[k, i] * step[k]
        step[i] /= L[i, i]
    return True
