"""Taylor models of second order in two variables: a quadratic polynomial and a bound of the remainder.

They enclose functions on whole cells s, t ∈ [-1, 1], many cells at a time (Makino and Berz, Taylor models and other
validated functional inclusion methods, 2003). The remainder is of third order, so it is eight times smaller on half a
cell. The value at the cell's centre is exact. Rounding errors, about 1e-13 relative, are neglected.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Taylor:
    """f = c₀ + c₁s + c₂t + c₃s² + c₄st + c₅t² ± rest on n cells.

    Attributes
    ----------
    c : (6, n) array
    rest : (n,) array
        Bound of the remainder, not negative; infinite if there is no bound.
    """

    __array_ufunc__ = None  # so that numpy hands `array * model` to this class

    def __init__(self, c: Floats, rest: Floats) -> None:
        self.c, self.rest = c, rest

    @cached_property
    def _linear(self) -> Floats:
        return np.abs(self.c[1]) + np.abs(self.c[2])

    @cached_property
    def _quadratic(self) -> Floats:
        return np.abs(self.c[3]) + np.abs(self.c[4]) + np.abs(self.c[5])

    @cached_property
    def largest(self) -> Floats:
        """An upper bound (n,) of |f|."""
        return np.abs(self.c[0]) + self._linear + self._quadratic + self.rest

    def __add__(self, other: Taylor) -> Taylor:
        return Taylor(self.c + other.c, self.rest + other.rest)

    def __sub__(self, other: Taylor) -> Taylor:
        return Taylor(self.c - other.c, self.rest + other.rest)

    def __mul__(self, other: Taylor | float) -> Taylor:
        if not isinstance(other, Taylor):
            return Taylor(self.c * other, self.rest * abs(other))
        a, b = self.c, other.c
        c = a[0] * b + b[0] * a
        c[0] -= a[0] * b[0]
        c[3] += a[1] * b[1]
        c[4] += a[1] * b[2] + a[2] * b[1]
        c[5] += a[2] * b[2]
        left_out = self._linear * other._quadratic + self._quadratic * (other._linear + other._quadratic)
        # Not largest·rest + rest·largest, which would include rest·rest twice.
        return Taylor(c, left_out + self.largest * other.rest + (other.largest - other.rest) * self.rest)

    def __rmul__(self, other: float) -> Taylor:
        return self * other

    def inverse(self) -> Taylor:
        """1/f; its remainder is infinite if f may be zero."""
        first = np.where(self.c[0] == 0.0, 1.0, self.c[0])
        part = Taylor(self.c / first, self.rest / np.abs(first))
        part.c[0] = 0.0
        off = np.where(self.c[0] == 0.0, np.inf, part.largest)
        with np.errstate(divide="ignore", invalid="ignore"):
            tail = np.where(off < 1.0, off**3 / (1.0 - off), np.inf)
        square = part * part
        c = square.c - part.c
        c[0] += 1.0
        return Taylor(c / first, (square.rest + part.rest + tail) / np.abs(first))

    def top(self) -> Floats:
        """An upper bound (n,) of f."""
        c = self.c
        bound = c[0] + _highest(c[1], c[3]) + _highest(c[2], c[5]) + np.abs(c[4]) + self.rest
        return np.where(np.isfinite(bound), bound, np.inf)

    def bottom(self) -> Floats:
        """A lower bound (n,) of f."""
        return -(self * -1.0).top()

    def attained(self) -> tuple[Floats, Floats]:
        """A value (n,) that f reaches or exceeds on the cell, and the point (n, 2) in s and t where it does."""
        c, (s, t) = self.c, _PLACES
        values = c[0] + np.outer(s, c[1]) + np.outer(t, c[2]) + np.outer(s * s, c[3]) + np.outer(s * t, c[4])
        values = values + np.outer(t * t, c[5])
        values[1:] -= self.rest
        values = np.where(np.isfinite(values), values, -np.inf)
        best = np.argmax(values, axis=0)
        return values[best, np.arange(len(best))], _PLACES[:, best].T


_THIRD = np.add.outer(np.arange(4), np.arange(4)) > 2  # powers beyond second order

# Centre, corners and midpoints of the sides of a cell.
_PLACES = np.array([[0, 0], [-1, -1], [-1, 1], [1, -1], [1, 1], [-1, 0], [1, 0], [0, -1], [0, 1]], dtype=float).T


def _highest(slope: Floats, bend: Floats) -> Floats:
    """Maximum of slope·s + bend·s² over [-1, 1]."""
    inside = np.abs(slope) < -2.0 * bend
    return np.where(inside, slope**2 / np.where(inside, -4.0 * bend, 1.0), np.abs(slope) + bend)


def taylor(coefficients: Floats) -> Taylor:
    """Models of polynomials with coefficients (n, 4, 4) of t^i s^j; terms beyond second order go into the remainder."""
    p = np.moveaxis(coefficients, 0, -1)
    c = np.stack([p[0, 0], p[0, 1], p[1, 0], p[0, 2], p[1, 1], p[2, 0]])
    return Taylor(c, np.abs(p[_THIRD]).sum(axis=0))
