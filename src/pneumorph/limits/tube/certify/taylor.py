"""Taylor models of second order in two variables: a quadratic polynomial and a bound of the remainder.

They enclose functions on a cell s, t ∈ [-1, 1] (Makino and Berz, Taylor models and other validated functional inclusion
methods, 2003). The remainder is of third order, so it is eight times smaller on half a cell. The value at the cell's
centre is exact. Rounding errors, about 1e-13 relative, are neglected.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_PLACES = np.array([(0, 0), *((s, t) for s in (-1, 0, 1) for t in (-1, 0, 1))], dtype=float)
"""s and t (10, 2) of a cell's centre, and then of its centre, corners and middles of sides."""
_POWERS = ((0, 1, 3), (2, 4), (5,))
"""Which coefficient is that of t^i s^j."""


class Taylor:
    """Models f = c₀ + c₁s + c₂t + c₃s² + c₄st + c₅t² ± rest of functions on n cells.

    They can be added, subtracted and multiplied like numbers, and scaled by a number for all cells or for each.

    Attributes
    ----------
    c : (7, n) array
        The coefficients, and the rest, which is never negative, and infinite or not a number if there is no bound.
    """

    __slots__ = ("c",)
    __array_ufunc__ = None  # numbers times models are models

    def __init__(self, c: Floats) -> None:
        self.c = c

    @property
    def largest(self) -> Floats:
        """Upper bounds of |f|."""
        return np.abs(self.c).sum(axis=0)

    @property
    def top(self) -> Floats:
        """Upper bounds of f."""
        return self._bound(1.0)

    @property
    def bottom(self) -> Floats:
        """Lower bounds of f."""
        return -self._bound(-1.0)

    def _bound(self, sign: float) -> Floats:
        """Upper bounds of f times a sign."""
        c0, c1, c2, c3, c4, c5, rest = self.c
        bound = sign * c0 + _highest(c1, sign * c3) + _highest(c2, sign * c5) + np.abs(c4) + rest
        return np.where(np.isfinite(bound), bound, np.inf)

    def __add__(self, other: Taylor) -> Taylor:
        return Taylor(self.c + other.c)

    def __sub__(self, other: Taylor) -> Taylor:
        c = self.c - other.c
        c[6] = self.c[6] + other.c[6]
        return Taylor(c)

    def __mul__(self, other: Taylor | Floats | float) -> Taylor:
        if isinstance(other, Taylor):
            c = np.empty(self.c.shape)
            _multiply(self.c, other.c, c)
            return Taylor(c)
        c = self.c * other
        np.abs(c[6], out=c[6])
        return Taylor(c)

    __rmul__ = __mul__

    @property
    def inverse(self) -> Taylor:
        """1/f; its remainder is infinite if f may be zero."""
        zero = self.c[0] == 0.0
        over = 1.0 / np.where(zero, 1.0, self.c[0])
        part = self * over
        part.c[0] = 0.0
        off = np.where(zero, np.inf, part.largest)
        tail = np.where(off < 1.0, off * off * off / (1.0 - off), np.inf)
        found = part * part - part
        found.c[0] = 1.0
        found.c[6] += tail
        return found * over

    def highest_sample(self) -> tuple[Floats, Floats]:
        """Values (n,) that f reaches or exceeds, and s and t (n, 2) where it does: a centre, a corner or a middle."""
        s, t = _PLACES.T
        values = np.stack([np.ones(10), s, t, s * s, s * t, t * t], axis=1) @ self.c[:6]
        values[1:] -= self.c[6]
        values[~np.isfinite(values)] = -np.inf
        best = np.argmax(values, axis=0)
        return values[best, np.arange(len(best))], _PLACES[best]


@numba.njit(cache=True, nogil=True)
def _multiply(a, b, c):
    """Write the products of models a and b (7, n) to c."""
    for n in range(c.shape[1]):
        a0, a1, a2, a3, a4, a5, b0, b1, b2 = (
            a[0, n],
            a[1, n],
            a[2, n],
            a[3, n],
            a[4, n],
            a[5, n],
            b[0, n],
            b[1, n],
            b[2, n],
        )
        linear, other_linear = abs(a1) + abs(a2), abs(b1) + abs(b2)
        bends, other_bends = abs(a3) + abs(a4) + abs(a5), abs(b[3, n]) + abs(b[4, n]) + abs(b[5, n])
        largest, polynomial = abs(a0) + linear + bends + a[6, n], abs(b0) + other_linear + other_bends
        c[0, n] = a0 * b0
        c[1, n] = a0 * b1 + b0 * a1
        c[2, n] = a0 * b2 + b0 * a2
        c[3, n] = a0 * b[3, n] + b0 * a3 + a1 * b1
        c[4, n] = a0 * b[4, n] + b0 * a4 + a1 * b2 + a2 * b1
        c[5, n] = a0 * b[5, n] + b0 * a5 + a2 * b2
        left_out = linear * other_bends + bends * (other_linear + other_bends)
        c[6, n] = left_out + largest * b[6, n] + polynomial * a[6, n]


def _highest(slope: Floats, bend: Floats) -> Floats:
    """Maximum of slope·s + bend·s² over [-1, 1]."""
    inside = np.abs(slope) < -2.0 * bend
    return np.where(inside, slope * slope / np.where(inside, -4.0 * bend, 1.0), np.abs(slope) + bend)


def modelled(p: Floats) -> tuple[Taylor, ...]:
    """The models of f polynomials with coefficients (f, 4, 4, n) of t^i s^j, or with fewer powers of t or of s.

    Terms beyond second order go into the rest.
    """
    found = np.zeros((len(p), 7, p.shape[-1]))
    for i, j in np.ndindex(p.shape[1:3]):
        if i + j > 2:
            found[:, 6] += np.abs(p[:, i, j])
        else:
            found[:, _POWERS[i][j]] = p[:, i, j]
    return tuple(map(Taylor, found))
