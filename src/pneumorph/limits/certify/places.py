"""Places where limits are not certified to be satisfied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Points(NamedTuple):
    """Points where a limit on single points is not certified, n of them.

    Attributes
    ----------
    surface : (n,) array
        Index of the surface; the exterior is 0.
    at : (n, 3) array
        Numbers by which the surface knows the points. Of a tube q, r and s: s is 1 on the tube itself; on an end disc
        (r = 0 or 1) it is the fraction of the way from its centre to its rim.
    attained, certified : (n,) arrays
        The value there, and the certified one for its cell, in the limit's unit.
    """

    surface: Ints
    at: Floats
    attained: Floats
    certified: Floats


NO_POINTS = Points(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), *np.zeros((2, 0)))


class Pairs(NamedTuple):
    """Pairs of points where a limit on distances is not certified, n of them.

    Attributes
    ----------
    surface_a, surface_b : (n,) arrays
        Indices of the surfaces; the exterior is 0.
    a, b : (n, 3) arrays
        The closest points found, see `Points.at`.
    attained, certified : (n,) arrays
        Their distance in mm, and the certified one of the two pieces of surfaces that contain them.
    """

    surface_a: Ints
    surface_b: Ints
    a: Floats
    b: Floats
    attained: Floats
    certified: Floats


Places = Mapping[str, Points | Pairs]
"""All places where limits are not certified to hold, not only the worst ones, by the names of the limits.

Points by cell; pairs for every piece and the nearest other piece.
"""


_Places = TypeVar("_Places", bound=Points | Pairs)


def joined(one: _Places, other: _Places) -> _Places:
    """Concatenate places of the same limit."""
    return type(one)._make(np.concatenate(parts) for parts in zip(one, other, strict=True))


def together(one: Places, other: Places) -> Places:
    """The places of two certificates of the same problem."""
    return {name: joined(known, other[name]) for name, known in one.items()}
