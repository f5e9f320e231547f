"""The limit on walls: the smallest distance between two surfaces, with the end discs of chambers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.limit import Limit
from pneumorph.limits.tube.certify.tally import SpannedBody, Tally, certify_pairs
from pneumorph.limits.tube.measures import expansion
from pneumorph.limits.tube.measures.distances import SampledSurface, closest_within
from pneumorph.limits.tube.rows.pairs import (
    LEAST_SHARE,
    Place,
    asking_samples,
    cell_of_samples,
    rows_at_pairs,
    rows_between,
)
from pneumorph.limits.tube.rows.samples import CLOSE, DIGITS, Near, RowBlock, SampledBody, worst_of_cells

if TYPE_CHECKING:
    from jax import Array

    from pneumorph.limits.tube.rows.smooth import SmoothBody

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

WALL = Limit("wall", "wall", "mm", True, 0.002, "wall_mm", lambda limits: limits.wall, "wall")

NEARBY = (-0.5, -0.25, 0.0, 0.25, 0.5)
"""Points between samples, in units of the sample distance, that are tried around samples close to their bounds."""


@dataclass(frozen=True)
class Walls:
    """The distances between all pairs of surfaces."""

    limits: tuple[Limit, ...] = (WALL,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        for a, b in combinations(range(len(at.closed)), 2):
            yield _rows(at, a, b, near.reach)

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Pairs)
        yield from rows_at_pairs(at, places, WALL.bound(at.samples.spec))

    def certify(self, body: SpannedBody, tallies: Mapping[str, Tally]) -> None:
        own, sides = body.own, body.closed
        couples = [(a, b) for a, b in combinations(range(len(sides)), 2) if a in own or b in own]
        certify_pairs(tallies, WALL, {(a, b): (sides[a], sides[b], 0.0) for a, b in couples})

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, Floats]]:
        tube, bound = at.tubes[number], WALL.bound(at.samples.spec)
        distance = np.full(len(tube.x), np.inf)
        for other, surface in enumerate(at.closed):
            if other != number:
                some, _, away, _ = closest_within(tube.x, surface, bound / LEAST_SHARE)
                distance[some] = np.minimum(distance[some], away)
        yield WALL.name, WALL.used(distance.reshape(tube.grid.shape), bound)

    def smooth(self, at: SmoothBody) -> dict[str, Array]:
        return {WALL.name: at.apart(at.samples.wall_source, at.partners.wall, WALL.bound(at.samples.spec))}


def _rows(at: SampledBody, a: int, b: int, reach: float) -> RowBlock:
    """The rows of the distances from the samples of one surface to another."""
    here, there, bound = at.closed[a], at.closed[b], WALL.bound(at.samples.spec)
    source = asking_samples(at.samples, a, here)
    found, near, distance, offset = closest_within(here.x[source], there, bound + reach)
    some = source[found]
    cell = cell_of_samples(at.samples, a, here, some)
    pick = worst_of_cells(-distance, cell)
    some, near, offset, cell = some[pick], near[pick], offset[pick], cell[pick]
    aside = np.zeros((len(pick), 2))
    close = np.flatnonzero(distance[pick] < (1.0 - CLOSE) * bound)
    aside[close], offset[close] = _closest_nearby(here, some[close], there, near[close], offset[close])
    outward = there.normals()[near]
    # At the sharp rim of a disc the normal of the tube alone may point to what lies beyond the disc.
    outward[((here.x[some] < there.x.min(axis=0)) | (here.x[some] > there.x.max(axis=0))).any(axis=1)] = 0.0
    return rows_between(at, Place(a, here, some, aside), Place(b, there, near, offset), cell, bound, outward)


def _closest_nearby(
    here: SampledSurface, some: Ints, there: SampledSurface, near: Ints, offset: Floats
) -> tuple[Floats, Floats]:
    """Offsets (m, 2) from samples, on both surfaces, of the closest pair near each sample and its closest point."""
    aside, closest = np.zeros((len(some), 2)), offset.copy()
    one, other = ((tuple(side.fields), side.columns, side.steps) for side in (here, there))
    expansion.closest_around(some, near, one, other, np.array(NEARBY), DIGITS, aside, closest)
    return aside, closest
