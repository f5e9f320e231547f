"""Lower bounds of the distance between two patches from quadratic polynomials in the parameters of both.

Both patches are expanded to second order, and so is the square of their distance; what is left out is of third order.
Slabs are accurate to second order only: they do not know that points of both patches that are far apart sideways are
not near each other. Where only points a neighbourhood apart on the starting tube count, a multiple of the excess of
their squared distance there is subtracted (Lagrange's multiplier), which bounds the distance at these points.
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.limits.tube.certify.closest_pair import factorised, substitute

_POWERS = np.array([[1.0, 3.0, 3.0, 1.0], [-3.0, -3.0, 3.0, 3.0], [3.0, -3.0, -3.0, 3.0], [-1.0, 3.0, -3.0, 1.0]]) / 8.0
"""Coefficients of the powers of s ∈ [-1, 1] of a cubic, from its control points."""
_TERMS = np.array([[0, 1, 3, 6], [2, 4, 6, 6], [5, 6, 6, 6], [6, 6, 6, 6]])
"""Rows of `terms` with the coefficients of v^i u^j; 6 is none, what is left out."""
_LINEAR = np.array([1, 2, 7, 8])
_BENDS = np.array([3, 4, 5, 9, 10, 11])


@numba.njit(cache=True)
def clears(nets, path, neighbourhood, enough, terms, M, L, H, vectors):
    """Whether points of two nets are proved to be `enough` apart, if they are a neighbourhood apart on the tube.

    Points are given by z = (u, v) of the first and of the second patch, from -1 to 1. The vector between them is
    c + A z + Q(z) + e, where Q has the products of u and v of either patch, and e what is left out of both.

    Parameters
    ----------
    nets : (2, 48) array
        Control nets of both patches, see `slabs`.
    path : (3, 2) array
        See `slabs.steps`; used where not all points count.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm; all count if it is zero.
    enough : float
        mm.
    terms, M, L, H, vectors : (13, 3), four (4, 4) arrays
        Overwritten.
    """
    needed = enough + _expand(nets, terms, M)
    # The squared distance is at least room + enough² + slope·z + z·M z.
    room = _dot(terms, 12, 12) - needed * needed
    for m in range(4):
        if neighbourhood == 0.0 and room <= 0.0:
            return False
        for n in range(6):
            room -= 2.0 * abs(_dot(terms, _LINEAR[m], _BENDS[n]))
    if neighbourhood == 0.0 and room <= 0.0:
        return False
    for m in range(4):
        vectors[0, m] = 2.0 * _dot(terms, _LINEAR[m], 12)
        for n in range(4):
            M[m, n] = _dot(terms, _LINEAR[m], _LINEAR[n])
            if m // 2 == n // 2:
                M[m, n] += (2.0 if m == n else 1.0) * _dot(terms, 12, 6 * (m // 2) + 3 + m % 2 + n % 2)
    if neighbourhood > 0.0:
        room -= _lagrange(path, neighbourhood, vectors, M)
    return room > 0.0 and _stays_above(-room, M, L, H, vectors)


@numba.njit(cache=True)
def _expand(nets, terms, rows):
    """Coefficients of 1, u, v, u², uv, v² about the middles, the sign of the first patch changed, and the vector c.

    Returns a bound of what is left out of the vector between both patches. `rows` (4, 4) is overwritten.
    """
    left_out = 0.0
    for side in range(2):
        square, sign = 0.0, 2.0 * side - 1.0
        for c in range(3):
            rest = 0.0
            for i in range(4):
                for j in range(4):
                    rows[i, j] = 0.0
                    for k in range(4):
                        rows[i, j] += _POWERS[j, k] * nets[side, 12 * i + 3 * k + c]
            for i in range(4):
                for j in range(4):
                    value = 0.0
                    for k in range(4):
                        value += _POWERS[i, k] * rows[k, j]
                    if i + j > 2:
                        rest += abs(value)
                    else:
                        terms[6 * side + _TERMS[i, j], c] = sign * value
            square += rest * rest
        left_out += np.sqrt(square)
    for c in range(3):
        terms[12, c] = terms[0, c] + terms[6, c]
    return left_out


@numba.njit(cache=True)
def _lagrange(path, neighbourhood, vectors, M):
    """Subtract λ(|δ|² - neighbourhood²) from a polynomial, where δ is the step on the starting tube; λ is not negative.

    Any λ gives a bound. At a minimum on the edge of the neighbourhood it is the ratio of the gradients. Returns what is
    to be subtracted from the polynomial's constant; its slope is the first of the vectors.
    """
    over, under, square = 0.0, 0.0, 0.0
    for m in range(4):
        # How δ changes with z, and from it the derivative of |δ|² at the middle.
        k = m % 2
        vectors[1, m] = -path[1, k] if m < 2 else path[2, k]
        vectors[2, m] = 2.0 * path[0, k] * vectors[1, m]
        over += vectors[0, m] * vectors[2, m]
        under += vectors[2, m] * vectors[2, m]
        square += 0.5 * path[0, k] * path[0, k]
    factor = max(over, 0.0) / under if under > 0.0 else 0.0
    for m in range(4):
        k = m % 2
        vectors[0, m] -= factor * vectors[2, m]
        for n in range(k, 4, 2):
            M[m, n] -= factor * vectors[1, m] * vectors[1, n]
    return factor * (square - neighbourhood * neighbourhood)


@numba.njit(cache=True)
def _stays_above(level, M, L, H, vectors):
    """Whether slope·z + z·M z is proved to be above a negative level for z (4,) from -1 to 1.

    A shift of M that makes it positive definite changes the polynomial by at most four times as much. The convex
    polynomial then lies above its tangent plane at any point; points are sought by Newton's method on active sets.
    Slope, z, gradient and step are the first four vectors.
    """
    shift, sound = 0.0, False
    for share in (1e-6, 0.02, 0.2):
        if not sound:
            shift = -share * level
            sound = factorised(M, shift, L)
    if not sound:
        return False
    level += 4.0 * shift
    for m in range(4):
        vectors[1, m], vectors[2, m] = 0.0, vectors[0, m]
    for _ in range(8):
        value, tangent, free = 0.0, 0.0, False
        for m in range(4):
            z, gradient = vectors[1, m], vectors[2, m]
            value += 0.5 * (vectors[0, m] + gradient) * z
            tangent -= gradient * z + abs(gradient)
        if value + tangent >= level:
            return True
        if value < level:
            return False
        for m in range(4):
            for n in range(4):
                H[m, n] = M[m, n]
        for m in range(4):
            z, gradient = vectors[1, m], vectors[2, m]
            vectors[3, m] = 0.5 * gradient
            if (z <= -1.0 and gradient > 0.0) or (z >= 1.0 and gradient < 0.0):
                vectors[3, m] = 0.0
                for n in range(4):
                    H[m, n], H[n, m] = 0.0, 0.0
                H[m, m] = 1.0
            else:
                free = True
        if not free or not factorised(H, shift, L):
            return False
        substitute(L, vectors, 3)
        longest = 1.0
        for m in range(4):
            z, step = vectors[1, m], vectors[3, m]
            if abs(z - step) > 1.0:
                longest = min(longest, (z - (1.0 if z > step else -1.0)) / step)
        for m in range(4):
            vectors[1, m] = min(max(vectors[1, m] - longest * vectors[3, m], -1.0), 1.0)
        for m in range(4):
            vectors[2, m] = vectors[0, m] + 2.0 * shift * vectors[1, m]
            for n in range(4):
                vectors[2, m] += 2.0 * M[m, n] * vectors[1, n]
    return False


@numba.njit(cache=True)
def _dot(terms, one, other):
    return terms[one, 0] * terms[other, 0] + terms[one, 1] * terms[other, 1] + terms[one, 2] * terms[other, 2]
