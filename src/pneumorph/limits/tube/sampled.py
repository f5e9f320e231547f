"""A body of tubes at the samples of its surfaces, as linearised limits ask about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Region
from pneumorph.limits.rows.sampled import CLOSE, DIGITS, Couples, Placed, Sums, worst_of_cells
from pneumorph.limits.tube.measures import expansion
from pneumorph.limits.tube.measures.distances import (
    SampledSurface,
    apart,
    closest_on_edge,
    closest_within,
    nearest_fold,
    sampled_surface,
)
from pneumorph.limits.tube.measures.expansion import NEARBY
from pneumorph.limits.tube.measures.grid import SampledFields, sampled_fields
from pneumorph.limits.tube.peaks import beside
from pneumorph.limits.tube.points import on_tube, point_sums, sums_at
from pneumorph.limits.tube.samples import COARSE, FINE, LimitSamples, cell_of, worst_samples

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

PER_SPAN = (2, 2)
"""Points per knot span in q and r at which shares of limits are drawn; each has the largest share around it."""


OVER = 1.5
"""Distances within a surface that are measured between samples, over their bound: in sharp folds those at samples are
up to a third too large."""


class _Aside(NamedTuple):
    """Points on the surface with index `number`: samples (m,), and offsets (m, 2) in mm of both parameters."""

    number: int
    surface: SampledSurface
    sample: Ints
    offset: Floats


@dataclass(frozen=True, eq=False)
class SampledTubes:
    """A `SampledBody` at coarse samples, which are arranged in rows and columns; cells are knot spans."""

    samples: LimitSamples
    body: Body

    @property
    def spec(self) -> Limits:
        return self.samples.spec

    @property
    def between(self) -> Region:
        return self.samples.between

    @cached_property
    def fields(self) -> list[SampledFields]:
        """Position and derivatives on the tube of each surface."""
        return [sampled_fields(*each) for each in zip(self.body.surfaces, self.samples.coarse, strict=True)]

    @cached_property
    def tubes(self) -> list[SampledSurface]:
        """Each surface without its end discs."""
        return [sampled_surface(*each, discs=False) for each in zip(self.fields, self.samples.coarse, strict=True)]

    @cached_property
    def closed(self) -> list[SampledSurface]:
        """Each surface, chambers with their end discs."""
        pairs = zip(self.fields, self.samples.coarse, strict=True)
        return [sampled_surface(field, samples, discs=samples.cavity) for field, samples in pairs]

    def positions(self, number: int) -> Floats:
        return np.moveaxis(self.fields[number].x, 0, -1)

    def in_end_planes(self, number: int) -> NDArray[np.bool_]:
        inside = np.zeros(self.samples.coarse[number].shape, dtype=bool)
        inside[[0, -1]] = not self.samples.coarse[number].cavity
        return inside

    def worst(self, number: int, c: Floats, least: float) -> Placed:
        grid, samples = self.samples.coarse[number], self.samples
        row, column, cell = worst_samples(c, samples.own_coarse[number], COARSE, samples.spans[number], least)
        return Placed(number, samples.first[number] + cell, on_tube(*beside(grid, c, row, column)))

    def placed(self, number: int, at: Floats) -> Placed:
        return Placed(number, self.samples.first[number] + cell_of(self.samples, number, at[:, 0], at[:, 1]), at)

    def sums(self, points: Placed) -> Sums:
        return sums_at(self.body, points.number, points.at)

    def couples(self, first: int, second: int, bound: float, reach: float) -> Couples:
        """See `SampledBody.couples`.

        Parameters
        ----------
        first, second, bound, reach
            As for `SampledBody.couples`.
        """
        return self._folds(first, bound + reach) if first == second else self._walls(first, second, bound, reach)

    def apart(self, number: int, bound: float) -> Floats:
        tube = self.tubes[number]
        distance = np.full(len(tube.x), np.inf)
        for other, surface in enumerate(self.closed):
            if other != number:
                some, _, away, _ = closest_within(tube.x, surface, bound)
                distance[some] = np.minimum(distance[some], away)
        return distance.reshape(tube.grid.shape)

    def folded(self, number: int, bound: float) -> Floats:
        tube, neighbourhood = self.tubes[number], self.spec.fold.neighbourhood
        # Walls farther apart than the neighbourhood are not folds.
        fold = nearest_fold(tube, neighbourhood, min(bound, neighbourhood), np.arange(len(tube.x)))
        distance, facing = fold.distance.copy(), np.flatnonzero(fold.facing)
        distance[facing] = tube.closest(tube.x[facing], fold.near[facing])[0]
        return distance.reshape(tube.grid.shape)

    def pooled(self, number: int, values: Floats) -> Floats:
        per_span = FINE if values.shape == self.samples.fine[number].shape else COARSE
        across, along = (fine // coarse for fine, coarse in zip(per_span, PER_SPAN, strict=True))
        rows = maximum_filter1d(values, 2 * (along // 2) + 1, axis=0, mode="nearest")[::along]
        return maximum_filter1d(rows, 2 * (across // 2) + 1, axis=1, mode="wrap")[:, ::across]

    def _walls(self, a: int, b: int, bound: float, reach: float) -> Couples:
        """The distances from the samples of one surface to another."""
        here, there = self.closed[a], self.closed[b]
        source = _asking(self.samples, a, here)
        within, near, distance, offset = closest_within(here.x[source], there, bound + reach)
        some = source[within]
        cell = _cell_of_samples(self.samples, a, here, some)
        pick = worst_of_cells(-distance, cell)
        some, near, offset, cell = some[pick], near[pick], offset[pick], cell[pick]
        aside = np.zeros((len(pick), 2))
        close = np.flatnonzero(distance[pick] < (1.0 - CLOSE) * bound)
        aside[close], offset[close] = _closest_nearby(here, some[close], there, near[close], offset[close])
        outward = there.normals()[near]
        # At the sharp rim of a disc the normal of the tube alone may point to what lies beyond the disc.
        outward[((here.x[some] < there.x.min(axis=0)) | (here.x[some] > there.x.max(axis=0))).any(axis=1)] = 0.0
        return self._couples(_Aside(a, here, some, aside), _Aside(b, there, near, offset), cell, outward)

    def _folds(self, number: int, bound: float) -> Couples:
        """The distances within one surface."""
        tube, neighbourhood = self.tubes[number], self.spec.fold.neighbourhood
        source = _asking(self.samples, number, tube)
        # Walls farther apart than the neighbourhood are not folds.
        fold = nearest_fold(tube, neighbourhood, min(bound, neighbourhood), source)
        folds = np.flatnonzero(np.isfinite(fold.distance))
        some, near, offset, facing = (
            source[folds],
            fold.near[folds],
            fold.offset[folds].copy(),
            fold.facing[folds],
        )
        _, _, offset[facing] = tube.closest(tube.x[some[facing]], near[facing])
        cell = _cell_of_samples(self.samples, number, tube, some)
        pick = worst_of_cells(-fold.distance[folds], cell)
        some, near, offset, facing = some[pick], near[pick], offset[pick], facing[pick]
        aside, close = np.zeros((len(pick), 2)), fold.distance[folds][pick] < OVER * self.spec.fold.distance
        edge, wall = np.flatnonzero(close & ~facing), np.flatnonzero(close & facing)
        near[edge], offset[edge], aside[edge] = closest_on_edge(
            tube, neighbourhood, some[edge], near[edge], offset[edge]
        )
        moved, closest = _closest_nearby(tube, some[wall], tube, near[wall], offset[wall])
        # What would come into the neighbourhood stays.
        counts = apart(tube.grid, some[wall], near[wall], moved - closest) >= neighbourhood
        aside[wall[counts]], offset[wall[counts]] = moved[counts], closest[counts]
        return self._couples(_Aside(number, tube, some, aside), _Aside(number, tube, near, offset), cell[pick])

    def _couples(self, one: _Aside, other: _Aside, cell: Ints, outward: Floats | None = None) -> Couples:
        ends = _sums_aside(self.body, one), _sums_aside(self.body, other)
        return Couples(self.samples.first[one.number] + cell, *ends, outward)


def _asking(limits: LimitSamples, number: int, surface: SampledSurface) -> Ints:
    """The samples of a surface from which distances are measured; those on an end disc go with the ones at its rim."""
    own = limits.own_coarse[number]
    return np.flatnonzero(np.pad(own, (surface.rings, (0, 0)), mode="edge"))


def _cell_of_samples(limits: LimitSamples, number: int, surface: SampledSurface, sample: Ints) -> Ints:
    """Knot-span cells of samples (m,) of a surface, which may be on its end discs: these belong to those at the rim."""
    row, column = np.divmod(sample, surface.columns)
    row = np.clip(row - surface.rings[0], 0, len(surface.grid.r) - 1)
    around, along = limits.spans[number]
    return np.minimum(row // COARSE[1], along - 1) * around + column // COARSE[0]


def _sums_aside(body: Body, place: _Aside) -> Sums:
    surface, samples, (before, after) = body.surfaces[place.number], place.surface.grid, place.surface.rings
    row, column = np.divmod(place.sample, place.surface.columns)
    around = samples.q[column] + place.offset[:, 0] / surface.size[0]
    along = samples.r[np.clip(row - before, 0, len(samples.r) - 1)] + place.offset[:, 1] / surface.size[1]
    if not before + after:
        return point_sums(body, place.number, around, along)
    base, tip = row < before, row >= before + len(samples.r)
    nearest_ring = np.where(tip, before + len(samples.r) + after - 1 - row, row)
    outward = np.where(tip, -1.0, 1.0) * place.offset[:, 1] * 2.0 * np.pi / surface.size[0]
    s = np.where(base | tip, samples.rings[np.minimum(nearest_ring, len(samples.rings) - 1)] + outward, 1.0)
    return point_sums(body, place.number, around, np.where(base, 0.0, np.where(tip, 1.0, along)), s)


def _closest_nearby(
    here: SampledSurface, some: Ints, there: SampledSurface, near: Ints, offset: Floats
) -> tuple[Floats, Floats]:
    """Offsets (m, 2) from samples, on both surfaces, of the closest pair near each sample and its closest point."""
    aside, closest = np.zeros((len(some), 2)), offset.copy()
    one, other = ((tuple(side.fields), side.columns, side.steps) for side in (here, there))
    expansion.closest_around(some, near, one, other, NEARBY, DIGITS, aside, closest)
    return aside, closest
