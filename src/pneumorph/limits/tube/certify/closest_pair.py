"""Points of two patches: their distance in space and on the starting tube, and the closest pair.

A pair of patches is given by their indices (2,) in arrays of all of them. Places on both are u and v on the first and
then on the second, from 0 to 1.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def apart(boxes, pair, here, size):
    """Distance in mm between two points on the starting tube, see `measures/distances.py`.

    Parameters
    ----------
    boxes : (n, 8) array
        Start and width in q and in r of patches, and the coefficients of S(v), see `Patches`.
    pair : (2,) array
    here : (4,) array
    size : (2,) array
        Circumference and length of the starting tube, mm.
    """
    turn, up, shrink = 0.0, 0.0, np.inf
    for side in range(2):
        k, sign = pair[side], 1.0 - 2.0 * side
        turn += sign * (boxes[k, 0] + here[2 * side] * boxes[k, 1])
        up += sign * (boxes[k, 2] + here[2 * side + 1] * boxes[k, 3])
        shrink = min(shrink, around(boxes, k, here[2 * side + 1]))
    return np.hypot(np.sin(np.pi * turn) / np.pi * shrink * size[0], up * size[1])


@numba.njit(cache=True)
def around(boxes, k, v):
    """S at v of a patch."""
    return boxes[k, 4] + v * (boxes[k, 5] + v * (boxes[k, 6] + v * boxes[k, 7]))


@numba.njit(cache=True)
def distance(powers, boxes, pair, here, size, neighbourhood, x):
    """Distance in mm between two points; infinite if they are within each other's neighbourhood.

    Parameters
    ----------
    powers : (n, 48) array
        Coefficients of v^i u^j and component of patches, mm.
    boxes, pair, here, size
        As `apart` has them.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    x : (12, 3) array
        Overwritten by position and derivatives u, v, uu, uv, vv of either patch, mm, if the points count.
    """
    if neighbourhood > 0.0 and apart(boxes, pair, here, size) < neighbourhood:
        return np.inf
    for side in range(2):
        k, u, v = pair[side], here[2 * side], here[2 * side + 1]
        for c in range(3):
            at, at_u, at_v, at_uu, at_uv, at_vv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(3, -1, -1):
                row, row_u, row_uu = 0.0, 0.0, 0.0
                for j in range(3, -1, -1):
                    row_uu = row_uu * u + 2.0 * row_u
                    row_u = row_u * u + row
                    row = row * u + powers[k, 12 * i + 3 * j + c]
                at_vv, at_uv, at_uu = at_vv * v + 2.0 * at_v, at_uv * v + at_u, at_uu * v + row_uu
                at_v, at_u, at = at_v * v + at, at_u * v + row_u, at * v + row
            first = 6 * side
            x[first, c], x[first + 1, c], x[first + 2, c] = at, at_u, at_v
            x[first + 3, c], x[first + 4, c], x[first + 5, c] = at_uu, at_uv, at_vv
    square = 0.0
    for c in range(3):
        square += (x[6, c] - x[0, c]) ** 2
    return np.sqrt(square)


@numba.njit(cache=True)
def descend(powers, boxes, pair, here, size, neighbourhood, x):
    """Move two points within their patches to a local minimum of their distance, by damped Newton steps; returns it.

    Parameters
    ----------
    powers, boxes, pair, size, neighbourhood, x
        As `distance` has them.
    here : (4,) array
        Overwritten.
    """
    best = distance(powers, boxes, pair, here, size, neighbourhood, x)
    H, L, vectors = np.empty((4, 4)), np.empty((4, 4)), np.empty((3, 4))
    damping, fresh = 1e-3, True
    for _ in range(16):
        if fresh:
            _expand(x, vectors, H)
            for m in range(4):
                slope = vectors[0, m]
                if (here[m] <= 0.0 and slope > 0.0) or (here[m] >= 1.0 and slope < 0.0):
                    vectors[0, m] = 0.0
                    for n in range(4):
                        H[m, n], H[n, m] = 0.0, 0.0
                    H[m, m] = 1.0
        scale = 1e-12
        for m in range(4):
            scale = max(scale, H[m, m])
            vectors[1, m] = vectors[0, m]
        if not factorised(H, damping * scale, L):
            damping, fresh = 8.0 * damping, False
            continue
        substitute(L, vectors, 1)
        moved = 0.0
        for m in range(4):
            vectors[2, m] = min(max(here[m] - vectors[1, m], 0.0), 1.0)
            moved = max(moved, abs(vectors[2, m] - here[m]))
        away = distance(powers, boxes, pair, vectors[2], size, neighbourhood, x)
        fresh = away < best
        converged = best - away < 1e-7 * best
        damping *= 0.1 if fresh else 8.0
        if fresh:
            best = away
            for m in range(4):
                here[m] = vectors[2, m]
        if moved < 1e-9 or (fresh and converged):
            break
    return distance(powers, boxes, pair, here, size, neighbourhood, x)


@numba.njit(cache=True)
def _expand(x, slope, H):
    """Derivatives of half the squared distance of two points: to slope (·, 4), first row, and H (4, 4)."""
    for m in range(4):
        # Of the vector between the points, by u and v of either.
        one, sign = m + 1 if m < 2 else m + 5, 1.0 if m < 2 else -1.0
        slope[0, m] = 0.0
        for c in range(3):
            slope[0, m] += sign * (x[0, c] - x[6, c]) * x[one, c]
        for n in range(4):
            other, bend = n + 1 if n < 2 else n + 5, one // 6 * 6 + 3 + m % 2 + n % 2
            same = m // 2 == n // 2
            H[m, n] = 0.0
            for c in range(3):
                product = x[one, c] * x[other, c]
                H[m, n] += product + sign * (x[0, c] - x[6, c]) * x[bend, c] if same else -product


@numba.njit(cache=True, error_model="numpy")
def factorised(M, shift, L):
    """Whether M + shift (4, 4) is positive definite, of which the lower half is used; its factor L D Lᵀ has D in L."""
    for i in range(4):
        for j in range(i + 1):
            total = M[i, j] + (shift if i == j else 0.0)
            for k in range(j):
                total -= L[i, k] * L[j, k] * L[k, k]
            L[i, j] = total if i == j else total / L[j, j]
        if not L[i, i] > 0.0:
            return False
    return True


@numba.njit(cache=True, error_model="numpy")
def substitute(L, vectors, row):
    """Solve L D Lᵀ x = b, given b in a row of vectors (·, 4), which is overwritten by x."""
    for i in range(4):
        for k in range(i):
            vectors[row, i] -= L[i, k] * vectors[row, k]
    for i in range(3, -1, -1):
        vectors[row, i] /= L[i, i]
        for k in range(i + 1, 4):
            vectors[row, i] -= L[k, i] * vectors[row, k]
