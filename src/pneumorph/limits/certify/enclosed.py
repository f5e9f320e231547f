"""What a body is asked for to certify its limits: enclosures of its surfaces, cell by cell.

A cell is a part of a surface, such as the knot spans of a spline or the triangles of a face. Larger is worse for all
values here; distances therefore have their sign changed, but for those of `Gaps`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Region

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


@dataclass(frozen=True)
class Accuracy:
    """The accuracy to which a quantity is bounded.

    Attributes
    ----------
    bound : float
        Bound of the limit.
    needed : float
        The bound, with what rounding may do where that is zero; it is decided for every point whether this is exceeded.
    gap : float
        Allowed difference of certified and attained values near the limit.
    decided : float
        The same where attained values are within it, or beyond by no more than this.
    relative_gap : float
        The same far from the limit, relative to the distance from it.
    scale : float
        Where the bound is zero: gaps beyond it are no larger than `gap` up to here, and relative from here on. 0 if
        there they may have any size.
    """

    bound: float
    needed: float
    gap: float
    decided: float
    relative_gap: float
    scale: float = 0.0

    def enough(self, attained: float, elsewhere: float) -> float:
        """Upper bound that needs no refinement, given the worst values attained on this surface and elsewhere."""
        here = attained + max(self.gap, self.relative_gap * (self.bound - attained))
        return min(max(elsewhere, here), self.needed)

    def close(self, attained: Floats) -> Floats:
        """The same for single cells with the worst `attained` values (n,)."""
        near = attained + self.gap * np.clip(np.abs(attained) / max(abs(self.bound), self.scale, 1e-9), 1.0, 1e12)
        decided = np.minimum(near, np.maximum(self.needed, attained + self.decided))
        return np.where(attained > self.needed + self.decided, near, decided)


class CellBounds(NamedTuple):
    """Bounds of one quantity on n cells.

    Attributes
    ----------
    upper, attained : (n,) arrays
        Certified and attained values.
    at : (n, 3) array
        Where the latter are, see `places.Points`.
    """

    upper: Floats
    attained: Floats
    at: Floats


class Gaps(NamedTuple):
    """Distances of n pairs of pieces, between two surfaces or within one.

    Attributes
    ----------
    lower, attained : (n,) arrays
        Certified lower bound, and the distance of an actual pair of points, mm.
    piece : (n, 2) array
        Indices of the pieces.
    a, b : (n, 3) arrays
        These points, see `places.Points`.
    """

    lower: Floats
    attained: Floats
    piece: Ints
    a: Floats
    b: Floats


class EnclosedBody(Protocol):
    """A body that encloses the positions of its surfaces."""

    @property
    def body(self) -> Body: ...

    @property
    def spec(self) -> Limits: ...

    @property
    def between(self) -> Region:
        """What is between the planes of the body's ends."""
        ...

    @property
    def own(self) -> Sequence[int]:
        """The surfaces of which some cell is to be bounded: in a symmetric body the others are images of these."""
        ...

    def position(self, number: int, at: Floats) -> Floats:
        """Positions (n, 3) in mm of points of the surface with index `number`, see `places.Points`."""
        ...

    def farthest(self, number: int, value: Callable[[Floats], Floats], accuracy: Accuracy, worst: float) -> CellBounds:
        """Bounds of a convex function of places (..., 3) on a surface.

        Parameters
        ----------
        number : int
            Index of the surface.
        value : function
            Returns the values (...).
        accuracy : Accuracy
        worst : float
            Worst value attained elsewhere.
        """
        ...

    def faceted(
        self,
        number: int,
        bounds: Callable[[Floats, Floats], tuple[Floats, Floats]],
        accuracy: Accuracy,
        worst: float,
    ) -> CellBounds:
        """Bounds of any function of places on a surface that grows no faster than these move.

        Parameters
        ----------
        number : int
            Index of the surface.
        bounds : function
            Of flat triangles (n, 3, 3) and distances (n,) in mm up to which pieces of the surface are beside them, it
            returns upper bounds (n,) on the pieces, and the values (n, 3) at their corners.
        accuracy : Accuracy
        worst : float
            Worst value attained elsewhere.
        """
        ...

    def near(self, first: int, second: int) -> Gaps:
        """Near points of two surfaces, without lower bounds.

        Those of a surface with itself are outside the neighbourhood of the limit on folds, without end discs.
        """
        ...

    def gaps(self, first: int, second: int, accuracy: Accuracy, known: Gaps, worst: float) -> tuple[Gaps, float]:
        """Bound the distances between all such points.

        Parameters
        ----------
        first, second : int
            Indices of the surfaces.
        accuracy : Accuracy
            For distances with their sign changed.
        known : Gaps
            Their near points.
        worst : float
            Smallest distance attained elsewhere, mm.

        Returns
        -------
        Gaps
            Pairs of pieces that are near each other, after those that were known.
        beyond : float
            Certified lower bound of the distance of all other pairs, mm.
        """
        ...
