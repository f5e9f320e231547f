"""Points of two patches: their distance in space and on the starting tube, and the closest pair."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def apart(box_a, box_b, u_a, v_a, u_b, v_b, size):
    """Distance in mm between two points on the starting tube, see `measures/distances.py`.

    Parameters
    ----------
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    u_a, v_a, u_b, v_b : float
        The points on both patches, from 0 to 1.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    """
    turn = abs(box_a[0] + u_a * box_a[1] - box_b[0] - u_b * box_b[1])
    aside = abs(np.sin(np.pi * turn)) / np.pi * min(cubic(box_a[4:], v_a), cubic(box_b[4:], v_b))
    up = box_a[2] + v_a * box_a[3] - box_b[2] - v_b * box_b[3]
    return np.hypot(aside * size[0], up * size[1])


@numba.njit(cache=True)
def cubic(c, v):
    """Value at v of the cubic with coefficients c (4,)."""
    return c[0] + v * (c[1] + v * (c[2] + v * c[3]))


@numba.njit(cache=True)
def counts(box_a, box_b, here, size, neighbourhood):
    """Whether two points are not within each other's neighbourhood.

    Parameters
    ----------
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    here : (4,) array
        u and v on the first and on the second patch, from 0 to 1.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    if neighbourhood == 0.0:
        return True
    return apart(box_a, box_b, here[0], here[1], here[2], here[3], size) >= neighbourhood


@numba.njit(cache=True)
def distance(a, b, here, box_a, box_b, size, neighbourhood):
    """Distance in mm between two points; infinite if they are within each other's neighbourhood.

    Parameters
    ----------
    a, b : (4, 4, 3) arrays
        Control nets of both patches, mm.
    here : (4,) array
        u and v on the first and on the second patch, from 0 to 1.
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    if not counts(box_a, box_b, here, size, neighbourhood):
        return np.inf
    way = np.empty(3)
    between(a, b, here, way)
    return np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)


@numba.njit(cache=True)
def descend(a, b, here, box_a, box_b, size, neighbourhood):
    """Move two points within their patches to a local minimum of their distance, by damped Newton steps; returns it.

    Parameters
    ----------
    a, b : (4, 4, 3) arrays
        Control nets of both patches, mm.
    here : (4,) array
        u and v on the first and on the second patch, from 0 to 1. Overwritten.
    box_a, box_b : (8,) arrays
        Start and width in q and in r of both patches, and the coefficients of S(v), see `Patches`.
    size : (2,) array
        Circumference and length of the starting tube, mm.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    """
    best = distance(a, b, here, box_a, box_b, size, neighbourhood)
    x, y = np.empty((6, 3)), np.empty((6, 3))
    slope, H, trial = np.empty(4), np.empty((4, 4)), np.empty(4)
    damping, fresh = 1e-3, True
    for _ in range(16):
        if fresh:
            _derivatives(a, here[0], here[1], x)
            _derivatives(b, here[2], here[3], y)
            for m in range(4):
                slope[m] = 0.0
                for n in range(4):
                    H[m, n] = 0.0
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
                    for n in range(4):
                        H[m, n], H[n, m] = 0.0, 0.0
                    H[m, m] = 1.0
        scale = max(H[0, 0], H[1, 1], H[2, 2], H[3, 3], 1e-12)
        if not _solve(H, damping * scale, slope, trial):
            damping, fresh = 8.0 * damping, False
            continue
        moved = 0.0
        for m in range(4):
            trial[m] = min(max(here[m] - trial[m], 0.0), 1.0)
            moved = max(moved, abs(trial[m] - here[m]))
        away = distance(a, b, trial, box_a, box_b, size, neighbourhood)
        if away < best:
            fresh = True
            converged = best - away < 1e-7 * best
            best = away
            for m in range(4):
                here[m] = trial[m]
            damping *= 0.1
            if converged:
                break
        else:
            damping, fresh = 8.0 * damping, False
        if moved < 1e-9:
            break
    return best


@numba.njit(cache=True)
def between(a, b, here, way):
    """Vector between the points at u, v of both patches (4,), from the first to the second.

    Parameters
    ----------
    a, b : (4, 4, 3) arrays
        Control nets of both patches, mm.
    here : (4,) array
        u and v on the first and on the second patch, from 0 to 1.
    way : (3,) array
        Overwritten by the vector, mm.
    """
    x, y = np.empty(3), np.empty(3)
    _point(a, here[0], here[1], x)
    _point(b, here[2], here[3], y)
    for c in range(3):
        way[c] = y[c] - x[c]


@numba.njit(cache=True)
def _point(net, u, v, out):
    """Position of a point of a patch."""
    s, t = 1.0 - u, 1.0 - v
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    for i in range(4):
        wv = t * t * t if i == 0 else 3 * t * t * v if i == 1 else 3 * t * v * v if i == 2 else v * v * v
        for j in range(4):
            wu = s * s * s if j == 0 else 3 * s * s * u if j == 1 else 3 * s * u * u if j == 2 else u * u * u
            for c in range(3):
                out[c] += wv * wu * net[i, j, c]


@numba.njit(cache=True)
def _derivatives(net, u, v, out):
    """Position and derivatives u, v, uu, uv, vv of a patch, into out (6, 3)."""
    by_u, by_v = np.empty((3, 4)), np.empty((3, 4))
    _weights(u, by_u)
    _weights(v, by_v)
    for m in range(6):
        for c in range(3):
            out[m, c] = 0.0
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
def _weights(t, values):
    """Bernstein polynomials (3, 4) and their first two derivatives at t."""
    s = 1.0 - t
    values[0, 0], values[0, 1], values[0, 2], values[0, 3] = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
    values[1, 0], values[1, 1] = -3 * s * s, 3 * s * s - 6 * s * t
    values[1, 2], values[1, 3] = 6 * s * t - 3 * t * t, 3 * t * t
    values[2, 0], values[2, 1], values[2, 2], values[2, 3] = 6 * s, 6 * t - 12 * s, 6 * s - 12 * t, 6 * t


@numba.njit(cache=True)
def _solve(H, shift, slope, step):
    """Solve (H + shift) step = slope by Cholesky's method; returns False if the matrix is not positive definite."""
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
