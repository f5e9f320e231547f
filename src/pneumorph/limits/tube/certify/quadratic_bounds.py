"""Lower bounds of the distance between two patches from quadratic polynomials in the parameters of both.

Both patches are expanded to second order, and so is the square of their distance; what is left out is of third order.
Slabs are accurate to second order only: they do not know that points of both patches that are far apart sideways are
not near each other. Where only points a neighbourhood apart on the starting tube count, a multiple of the excess of
their squared distance there is subtracted (Lagrange's multiplier), which bounds the distance at these points.
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.limits.tube.certify.slabs import steps


@numba.njit(cache=True)
def workspace():
    """Arrays that `clears` uses again and again: two expansions, three matrices and five vectors."""
    return np.empty((2, 6, 3)), np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4)), np.empty((5, 4))


@numba.njit(cache=True)
def clears(a, b, box_a, box_b, span, size, neighbourhood, enough, arrays):
    """Whether points of two nets are proved to be `enough` apart, if they are a neighbourhood apart on the tube.

    Points are given by z = (u, v) of the first and of the second patch, from -1 to 1. The vector between them is
    c + A z + Q(z) + e, where Q has the products of u and v of either patch, and e what is left out of both.

    Parameters
    ----------
    a, b : (4, 4, 3) arrays
        Control nets of both patches, mm.
    box_a, box_b, span, size
        See `slabs.steps`.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    enough : float
        mm.
    arrays : tuple of arrays
        See `workspace`; overwritten.
    """
    terms, M, L, H, vectors = arrays
    rest_a, rest_b = _expand(a, -1.0, terms[0]), _expand(b, 1.0, terms[1])
    c = vectors[0]
    for k in range(3):
        c[k] = terms[0, 0, k] + terms[1, 0, k]
    # The squared distance is at least room + enough² + slope·z + z·M z.
    needed = enough + rest_a + rest_b
    room = _dot(c, c) - needed * needed
    if neighbourhood == 0.0 and room <= 0.0:
        return False
    for m in range(4):
        for n in range(6):
            room -= 2.0 * abs(_dot(terms[m // 2, 1 + m % 2], terms[n // 3, 3 + n % 3]))
    if neighbourhood == 0.0 and room <= 0.0:
        return False
    slope = vectors[1]
    for m in range(4):
        tangent = terms[m // 2, 1 + m % 2]
        slope[m] = 2.0 * _dot(tangent, c)
        for n in range(m + 1):
            M[m, n] = _dot(tangent, terms[n // 2, 1 + n % 2])
    for side in range(2):
        M[2 * side, 2 * side] += 2.0 * _dot(c, terms[side, 3])
        M[2 * side + 1, 2 * side] += _dot(c, terms[side, 4])
        M[2 * side + 1, 2 * side + 1] += 2.0 * _dot(c, terms[side, 5])
    for m in range(4):
        for n in range(m):
            M[n, m] = M[m, n]
    if neighbourhood > 0.0:
        known, between, half_a, half_b = steps(box_a, box_b, span, size, neighbourhood)
        if not known:
            return False
        room = _lagrange(room, slope, M, between, half_a, half_b, neighbourhood)
    return room > 0.0 and _stays_above(-room, slope, M, L, H, vectors[2:])


@numba.njit(cache=True)
def _lagrange(constant, slope, M, between, half_a, half_b, neighbourhood):
    """Subtract λ(|δ|² - neighbourhood²) from a polynomial, where δ is the step on the starting tube; λ is not negative.

    Any λ gives a bound. At a minimum on the edge of the neighbourhood it is the ratio of the gradients.
    """
    over, under = 0.0, 0.0
    for m in range(4):
        # The derivative of |δ|² with respect to z at the middle.
        along = 2.0 * between[m % 2] * (-half_a[m % 2] if m < 2 else half_b[m % 2])
        over += slope[m] * along
        under += along * along
    factor = max(over, 0.0) / under if under > 0.0 else 0.0
    for k in range(2):
        slope[k] += 2.0 * factor * half_a[k] * between[k]
        slope[2 + k] -= 2.0 * factor * half_b[k] * between[k]
        M[k, k] -= factor * half_a[k] * half_a[k]
        M[2 + k, 2 + k] -= factor * half_b[k] * half_b[k]
        M[k, 2 + k] += factor * half_a[k] * half_b[k]
        M[2 + k, k] += factor * half_a[k] * half_b[k]
    return constant - factor * (between[0] * between[0] + between[1] * between[1] - neighbourhood * neighbourhood)


@numba.njit(cache=True)
def _stays_above(level, slope, M, L, H, vectors):
    """Whether slope·z + z·M z is proved to be above a negative level for z (4,) from -1 to 1.

    A shift of M that makes it positive definite changes the polynomial by at most four times as much. The convex
    polynomial then lies above its tangent plane at any point; points are sought by Newton's method on active sets.
    """
    shift = 0.0
    for share in (1e-6, 0.02, 0.2):
        shift = -share * level
        if _factorised(M, shift, L):
            break
        if share == 0.2:
            return False
    level += 4.0 * shift
    z, gradient, step = vectors
    for m in range(4):
        z[m], gradient[m] = 0.0, slope[m]
    for _ in range(8):
        value, tangent = 0.0, 0.0
        for m in range(4):
            value += 0.5 * (slope[m] + gradient[m]) * z[m]
            tangent -= gradient[m] * z[m] + abs(gradient[m])
        if value + tangent >= level:
            return True
        if value < level:
            return False
        free = 0
        for m in range(4):
            for n in range(m + 1):
                H[m, n] = M[m, n]
            step[m] = 0.5 * gradient[m]
        for m in range(4):
            if (z[m] <= -1.0 and gradient[m] > 0.0) or (z[m] >= 1.0 and gradient[m] < 0.0):
                step[m] = 0.0
                for n in range(4):
                    H[max(m, n), min(m, n)] = 0.0
                H[m, m] = 1.0
            else:
                free += 1
        if not free or not _factorised(H, shift, L):
            return False
        _substitute(L, step)
        longest = 1.0
        for m in range(4):
            if z[m] - step[m] > 1.0:
                longest = min(longest, (z[m] - 1.0) / step[m])
            elif z[m] - step[m] < -1.0:
                longest = min(longest, (z[m] + 1.0) / step[m])
        for m in range(4):
            z[m] = min(max(z[m] - longest * step[m], -1.0), 1.0)
        for m in range(4):
            gradient[m] = slope[m] + 2.0 * shift * z[m]
            for n in range(4):
                gradient[m] += 2.0 * M[m, n] * z[n]
    return False


@numba.njit(cache=True, error_model="numpy")
def _factorised(M, shift, L):
    """Whether M + shift (of which the lower half is used) is positive definite; its factor L D Lᵀ, with D in L."""
    for i in range(4):
        for j in range(i + 1):
            total = M[i, j] + (shift if i == j else 0.0)
            for k in range(j):
                total -= L[i, k] * L[j, k] * L[k, k]
            if i == j:
                if not total > 0.0:
                    return False
                L[i, i] = total
            else:
                L[i, j] = total / L[j, j]
    return True


@numba.njit(cache=True, error_model="numpy")
def _substitute(L, x):
    """Solve L D Lᵀ x = b, given b in x."""
    for i in range(4):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
    for i in range(3, -1, -1):
        x[i] /= L[i, i]
        for k in range(i + 1, 4):
            x[i] -= L[k, i] * x[k]


@numba.njit(cache=True)
def _expand(net, sign, terms):
    """Coefficients of 1, u, v, u², uv, v² of a patch about its middle, times a sign; returns the norm of the rest."""
    square = 0.0
    for k in range(3):
        rest = 0.0
        p0, p1, p2, p3 = (
            _powers(net[0, 0, k], net[0, 1, k], net[0, 2, k], net[0, 3, k]),
            _powers(net[1, 0, k], net[1, 1, k], net[1, 2, k], net[1, 3, k]),
            _powers(net[2, 0, k], net[2, 1, k], net[2, 2, k], net[2, 3, k]),
            _powers(net[3, 0, k], net[3, 1, k], net[3, 2, k], net[3, 3, k]),
        )
        one, v, vv, vvv = _powers(p0[0], p1[0], p2[0], p3[0])
        u, uv, uvv, uvvv = _powers(p0[1], p1[1], p2[1], p3[1])
        uu, uuv, uuvv, uuvvv = _powers(p0[2], p1[2], p2[2], p3[2])
        uuu, uuuv, uuuvv, uuuvvv = _powers(p0[3], p1[3], p2[3], p3[3])
        rest = abs(vvv) + abs(uvv) + abs(uvvv) + abs(uuv) + abs(uuvv) + abs(uuvvv)
        rest += abs(uuu) + abs(uuuv) + abs(uuuvv) + abs(uuuvvv)
        terms[0, k], terms[1, k], terms[2, k] = sign * one, sign * u, sign * v
        terms[3, k], terms[4, k], terms[5, k] = sign * uu, sign * uv, sign * vv
        square += rest * rest
    return np.sqrt(square)


@numba.njit(cache=True)
def _powers(p0, p1, p2, p3):
    """Coefficients of the powers of s ∈ [-1, 1] of a cubic with the given control points."""
    outer, inner = p0 + p3, p1 + p2
    turn, bend = p3 - p0, p2 - p1
    return (
        0.125 * (outer + 3.0 * inner),
        0.375 * (turn + bend),
        0.375 * (outer - inner),
        0.125 * (turn - 3.0 * bend),
    )


@numba.njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
