"""Taylor models of second order in two variables: a quadratic polynomial and a bound of the remainder.

They enclose functions on a cell s, t ∈ [-1, 1] (Makino and Berz, Taylor models and other validated functional inclusion
methods, 2003). The remainder is of third order, so it is eight times smaller on half a cell. The value at the cell's
centre is exact. Rounding errors, about 1e-13 relative, are neglected.

A model f = c₀ + c₁s + c₂t + c₃s² + c₄st + c₅t² ± rest is a value of Numba's, with attributes c0 to c5 and rest, that
exists in compiled functions only; there it can be added, subtracted and multiplied like a number. The rest is never
negative, and infinite or not a number if there is no bound.
"""

from __future__ import annotations

import operator
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, make_attribute_wrapper, models, overload, register_model

_compiled = numba.njit(error_model="numpy")  # dividing by zero gives infinity
_FIELDS = ("c0", "c1", "c2", "c3", "c4", "c5", "rest")


class _Taylor(types.Type):
    """Numba's type of models."""

    def __init__(self) -> None:
        super().__init__(name="Taylor")


_TYPE = _Taylor()


@register_model(_Taylor)
class _Struct(models.StructModel):
    def __init__(self, manager, of) -> None:
        super().__init__(manager, of, [(field, types.float64) for field in _FIELDS])


for _field in _FIELDS:
    make_attribute_wrapper(_Taylor, _field, _field)


def _taylor(context, c0, c1, c2, c3, c4, c5, rest):
    """The model with these coefficients and this rest."""

    def build(context, builder, signature, values):
        made = cgutils.create_struct_proxy(_TYPE)(context, builder)
        for field, value in zip(_FIELDS, values, strict=True):
            setattr(made, field, value)
        return made._getvalue()

    return _TYPE(*[types.float64] * len(_FIELDS)), build


taylor: Any = intrinsic(_taylor)


@_compiled
def linear(a):
    """An upper bound of |c₁s + c₂t|."""
    return abs(a.c1) + abs(a.c2)


@_compiled
def quadratic(a):
    """An upper bound of |c₃s² + c₄st + c₅t²|."""
    return abs(a.c3) + abs(a.c4) + abs(a.c5)


@_compiled
def largest(a):
    """An upper bound of |f|."""
    return abs(a.c0) + linear(a) + quadratic(a) + a.rest


@_compiled
def _sum(a, b):
    return taylor(a.c0 + b.c0, a.c1 + b.c1, a.c2 + b.c2, a.c3 + b.c3, a.c4 + b.c4, a.c5 + b.c5, a.rest + b.rest)


@_compiled
def _scaled(a, factor):
    return taylor(
        a.c0 * factor, a.c1 * factor, a.c2 * factor, a.c3 * factor, a.c4 * factor, a.c5 * factor, a.rest * abs(factor)
    )


@_compiled
def _product(a, b):
    linear_a, linear_b, quadratic_a, quadratic_b = linear(a), linear(b), quadratic(a), quadratic(b)
    left_out = linear_a * quadratic_b + quadratic_a * (linear_b + quadratic_b)
    largest_a, polynomial_b = abs(a.c0) + linear_a + quadratic_a + a.rest, abs(b.c0) + linear_b + quadratic_b
    return taylor(
        a.c0 * b.c0,
        a.c0 * b.c1 + b.c0 * a.c1,
        a.c0 * b.c2 + b.c0 * a.c2,
        a.c0 * b.c3 + b.c0 * a.c3 + a.c1 * b.c1,
        a.c0 * b.c4 + b.c0 * a.c4 + a.c1 * b.c2 + a.c2 * b.c1,
        a.c0 * b.c5 + b.c0 * a.c5 + a.c2 * b.c2,
        left_out + largest_a * b.rest + polynomial_b * a.rest,
    )


@overload(operator.add)
def _add(a, b):
    if a is _TYPE and b is _TYPE:
        return lambda a, b: _sum(a, b)


@overload(operator.sub)
def _subtract(a, b):
    if a is _TYPE and b is _TYPE:
        return lambda a, b: _sum(a, _scaled(b, -1.0))


@overload(operator.mul)
def _multiply(a, b):
    if a is _TYPE and b is _TYPE:
        return lambda a, b: _product(a, b)
    if a is _TYPE and isinstance(b, types.Float):
        return lambda a, b: _scaled(a, b)
    if b is _TYPE and isinstance(a, types.Float):
        return lambda a, b: _scaled(b, a)


@_compiled
def inverse(a):
    """1/f; its remainder is infinite if f may be zero."""
    first = 1.0 if a.c0 == 0.0 else a.c0
    part = _scaled(a, 1.0 / first)
    part = taylor(0.0, part.c1, part.c2, part.c3, part.c4, part.c5, part.rest)
    off = np.inf if a.c0 == 0.0 else largest(part)
    tail = off * off * off / (1.0 - off) if off < 1.0 else np.inf
    square = _product(part, part)
    return _scaled(
        taylor(
            1.0,
            -part.c1,
            -part.c2,
            square.c3 - part.c3,
            square.c4 - part.c4,
            square.c5 - part.c5,
            square.rest + part.rest + tail,
        ),
        1.0 / first,
    )


@_compiled
def top(a):
    """An upper bound of f."""
    bound = a.c0 + _highest(a.c1, a.c3) + _highest(a.c2, a.c5) + abs(a.c4) + a.rest
    return bound if np.isfinite(bound) else np.inf


@_compiled
def bottom(a):
    """A lower bound of f."""
    return -top(_scaled(a, -1.0))


@_compiled
def highest_sample(a):
    """A value that f reaches or exceeds on the cell, and s and t where it does: the centre, a corner or a middle."""
    best, at_s, at_t = a.c0 if np.isfinite(a.c0) else -np.inf, 0.0, 0.0
    for s in (-1.0, 0.0, 1.0):
        for t in (-1.0, 0.0, 1.0):
            value = a.c0 + a.c1 * s + a.c2 * t + a.c3 * s * s + a.c4 * s * t + a.c5 * t * t - a.rest
            if np.isfinite(value) and value > best:
                best, at_s, at_t = value, s, t
    return best, at_s, at_t


@_compiled
def _highest(slope, bend):
    """Maximum of slope·s + bend·s² over [-1, 1]."""
    return slope * slope / (-4.0 * bend) if abs(slope) < -2.0 * bend else abs(slope) + bend


@_compiled
def modelled(p):
    """The model of a polynomial with coefficients (4, 4) of t^i s^j; terms beyond second order go into the rest."""
    rest = 0.0
    for i in range(4):
        for j in range(max(3 - i, 0), 4):
            rest += abs(p[i, j])
    return taylor(p[0, 0], p[0, 1], p[1, 0], p[0, 2], p[1, 1], p[2, 0], rest)
