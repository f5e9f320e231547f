"""The limit on folds: the smallest distance within a surface, of points that are no neighbours (the paper's (23))."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally, certify_pairs
from pneumorph.limits.kinds.kind import SmoothBody
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.distances import rows_at_pairs, rows_of_couples
from pneumorph.limits.rows.sampled import LEAST_SHARE, Near, RowBlock, SampledBody

# Far from its limit a fold's nearest points are mostly on the edge of the neighbourhood, where accuracy has no use.
FOLD = Limit("fold", "fold", "mm", True, 0.002, "fold_mm", lambda limits: limits.fold.distance, "fold", far=0.8)


@dataclass(frozen=True)
class Folds:
    """The distances within every surface, without end discs and outside the neighbourhood."""

    limits: tuple[Limit, ...] = (FOLD,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        bound = FOLD.bound(at.spec)
        for number in range(len(at.body.surfaces)):
            yield rows_of_couples(at, at.couples(number, number, bound, near.reach), bound)

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Pairs)
        yield from rows_at_pairs(at, places, FOLD.bound(at.spec))

    def certify(self, body: EnclosedBody, tallies: Mapping[str, Tally]) -> None:
        certify_pairs(body, [(number, number) for number in body.own], FOLD, tallies)

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, NDArray[np.float64]]]:
        bound = FOLD.bound(at.spec)
        yield FOLD.name, FOLD.used(at.folded(number, bound / LEAST_SHARE), bound)

    def smooth(self, at: SmoothBody) -> dict[str, Any]:
        return {FOLD.name: at.folds(FOLD.bound(at.spec))}
