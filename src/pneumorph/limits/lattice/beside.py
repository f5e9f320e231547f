"""How near points of a surface come that are neighbours along it, but farther apart there than the neighbourhood.

Two pieces, displaced, are within e of flat triangles with corners x_k and y_l, and in the reference within b of ones
with corners X_k and Y_l. For points with the same barycentric coordinates, p and P of the one and q and Q of the other,
any unit vectors n and m, and any λ ≥ 0,

    |p − q| ≥ n·(p − q) = [n·(p − q) − λ m·(P − Q)] + λ m·(P − Q).

The bracket is, but for e + λ b, linear on the flat triangles: its least value is at their corners. Where P and Q are
farther apart than the neighbourhood N, and differ across m by at most s, m·(P − Q) is at least √(N² − s²). With n and
m along the line between the middles, and the λ that is best, the bound errs by the square of the size of pieces where
it is the least: there m is the direction along which the map compresses most, of which n is the image.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def beside(one, other, pairs, neighbourhood, into):
    """Fill in which pairs are wholly within the neighbourhood, and lower bounds of the distances of other points.

    Parameters
    ----------
    one, other : tuples
        Corners (n, 3, 3) of pieces in the reference, how far the surface may be from them there (n,), and both as they
        are displaced, mm.
    pairs : tuple
        Indices (m,) of both, and which pairs are linked: bounds of the others are zero.
    neighbourhood : float
        mm.
    into : tuple
        Which are within (m,), and the bounds (m,) in mm.
    """
    (X, bulge_x, x, error_x), (Y, bulge_y, y, error_y) = one, other
    (i, j, linked), (within, lower) = pairs, into
    m, n = np.empty(3), np.empty(3)
    here, there = np.empty((2, 3)), np.empty((2, 3))
    for pair in range(len(i)):
        within[pair], lower[pair] = False, 0.0
        if not linked[pair]:
            continue
        a, b = i[pair], j[pair]
        bulge, error = bulge_x[a] + bulge_y[b], error_x[a] + error_y[b]
        along = _between(X[a], Y[b], m)
        _between(x[a], y[b], n)
        spread, across, least = 0.0, 0.0, np.inf
        for k in range(3):
            for corner in range(3):
                square, share = 0.0, 0.0
                for c in range(3):
                    square += (X[a, k, c] - Y[b, corner, c]) ** 2
                    share += m[c] * (X[a, k, c] - Y[b, corner, c])
                spread = max(spread, square)
                across = max(across, square - share * share)
                least = min(least, share)
        within[pair] = np.sqrt(spread) + bulge < neighbourhood
        if along == 0.0:
            continue
        across = np.sqrt(max(across, 0.0)) + bulge
        if across < neighbourhood:
            apart = np.sqrt(neighbourhood**2 - across**2)
            if least - bulge > -apart:
                least = max(least, apart + bulge)
        for k in range(3):
            here[:, k], there[:, k] = 0.0, 0.0
            for c in range(3):
                here[0, k] += n[c] * x[a, k, c]
                here[1, k] += m[c] * X[a, k, c]
                there[0, k] += n[c] * y[b, k, c]
                there[1, k] += m[c] * Y[b, k, c]
        best = _value(here, there, 0.0)
        for side in (here, there):
            for k in range(3):
                after = (k + 1) % 3
                rise = side[1, k] - side[1, after]
                if rise != 0.0 and (side[0, k] - side[0, after]) / rise > 0.0:
                    share = (side[0, k] - side[0, after]) / rise
                    best = max(best, _value(here, there, share) + share * (least - bulge))
        lower[pair] = max(best - error, 0.0)


@numba.njit(cache=True, nogil=True)
def _between(one, other, way):
    """Fill in the unit vector from the middle of a triangle to that of another, backwards; return their distance."""
    size = 0.0
    for c in range(3):
        way[c] = one[0, c] + one[1, c] + one[2, c] - other[0, c] - other[1, c] - other[2, c]
        size += way[c] * way[c]
    size = np.sqrt(size)
    for c in range(3):
        way[c] = way[c] / size if size > 0.0 else 0.0
    return size / 3.0


@numba.njit(cache=True, nogil=True)
def _value(here, there, share):
    """The least value at corners of n·p − λ m·P of the one, minus the largest of the other; λ is the share."""
    low, high = np.inf, -np.inf
    for k in range(3):
        low = min(low, here[0, k] - share * here[1, k])
        high = max(high, there[0, k] - share * there[1, k])
    return low - high
