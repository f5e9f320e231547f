"""Limits on the scaling of the map of a lattice: by how much lengths at a surface change, in any direction.

Its least value above zero keeps the determinant of the map's gradient from changing its sign, so that nothing folds
over: the map is the identity where the body is clamped.
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
from pneumorph.limits.lattice.sampled import SampledLattices, extremes, scalings
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import CLOSE, Near, RowBlock

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

LEAST = Limit(
    "least scaling", "least scaling", "", True, 0.01, "scaling_least", lambda limits: _bounds(limits)[0], far=0.3
)
LARGEST = Limit(
    "largest scaling", "largest scaling", "", False, 0.01, "scaling_largest", lambda limits: _bounds(limits)[1], far=0.3
)


def _bounds(limits: Limits) -> tuple[float, float] | tuple[None, None]:
    return (limits.scaling.least, limits.scaling.largest) if limits.scaling else (None, None)


@dataclass(frozen=True)
class Scalings:
    """The least and the largest singular value of the map's gradient at every point of all surfaces."""

    limits: tuple[Limit, ...] = (LEAST, LARGEST)

    def rows(self, at: SampledLattices, near: Near) -> Iterator[RowBlock]:
        for number, surface in enumerate(at.body.surfaces):
            values = at.scalings[number][surface.patches]
            kinds, points = [], []
            for kind, limit in enumerate(self.limits):
                c = limit.sign * (values[..., kind] / limit.bound(at.spec) - 1.0)
                worst = at.worst(number, c, near.least).at
                if near.places is not None:
                    given = near.places[limit.name]
                    worst = np.concatenate([given.at[given.surface == number], worst])
                worst = worst[np.sort(np.unique(np.round(worst, 6), axis=0, return_index=True)[1])]
                kinds.append(np.full(len(worst), kind))
                points.append(worst)
            yield self._rows(at, number, np.concatenate(kinds), np.concatenate(points))

    def rows_at(self, at: SampledLattices, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        # They are among `Near.places`.
        yield from ()

    def certify(self, body: EnclosedLattices, tallies: Mapping[str, Tally]) -> None:
        for number in body.own:
            for kind, limit in enumerate(self.limits):
                tally, surface = tallies[limit.name], body.surfaces[number]

                def bounds(pieces: Pieces, kind=kind, sign=limit.sign, surface=surface) -> tuple[Floats, Floats]:
                    return _enclosed(surface, pieces, kind, sign)

                tally.points(number, body.bounded(number, bounds, tally.accuracy, tally.worst))

    def shares(self, at: SampledLattices, number: int) -> Iterator[tuple[str, Floats]]:
        surface = at.body.surfaces[number]
        values = at.scalings[number][surface.patches]
        for kind, limit in enumerate(self.limits):
            yield limit.name, limit.used(values[..., kind], limit.bound(at.spec))

    def smooth(self, at: Any) -> dict[str, Any]:
        return {}

    def _rows(self, at: SampledLattices, number: int, kind: Ints, points: Floats) -> RowBlock:
        """Rows of points (m, 3) of a surface, each for one of the limits."""
        places, lattice = at.places(number, points), at.body.surfaces[number].lattice
        left, values, right = np.linalg.svd(at.surfaces[number].gradients(places))
        place = np.where(kind == 0, 2, 0)
        every = np.arange(len(kind))
        bound, sign = (
            np.array([getattr(limit, name)(at.spec) if name == "bound" else limit.sign for limit in self.limits])[kind]
            for name in ("bound", "sign")
        )
        # The derivative of a singular value by the gradient is u vᵀ.
        u, v = left[every, :, place], right[every, place]
        sums = [lattice.sums(places, order) for order in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        numbers = sums[0][0]
        along = sum((weights * v[:, axis, None] for axis, (_, weights) in enumerate(sums)), np.zeros(numbers.shape))
        numbers = at.body.slices[number].start + numbers
        entry = (sign / bound)[:, None, None] * along[:, :, None] * u[:, None, :]
        value = sign * (values[every, place] / bound - 1.0)
        close = {}
        for k, limit in enumerate(self.limits):
            some = np.flatnonzero((value > CLOSE) & (kind == k))
            own = values[some, place[some]]
            close[limit.name] = Points(np.full(len(some), number), points[some], own, own)
        shape = len(kind), 3 * numbers.shape[1]
        column = 3 * numbers[:, :, None] + np.arange(3)
        return RowBlock(kind, at.placed(number, points).cell, value, column.reshape(shape), entry.reshape(shape), close)


def _enclosed(surface: Displaced, pieces: Pieces, kind: int, sign: float) -> tuple[Floats, Floats]:
    """Upper bounds (n,) of a singular value with the sign of its limit, and its values (n, 3) at the corners.

    The gradient is G = Σ λ_i G_i between its values at the corners, but for what second derivatives of it allow. The
    largest singular value is a convex function of G. The least one is at least the least eigenvalue of the symmetric
    part of RᵀG, for any rotation R, which is a concave one; R is that of the mean.
    """
    corners = surface.gradients(pieces.place.reshape(-1, 3)).reshape(-1, 3, 3, 3)
    attained = sign * scalings(corners)[..., kind]
    worst = attained.max(axis=1)
    if kind == 0:
        left, _, right = np.linalg.svd(corners.mean(axis=1))
        straight = np.swapaxes(left @ right, 1, 2)[:, None] @ corners
        worst = sign * extremes((straight + np.swapaxes(straight, 2, 3)) / 2.0)[..., 0].min(axis=1)
    return worst + surface.twisted(pieces), attained
