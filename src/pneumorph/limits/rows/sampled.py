"""What a body is asked for to linearise its limits: samples of its surfaces, and the pairs of points that are near.

All points are sums of control points with fixed weights, so that whatever is found at them has exact derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Region
from pneumorph.limits.certify.places import Points

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

CLOSE = -0.03
"""Where c is above this, the worst point is searched between samples too."""

LEAST_SHARE = 0.5
"""Used shares of limits on distances are measured only above this: to find what is farther away takes longer."""

DIGITS = 9
"""Decimals to which values are rounded before they are compared."""

_UNITS = 10.0**DIGITS


class RowBlock(NamedTuple):
    """Several rows with equally many entries: kinds, cells and values (m,), columns and entries (m, k).

    Kinds are indices of limits that are measured together, 0 for one that stands alone. `close` are points, by name of
    the limit, that are to have rows in the next linearisation too.
    """

    kind: Ints
    cell: Ints
    value: Floats
    column: Ints
    entry: Floats
    close: Mapping[str, Points] = MappingProxyType({})


class Near(NamedTuple):
    """What gets rows.

    Attributes
    ----------
    reach : float
        Distances within their bounds by up to this much, mm.
    least : float
        Other values of c above this.
    places : {name: Points} or None
        And these points.
    """

    reach: float
    least: float
    places: Mapping[str, Points] | None


class Placed(NamedTuple):
    """Points of the surface with index `number`: their cells (m,), and `at` (m, 3) as in `places.Points`.

    What they stand for may be by a `margin` (m,), mm, elsewhere; 0 where they are exact.
    """

    number: int
    cell: Ints
    at: Floats
    margin: Floats | float = 0.0


class Sums(NamedTuple):
    """Points as sums of control points of the body: their numbers and weights, (m, k) each."""

    number: Ints
    weight: Floats


class Couples(NamedTuple):
    """Pairs of points that are near each other.

    Attributes
    ----------
    cell : (m,) array
        Cells of the first ones.
    one, other : Sums
    outward : (m, 3) array or None
        Normals of the other surface: the distance of points that have passed through it is negative. Zero, or None,
        where it is positive anyway.
    less : (m,) array or 0
        By how much less their distances count, mm.
    """

    cell: Ints
    one: Sums
    other: Sums
    outward: Floats | None = None
    less: Floats | float = 0.0


class SampledBody(Protocol):
    """A body at samples of its surfaces. Values at samples (...) are arranged as the surface likes."""

    @property
    def body(self) -> Body: ...

    @property
    def spec(self) -> Limits: ...

    @property
    def between(self) -> Region:
        """What is between the planes of the body's ends."""
        ...

    def positions(self, number: int) -> Floats:
        """Positions (..., 3) in mm of the samples of the surface with index `number`."""
        ...

    def in_end_planes(self, number: int) -> NDArray[np.bool_]:
        """Which samples (...) are in the planes of the body's ends in all designs."""
        ...

    def worst(self, number: int, c: Floats, least: float) -> Placed:
        """The worst samples of every cell, or of parts of it, for values c (...), of those above `least`.

        Parameters
        ----------
        number : int
            Index of the surface.
        c : (...) array
        least : float
        """
        ...

    def placed(self, number: int, at: Floats) -> Placed:
        """Points (m, 3) of a surface, see `places.Points`, with their cells."""
        ...

    def sums(self, points: Placed) -> Sums:
        """Points as sums of control points."""
        ...

    def couples(self, first: int, second: int, bound: float, reach: float) -> Couples:
        """Near points of two surfaces, the worst of every cell of the first; those of a surface with itself for folds.

        Parameters
        ----------
        first, second : int
            Indices of the surfaces.
        bound : float
            Of their distance, mm.
        reach : float
            Distances larger than the bound by more than this are left out, mm.
        """
        ...

    def apart(self, number: int, bound: float) -> Floats:
        """Distances (...) in mm of the samples of a surface from all others; larger ones than `bound` may be infinite.

        Parameters
        ----------
        number : int
        bound : float
            mm.
        """
        ...

    def folded(self, number: int, bound: float) -> Floats:
        """The same from their own surface, outside the neighbourhood of the limit on folds.

        Parameters
        ----------
        number : int
        bound : float
            mm.
        """
        ...

    def pooled(self, number: int, values: Floats) -> Floats:
        """Values at samples (...) of a surface as they are drawn: the largest around each point that is drawn."""
        ...


def by_surface(at: SampledBody, places: Points) -> Iterator[Placed]:
    """Places of a certificate, surface by surface."""
    for number in np.unique(places.surface):
        yield at.placed(int(number), places.at[places.surface == number])


@numba.njit(cache=True, nogil=True)
def rounded(value):
    """A value to `DIGITS` decimals: rounding errors must not decide between equivalent samples of symmetric bodies."""
    return np.rint(value * _UNITS) / _UNITS


def worst_of_cells(c: Floats, cell: Ints) -> Ints:
    """Indices of the largest value of each cell; the first of equal ones."""
    order = np.lexsort((-np.round(c, DIGITS), cell))
    return order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
