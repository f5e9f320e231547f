"""Distances of flat triangles, and of surfaces that bow out of them."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def distances(a: Floats, b: Floats, i: Ints, j: Ints, enough: Floats | None = None) -> tuple[Floats, Floats, Floats]:
    """Distances of pairs of triangles, zero where they intersect, and the closest points.

    Parameters
    ----------
    a, b : (m, 3, 3) and (k, 3, 3) arrays
        Corners of triangles.
    i, j : (n,) arrays
        Pairs of indices into these.
    enough : (n,) array, optional
        Of pairs that planes hold so far apart only this lower bound of the distance is found, and their centres.

    Returns
    -------
    distance : (n,) array
    u, v : (n, 3) arrays
        Barycentric coordinates of the closest points of both.
    """
    distance, u, v = np.empty(len(i)), np.empty((len(i), 3)), np.empty((len(i), 3))
    enough = np.full(len(i), np.inf) if enough is None else enough
    a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
    _distances((a, _normals(a)), (b, _normals(b)), (i, j), enough, (distance, u, v))
    return distance, u, v


def bowed_distances(
    sides: tuple[tuple[Floats, Floats, Floats], tuple[Floats, Floats, Floats]], i: Ints, j: Ints, u: Floats, v: Floats
) -> Floats:
    """Lower bounds (n,) of the distances of pairs of surfaces that are near quadratic triangles.

    A plane across the line between the closest points of the flat triangles holds these apart. Nearer are only surfaces
    that bow towards each other across it.

    Parameters
    ----------
    sides : two tuples
        Corners (m, 3, 3) of flat triangles, how far the middles of the edges 01, 12 and 20 of quadratic ones are from
        those of these (m, 3, 3), and how far the surface may be from the latter (m,).
    i, j : (n,) arrays
        Pairs of indices into these.
    u, v : (n, 3) arrays
        Barycentric coordinates of the closest points of the flat triangles.
    """
    lower = np.zeros(len(i))
    _bowed(*sides, (i, j, u, v), lower)
    return lower


@numba.njit(cache=True, nogil=True)
def _bowed(one, other, pairs, lower):
    """Fill in what `bowed_distances` returns."""
    (x, bow_x, rest_x), (y, bow_y, rest_y), (i, j, u, v) = one, other, pairs
    way = np.empty(3)
    for n in range(len(i)):
        a, b = i[n], j[n]
        away = 0.0
        for c in range(3):
            way[c] = 0.0
            for k in range(3):
                way[c] += u[n, k] * x[a, k, c] - v[n, k] * y[b, k, c]
            away += way[c] * way[c]
        away = np.sqrt(away)
        if away > 0.0:
            low, high = np.inf, -np.inf
            for k in range(3):
                low = min(low, _along(way, x[a, k]))
                high = max(high, _along(way, y[b, k]))
            nearer = _bulge(way, bow_x[a], -1.0) + _bulge(way, bow_y[b], 1.0)
            lower[n] = max((low - high - nearer) / away - rest_x[a] - rest_y[b], 0.0)


@numba.njit(cache=True, nogil=True)
def _along(way, x):
    return way[0] * x[0] + way[1] * x[1] + way[2] * x[2]


@numba.njit(cache=True, nogil=True)
def _bulge(way, bow, sign):
    """The most that Σ 4 λ_i λ_j b_ij is along a way; where all are positive, 4 Σ λ_i λ_j is at most 4/3."""
    most, least = 0.0, np.inf
    for k in range(3):
        by = sign * _along(way, bow[k])
        most, least = max(most, by), min(least, by)
    return most if least <= 0.0 else 4.0 / 3.0 * most


def _normals(triangles: Floats) -> Floats:
    """Unit normals (n, 3); zero for triangles without area."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)


@numba.njit(cache=True, nogil=True)
def _apart(one, other, normal):
    """How far a plane with a unit normal (or shorter) holds two triangles apart; negative if it does not."""
    low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
    for k in range(3):
        here = one[k, 0] * normal[0] + one[k, 1] * normal[1] + one[k, 2] * normal[2]
        there = other[k, 0] * normal[0] + other[k, 1] * normal[1] + other[k, 2] * normal[2]
        low_a, high_a, low_b, high_b = min(low_a, here), max(high_a, here), min(low_b, there), max(high_b, there)
    return max(low_a - high_b, low_b - high_a)


@numba.njit(cache=True, nogil=True)
def _distances(one_side, other_side, pairs, enough, into):
    """Fill distances (n,) and barycentric coordinates (n, 3), `into`; sides are triangles with their normals."""
    (a, normals_a), (b, normals_b), (i, j), (distance, u, v) = one_side, other_side, pairs, into
    shares, here, there, spot = np.empty(2), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(i)):
        one, other = a[i[n]], b[j[n]]
        if enough[n] < np.inf:
            away = max(_apart(one, other, normals_a[i[n]]), _apart(one, other, normals_b[j[n]]))
            if away >= enough[n]:
                distance[n], u[n, :], v[n, :] = away, 1.0 / 3.0, 1.0 / 3.0
                continue
        best = np.inf
        for k in range(3):
            for m in range(3):
                after, beyond = (k + 1) % 3, (m + 1) % 3
                away = _segments(one[k], one[after], other[m], other[beyond], shares)
                if away < best:
                    best = away
                    u[n], v[n, :] = 0.0, 0.0
                    u[n, k], u[n, after], v[n, m], v[n, beyond] = 1.0 - shares[0], shares[0], 1.0 - shares[1], shares[1]
        for k in range(3):
            away = _point(one[k], other, there)
            if away < best:
                best = away
                u[n, :] = 0.0
                u[n, k] = 1.0
                v[n, :] = there
            away = _point(other[k], one, here)
            if away < best:
                best = away
                v[n, :] = 0.0
                v[n, k] = 1.0
                u[n, :] = here
        if best > 0.0:
            for k in range(3):
                after = (k + 1) % 3
                share = _pierced(one[k], one[after], other, there, spot)
                if share >= 0.0:
                    best = 0.0
                    u[n, :] = 0.0
                    u[n, k], u[n, after] = 1.0 - share, share
                    v[n, :] = there
                    break
                share = _pierced(other[k], other[after], one, here, spot)
                if share >= 0.0:
                    best = 0.0
                    v[n, :] = 0.0
                    v[n, k], v[n, after] = 1.0 - share, share
                    u[n, :] = here
                    break
        distance[n] = np.sqrt(best)


@numba.njit(cache=True, nogil=True)
def _dot(a, b, c, d):
    """(b − a)·(d − c)."""
    return (b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) + (b[2] - a[2]) * (d[2] - c[2])


@numba.njit(cache=True, nogil=True)
def _segments(p, q, r, s, shares):
    """Squared distance of segments pq and rs, and where on both the closest points are (Ericson 2005, 5.1.9)."""
    a, c, f = _dot(p, q, p, q), _dot(r, s, r, s), _dot(r, s, r, p)
    if a <= 0.0 and c <= 0.0:
        x, y = 0.0, 0.0
    elif a <= 0.0:
        x, y = 0.0, min(max(f / c, 0.0), 1.0)
    else:
        g = _dot(p, q, r, p)
        if c <= 0.0:
            x, y = min(max(-g / a, 0.0), 1.0), 0.0
        else:
            h = _dot(p, q, r, s)
            below = a * c - h * h
            x = min(max((h * f - g * c) / below, 0.0), 1.0) if below > 1e-14 * a * c else 0.0
            y = (h * x + f) / c
            if y < 0.0:
                x, y = min(max(-g / a, 0.0), 1.0), 0.0
            elif y > 1.0:
                x, y = min(max((h - g) / a, 0.0), 1.0), 1.0
    shares[0], shares[1] = x, y
    away = 0.0
    for k in range(3):
        away += (p[k] - r[k] + x * (q[k] - p[k]) - y * (s[k] - r[k])) ** 2
    return away


@numba.njit(cache=True, nogil=True)
def _point(p, triangle, place):
    """Squared distance of a point within the prism over a triangle from it, and barycentric coordinates; else inf.

    Points beside the prism are nearest to an edge, which pairs of edges find.
    """
    o, e, f = triangle[0], triangle[1], triangle[2]
    a, b, c = _dot(o, e, o, e), _dot(o, e, o, f), _dot(o, f, o, f)
    g, h = _dot(o, e, o, p), _dot(o, f, o, p)
    below = a * c - b * b
    if below <= 1e-14 * a * c:
        return np.inf
    x, y = (c * g - b * h) / below, (a * h - b * g) / below
    if x < 0.0 or y < 0.0 or x + y > 1.0:
        return np.inf
    place[0], place[1], place[2] = 1.0 - x - y, x, y
    away = 0.0
    for k in range(3):
        away += (p[k] - o[k] - x * (e[k] - o[k]) - y * (f[k] - o[k])) ** 2
    return away


@numba.njit(cache=True, nogil=True)
def _pierced(p, q, triangle, place, spot):
    """Where a segment goes through a triangle, from 0 to 1, and barycentric coordinates there; −1 if it does not."""
    o, e, f = triangle[0], triangle[1], triangle[2]
    start, stop = 0.0, 0.0
    for k in range(3):
        m, n = (k + 1) % 3, (k + 2) % 3
        normal = (e[m] - o[m]) * (f[n] - o[n]) - (e[n] - o[n]) * (f[m] - o[m])
        start += normal * (p[k] - o[k])
        stop += normal * (q[k] - o[k])
    if start * stop >= 0.0:
        return -1.0
    share = start / (start - stop)
    for k in range(3):
        spot[k] = p[k] + share * (q[k] - p[k])
    if np.isfinite(_point(spot, triangle, place)):
        return share
    return -1.0
