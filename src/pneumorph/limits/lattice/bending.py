"""The limit on the bending of the map of a lattice: on its second derivatives, by which faces become curved.

The value is √(Σ |∂²φ/∂x_k∂x_m|²) over all k and m. A plane face gets a curvature of no more than that over the square
of the least scaling.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.lattice.pieces import Displaced, Pieces
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.lattice.enclosed import EnclosedLattices
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import CLOSE, Near, RowBlock

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

BENDING = Limit("bending", "bending of the map", "/mm", False, 0.01, "bending", lambda limits: limits.bending, far=0.3)

_ORDERS = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))
_TIMES = np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0])
"""How often each of these second derivatives is among all."""


@dataclass(frozen=True)
class Bendings:
    """The second derivatives of the map at every point of all surfaces."""

    limits: tuple[Limit, ...] = (BENDING,)

    def rows(self, at: SampledLattices, near: Near) -> Iterator[RowBlock]:
        if self._is_asked(at.spec):
            bound = BENDING.bound(at.spec)
            for number, surface in enumerate(at.body.surfaces):
                values = bendings(at.surfaces[number], surface.outline)[surface.patches]
                found = at.worst(number, values / bound - 1.0, near.least).at
                if near.places is not None:
                    given = near.places[BENDING.name]
                    found = np.concatenate([given.at[given.surface == number], found])
                some = np.sort(np.unique(np.round(found, 6), axis=0, return_index=True)[1])
                yield self._rows(at, number, found[some], bound)

    def rows_at(self, at: SampledLattices, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        # They are among `Near.places`.
        yield from ()

    def certify(self, body: EnclosedLattices, tallies: Mapping[str, Tally]) -> None:
        if self._is_asked(body.spec):
            tally = tallies[BENDING.name]
            for number in body.own:

                def bounds(pieces: Pieces, surface: Displaced = body.surfaces[number]) -> tuple[Floats, Floats]:
                    attained = bendings(surface, pieces.place.reshape(-1, 3)).reshape(-1, 3)
                    above = np.linalg.norm(pieces.bends, axis=(1, 2))
                    return np.maximum(above, attained.max(axis=1)), attained

                tally.points(number, body.bounded(number, bounds, tally.accuracy, tally.worst))

    def shares(self, at: SampledLattices, number: int) -> Iterator[tuple[str, Floats]]:
        if self._is_asked(at.spec):
            surface = at.body.surfaces[number]
            values = bendings(at.surfaces[number], surface.outline)[surface.patches]
            yield BENDING.name, BENDING.used(values, BENDING.bound(at.spec))

    def smooth(self, at: Any) -> dict[str, Any]:
        return {}

    @staticmethod
    def _is_asked(spec: Limits) -> bool:
        return BENDING.read(spec) is not None

    @staticmethod
    def _rows(at: SampledLattices, number: int, points: Floats, bound: float) -> RowBlock:
        """Rows of points (m, 3) of a surface."""
        places, lattice = at.places(number, points), at.body.surfaces[number].lattice
        second = at.surfaces[number].seconds(places) * _TIMES
        values = bendings(at.surfaces[number], places)
        sums = [lattice.sums(places, order) for order in _ORDERS]
        numbers = at.body.slices[number].start + sums[0][0]
        # Where nothing is bent the value has no derivative, and needs none.
        slope = second / (bound * np.maximum(values, 1e-12))[:, None, None]
        entry = np.einsum("ncj,jnk->nkc", slope, np.array([weights for _, weights in sums]))
        value = values / bound - 1.0
        some = np.flatnonzero(value > CLOSE)
        close = {BENDING.name: Points(np.full(len(some), number), points[some], values[some], values[some])}
        shape = len(points), 3 * numbers.shape[1]
        column = 3 * numbers[:, :, None] + np.arange(3)
        kind = np.zeros(len(points), dtype=np.int64)
        cell = at.placed(number, points).cell
        return RowBlock(kind, cell, value, column.reshape(shape), entry.reshape(shape), close)


def bendings(surface: Displaced, places: Floats) -> Floats:
    """The value (n,) at places (n, 3) in the file, 1/mm."""
    return np.sqrt(np.einsum("ncj,ncj,j->n", *2 * (surface.seconds(places),), _TIMES))
