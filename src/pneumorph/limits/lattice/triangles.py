"""Distances of flat triangles, and of surfaces that bow out of them."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_SHARE = 1 << 14
"""Pairs that a thread measures at a time."""


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
    one, other = (a, _normals(a)), (b, _normals(b))

    def work(some: slice) -> None:
        _distances(one, other, (i[some], j[some]), enough[some], (distance[some], u[some], v[some]))

    each(work, [slice(first, first + _SHARE) for first in range(0, max(len(i), 1), _SHARE)])
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
def _apart(a, i, b, j, way):
    """How far a plane across a unit vector (or a shorter one) holds two triangles apart; negative if it does not."""
    low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
    for k in range(3):
        here = a[i, k, 0] * way[0] + a[i, k, 1] * way[1] + a[i, k, 2] * way[2]
        there = b[j, k, 0] * way[0] + b[j, k, 1] * way[1] + b[j, k, 2] * way[2]
        low_a, high_a, low_b, high_b = min(low_a, here), max(high_a, here), min(low_b, there), max(high_b, there)
    return max(low_a - high_b, low_b - high_a)


@numba.njit(cache=True, nogil=True)
def _middles(a, i, b, j, way):
    """Fill in the unit vector between the middles of two triangles."""
    size = 0.0
    for c in range(3):
        way[c] = a[i, 0, c] + a[i, 1, c] + a[i, 2, c] - b[j, 0, c] - b[j, 1, c] - b[j, 2, c]
        size += way[c] * way[c]
    size = np.sqrt(size)
    for c in range(3):
        way[c] = way[c] / size if size > 0.0 else 0.0


@numba.njit(cache=True, nogil=True)
def _distances(one_side, other_side, pairs, enough, into):
    """Fill distances (n,) and barycentric coordinates (n, 3), `into`; sides are triangles with their normals."""
    (a, normals_a), (b, normals_b), (i, j), (distance, u, v) = one_side, other_side, pairs, into
    shares, here, there, way = np.empty(2), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(i)):
        one, other = i[n], j[n]
        if enough[n] < np.inf:
            _middles(a, one, b, other, way)
            away = _apart(a, one, b, other, way)
            if away < enough[n]:
                away = max(away, _apart(a, one, b, other, normals_a[one]), _apart(a, one, b, other, normals_b[other]))
            if away >= enough[n]:
                distance[n], u[n, :], v[n, :] = away, 1.0 / 3.0, 1.0 / 3.0
                continue
        best, edge, beside, x, y = np.inf, 0, 0, 0.0, 0.0
        for k in range(3):
            for m in range(3):
                away = _segments(a, one, k, (k + 1) % 3, b, other, m, (m + 1) % 3, shares)
                if away < best:
                    best, edge, beside, x, y = away, k, m, shares[0], shares[1]
        u[n, :], v[n, :] = 0.0, 0.0
        u[n, edge], u[n, (edge + 1) % 3] = 1.0 - x, x
        v[n, beside], v[n, (beside + 1) % 3] = 1.0 - y, y
        for k in range(3):
            away = _point(a[one, k, 0], a[one, k, 1], a[one, k, 2], b, other, there)
            if away < best:
                best = away
                u[n, :] = 0.0
                u[n, k] = 1.0
                v[n, :] = there
            away = _point(b[other, k, 0], b[other, k, 1], b[other, k, 2], a, one, here)
            if away < best:
                best = away
                v[n, :] = 0.0
                v[n, k] = 1.0
                u[n, :] = here
        if best > 0.0:
            for k in range(3):
                after = (k + 1) % 3
                share = _pierced(a, one, k, after, b, other, there)
                if share >= 0.0:
                    best = 0.0
                    u[n, :] = 0.0
                    u[n, k], u[n, after] = 1.0 - share, share
                    v[n, :] = there
                    break
                share = _pierced(b, other, k, after, a, one, here)
                if share >= 0.0:
                    best = 0.0
                    v[n, :] = 0.0
                    v[n, k], v[n, after] = 1.0 - share, share
                    u[n, :] = here
                    break
        distance[n] = np.sqrt(best)


@numba.njit(cache=True, nogil=True)
def _dot(a, i, p, q, b, j, r, s):
    """(q − p)·(s − r), of corners p and q of a triangle of `a` and r and s of one of `b`."""
    total = 0.0
    for c in range(3):
        total += (a[i, q, c] - a[i, p, c]) * (b[j, s, c] - b[j, r, c])
    return total


@numba.njit(cache=True, nogil=True)
def _segments(a, i, p, q, b, j, r, s, shares):
    """Squared distance of segments pq and rs, and where on both the closest points are (Ericson 2005, 5.1.9)."""
    aa, cc, f, g = 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        along, beside, between = a[i, q, c] - a[i, p, c], b[j, s, c] - b[j, r, c], a[i, p, c] - b[j, r, c]
        aa += along * along
        cc += beside * beside
        f += beside * between
        g += along * between
    if aa <= 0.0 and cc <= 0.0:
        x, y = 0.0, 0.0
    elif aa <= 0.0:
        x, y = 0.0, min(max(f / cc, 0.0), 1.0)
    elif cc <= 0.0:
        x, y = min(max(-g / aa, 0.0), 1.0), 0.0
    else:
        h = _dot(a, i, p, q, b, j, r, s)
        below = aa * cc - h * h
        x = min(max((h * f - g * cc) / below, 0.0), 1.0) if below > 1e-14 * aa * cc else 0.0
        y = (h * x + f) / cc
        if y < 0.0:
            x, y = min(max(-g / aa, 0.0), 1.0), 0.0
        elif y > 1.0:
            x, y = min(max((h - g) / aa, 0.0), 1.0), 1.0
    shares[0], shares[1] = x, y
    away = 0.0
    for c in range(3):
        along, beside, between = a[i, q, c] - a[i, p, c], b[j, s, c] - b[j, r, c], a[i, p, c] - b[j, r, c]
        away += (between + x * along - y * beside) ** 2
    return away


@numba.njit(cache=True, nogil=True)
def _point(x, y, z, b, j, place):
    """Squared distance of a point within the prism over a triangle from it, and barycentric coordinates; else inf.

    Points beside the prism are nearest to an edge, which pairs of edges find.
    """
    ex, ey, ez = b[j, 1, 0] - b[j, 0, 0], b[j, 1, 1] - b[j, 0, 1], b[j, 1, 2] - b[j, 0, 2]
    fx, fy, fz = b[j, 2, 0] - b[j, 0, 0], b[j, 2, 1] - b[j, 0, 1], b[j, 2, 2] - b[j, 0, 2]
    dx, dy, dz = x - b[j, 0, 0], y - b[j, 0, 1], z - b[j, 0, 2]
    ee, ef, ff = ex * ex + ey * ey + ez * ez, ex * fx + ey * fy + ez * fz, fx * fx + fy * fy + fz * fz
    g, h = ex * dx + ey * dy + ez * dz, fx * dx + fy * dy + fz * dz
    below = ee * ff - ef * ef
    if below <= 1e-14 * ee * ff:
        return np.inf
    u, v = (ff * g - ef * h) / below, (ee * h - ef * g) / below
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return np.inf
    place[0], place[1], place[2] = 1.0 - u - v, u, v
    return (dx - u * ex - v * fx) ** 2 + (dy - u * ey - v * fy) ** 2 + (dz - u * ez - v * fz) ** 2


@numba.njit(cache=True, nogil=True)
def _pierced(a, i, p, q, b, j, place):
    """Where an edge goes through a triangle, from 0 to 1, and barycentric coordinates there; −1 if it does not."""
    start, stop = 0.0, 0.0
    for k in range(3):
        m, n = (k + 1) % 3, (k + 2) % 3
        normal = (b[j, 1, m] - b[j, 0, m]) * (b[j, 2, n] - b[j, 0, n]) - (b[j, 1, n] - b[j, 0, n]) * (
            b[j, 2, m] - b[j, 0, m]
        )
        start += normal * (a[i, p, k] - b[j, 0, k])
        stop += normal * (a[i, q, k] - b[j, 0, k])
    if start * stop >= 0.0:
        return -1.0
    share = start / (start - stop)
    x, y, z = a[i, p, 0], a[i, p, 1], a[i, p, 2]
    x, y, z = x + share * (a[i, q, 0] - x), y + share * (a[i, q, 1] - y), z + share * (a[i, q, 2] - z)
    return share if np.isfinite(_point(x, y, z, b, j, place)) else -1.0
