"""Distances of flat triangles."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def distances(a: Floats, b: Floats, i: Ints, j: Ints) -> tuple[Floats, Floats, Floats]:
    """Distances of pairs of triangles, zero where they intersect, and the closest points.

    Parameters
    ----------
    a, b : (m, 3, 3) and (k, 3, 3) arrays
        Corners of triangles.
    i, j : (n,) arrays
        Pairs of indices into these.

    Returns
    -------
    distance : (n,) array
    u, v : (n, 3) arrays
        Barycentric coordinates of the closest points of both.
    """
    distance, u, v = np.empty(len(i)), np.empty((len(i), 3)), np.empty((len(i), 3))
    _distances(np.ascontiguousarray(a), np.ascontiguousarray(b), i, j, distance, u, v)
    return distance, u, v


@numba.njit(cache=True, nogil=True)
def _distances(a, b, i, j, distance, u, v):
    """Fill distances (n,) and barycentric coordinates (n, 3)."""
    found, here, there = np.empty(2), np.empty(3), np.empty(3)
    for n in range(len(i)):
        one, other = a[i[n]], b[j[n]]
        best = np.inf
        for k in range(3):
            for m in range(3):
                after, beyond = (k + 1) % 3, (m + 1) % 3
                away = _segments(one[k], one[after], other[m], other[beyond], found)
                if away < best:
                    best = away
                    u[n], v[n] = 0.0, 0.0
                    u[n, k], u[n, after], v[n, m], v[n, beyond] = 1.0 - found[0], found[0], 1.0 - found[1], found[1]
        for k in range(3):
            away = _point(one[k], other, there)
            if away < best:
                best = away
                u[n] = 0.0
                u[n, k] = 1.0
                v[n] = there
            away = _point(other[k], one, here)
            if away < best:
                best = away
                v[n] = 0.0
                v[n, k] = 1.0
                u[n] = here
        if best > 0.0:
            for k in range(3):
                after = (k + 1) % 3
                share = _pierced(one[k], one[after], other, there)
                if share >= 0.0:
                    best = 0.0
                    u[n] = 0.0
                    u[n, k], u[n, after] = 1.0 - share, share
                    v[n] = there
                    break
                share = _pierced(other[k], other[after], one, here)
                if share >= 0.0:
                    best = 0.0
                    v[n] = 0.0
                    v[n, k], v[n, after] = 1.0 - share, share
                    u[n] = here
                    break
        distance[n] = np.sqrt(best)


@numba.njit(cache=True, nogil=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True, nogil=True)
def _segments(p, q, r, s, found):
    """Squared distance of segments pq and rs, and where on both the closest points are (Ericson 2005, 5.1.9)."""
    d, e, w = q - p, s - r, p - r
    a, c, f = _dot(d, d), _dot(e, e), _dot(e, w)
    if a <= 0.0 and c <= 0.0:
        x, y = 0.0, 0.0
    elif a <= 0.0:
        x, y = 0.0, min(max(f / c, 0.0), 1.0)
    else:
        g = _dot(d, w)
        if c <= 0.0:
            x, y = min(max(-g / a, 0.0), 1.0), 0.0
        else:
            h = _dot(d, e)
            below = a * c - h * h
            x = min(max((h * f - g * c) / below, 0.0), 1.0) if below > 1e-14 * a * c else 0.0
            y = (h * x + f) / c
            if y < 0.0:
                x, y = min(max(-g / a, 0.0), 1.0), 0.0
            elif y > 1.0:
                x, y = min(max((h - g) / a, 0.0), 1.0), 1.0
    found[0], found[1] = x, y
    gap = w + x * d - y * e
    return _dot(gap, gap)


@numba.njit(cache=True, nogil=True)
def _point(p, triangle, place):
    """Squared distance of a point within the prism over a triangle from it, and barycentric coordinates; else inf.

    Points beside the prism are nearest to an edge, which pairs of edges find.
    """
    e, f, w = triangle[1] - triangle[0], triangle[2] - triangle[0], p - triangle[0]
    a, b, c = _dot(e, e), _dot(e, f), _dot(f, f)
    g, h = _dot(e, w), _dot(f, w)
    below = a * c - b * b
    if below <= 1e-14 * a * c:
        return np.inf
    x, y = (c * g - b * h) / below, (a * h - b * g) / below
    if x < 0.0 or y < 0.0 or x + y > 1.0:
        return np.inf
    place[0], place[1], place[2] = 1.0 - x - y, x, y
    gap = w - x * e - y * f
    return _dot(gap, gap)


@numba.njit(cache=True, nogil=True)
def _pierced(p, q, triangle, place):
    """Where a segment goes through a triangle, from 0 to 1, and barycentric coordinates there; −1 if it does not."""
    e, f = triangle[1] - triangle[0], triangle[2] - triangle[0]
    normal = np.array([e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]])
    start, stop = _dot(normal, p - triangle[0]), _dot(normal, q - triangle[0])
    if start * stop >= 0.0:
        return -1.0
    share = start / (start - stop)
    if np.isfinite(_point(p + share * (q - p), triangle, place)):
        return share
    return -1.0
