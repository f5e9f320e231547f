"""The limit on folds: the smallest distance within a surface, of points that are no neighbours (the paper's (23))."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.limit import Limit
from pneumorph.limits.tube.certify.tally import SpannedBody, Tally, certify_pairs
from pneumorph.limits.tube.measures.distances import nearest_fold
from pneumorph.limits.tube.rows.pairs import (
    LEAST_SHARE,
    Place,
    asking_samples,
    cell_of_samples,
    rows_at_pairs,
    rows_between,
)
from pneumorph.limits.tube.rows.samples import Near, RowBlock, SampledBody, worst_of_cells

if TYPE_CHECKING:
    from jax import Array

    from pneumorph.limits.tube.rows.smooth import SmoothBody

Floats = NDArray[np.float64]

# Far from its limit a fold's nearest points are mostly on the edge of the neighbourhood, where accuracy has no use.
FOLD = Limit("fold", "fold", "mm", True, 0.002, "fold_mm", lambda limits: limits.fold.distance, "fold", far=0.8)


@dataclass(frozen=True)
class Folds:
    """The distances within every surface, without end discs and outside the neighbourhood."""

    limits: tuple[Limit, ...] = (FOLD,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        for number in range(len(at.tubes)):
            yield _rows(at, number, near.reach)

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Pairs)
        yield from rows_at_pairs(at, places, FOLD.bound(at.samples.spec))

    def certify(self, body: SpannedBody, tallies: Mapping[str, Tally]) -> None:
        tubes, neighbourhood = body.tubes, body.spec.fold.neighbourhood
        certify_pairs(tallies, FOLD, {(a, a): (tubes[a], tubes[a], neighbourhood) for a in body.own})

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, Floats]]:
        tube, spec = at.tubes[number], at.samples.spec.fold
        # Walls farther apart than the neighbourhood are not folds.
        bound = min(spec.distance / LEAST_SHARE, spec.neighbourhood)
        fold = nearest_fold(tube, spec.neighbourhood, bound, np.arange(len(tube.x)))
        distance, facing = fold.distance.copy(), np.flatnonzero(fold.facing)
        distance[facing] = tube.closest(tube.x[facing], fold.near[facing])[0]
        yield FOLD.name, FOLD.used(distance.reshape(tube.grid.shape), spec.distance)

    def smooth(self, at: SmoothBody) -> dict[str, Array]:
        return {FOLD.name: at.apart(at.samples.fold_source, at.partners.fold, FOLD.bound(at.samples.spec))}


def _rows(at: SampledBody, number: int, reach: float) -> RowBlock:
    """The rows of the distances within one surface."""
    tube, spec = at.tubes[number], at.samples.spec.fold
    # Walls farther apart than the neighbourhood are not folds.
    bound = min(spec.distance + reach, spec.neighbourhood)
    source = asking_samples(at.samples, number, tube)
    fold = nearest_fold(tube, spec.neighbourhood, bound, source)
    found = np.flatnonzero(np.isfinite(fold.distance))
    some, near, offset, facing = source[found], fold.near[found], fold.offset[found].copy(), fold.facing[found]
    _, _, offset[facing] = tube.closest(tube.x[some[facing]], near[facing])
    cell = cell_of_samples(at.samples, number, tube, some)
    pick = worst_of_cells(-fold.distance[found], cell)
    one = Place(number, tube, some[pick], np.zeros((len(pick), 2)))
    other = Place(number, tube, near[pick], offset[pick])
    return rows_between(at, one, other, cell[pick], spec.distance)
