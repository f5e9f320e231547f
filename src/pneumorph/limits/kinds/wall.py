"""The limit on walls: the smallest distance between two surfaces, with the end discs of chambers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
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

WALL = Limit("wall", "wall", "mm", True, 0.002, "wall_mm", lambda limits: limits.wall, "wall")


@dataclass(frozen=True)
class Walls:
    """The distances between all pairs of surfaces."""

    limits: tuple[Limit, ...] = (WALL,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        bound = WALL.bound(at.spec)
        for couple in combinations(range(len(at.body.surfaces)), 2):
            yield rows_of_couples(at, at.couples(*couple, bound, near.reach), bound)

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Pairs)
        yield from rows_at_pairs(at, places, WALL.bound(at.spec))

    def certify(self, body: EnclosedBody, tallies: Mapping[str, Tally]) -> None:
        couples = combinations(range(len(body.body.surfaces)), 2)
        certify_pairs(body, [(a, b) for a, b in couples if a in body.own or b in body.own], WALL, tallies)

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, NDArray[np.float64]]]:
        bound = WALL.bound(at.spec)
        yield WALL.name, WALL.used(at.apart(number, bound / LEAST_SHARE), bound)

    def smooth(self, at: SmoothBody) -> dict[str, Any]:
        return {WALL.name: at.walls(WALL.bound(at.spec))}
