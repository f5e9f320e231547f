"""Linearised limits (rows) on distances: walls and folds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.local import point_weights
from pneumorph.limits.certify.report import Pairs
from pneumorph.limits.measures import expansion
from pneumorph.limits.measures.distances import SampledSurface, closest_within, nearest_fold, sampled_surface
from pneumorph.limits.measures.grid import sampled_fields
from pneumorph.limits.rows.heights import heights
from pneumorph.limits.rows.samples import (
    CLOSE,
    COARSE,
    DIGITS,
    KINDS,
    LimitSamples,
    RowBlock,
    cell_of,
    worst_of_cells,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def distances(limits: LimitSamples, body: Body, reach: float) -> Iterator[RowBlock]:
    """The rows of all limits on distances that are at most `reach` mm within their bounds."""
    fields = [sampled_fields(surface, samples) for surface, samples in zip(body.surfaces, limits.coarse, strict=True)]
    closed = [
        sampled_surface(field, samples, discs=samples.cavity)
        for field, samples in zip(fields, limits.coarse, strict=True)
    ]
    for a in range(len(closed)):
        for b in range(a + 1, len(closed)):
            yield _walls(limits, body, (a, closed[a]), (b, closed[b]), reach)
    for number, (field, samples) in enumerate(zip(fields, limits.coarse, strict=True)):
        yield _folds(limits, body, number, sampled_surface(field, samples, discs=False), reach)
        yield from heights(limits, body, number, field, reach)


def _walls(
    limits: LimitSamples,
    body: Body,
    asking: tuple[int, SampledSurface],
    asked: tuple[int, SampledSurface],
    reach: float,
) -> RowBlock:
    """Distances from one surface to another, including the end discs of chambers."""
    (a, here), (b, there) = asking, asked
    bound = limits.spec.wall + reach
    source = _asking(limits, a, here)
    found, near, distance, offset = closest_within(here.x[source], there, bound)
    some = source[found]
    cell = _cell(limits, a, here, some)
    pick = worst_of_cells(-distance, cell)
    some, near, offset, cell = some[pick], near[pick], offset[pick], cell[pick]
    aside = np.zeros((len(pick), 2))
    close = np.flatnonzero(distance[pick] < (1.0 - CLOSE) * limits.spec.wall)
    aside[close], offset[close] = _closest_nearby(here, some[close], there, near[close], offset[close])
    one, other = _Place(a, here, some, aside), _Place(b, there, near, offset)
    outward = there.normals()[near]
    # At the sharp rim of a disc the normal of the tube alone may point to what lies beyond the disc.
    outward[((here.x[some] < there.x.min(axis=0)) | (here.x[some] > there.x.max(axis=0))).any(axis=1)] = 0.0
    return _between(limits, body, "wall", one, other, cell, limits.spec.wall, outward)


def _closest_nearby(
    here: SampledSurface, some: Ints, there: SampledSurface, near: Ints, offset: Floats
) -> tuple[Floats, Floats]:
    """Offsets (m, 2) from samples, on both surfaces, of the closest pair near each sample and its closest point."""
    aside, closest = np.zeros((len(some), 2)), offset.copy()
    one, other = ((tuple(side.fields), side.columns, side.steps) for side in (here, there))
    expansion.closest_around(some, near, one, other, np.array(NEARBY), DIGITS, aside, closest)
    return aside, closest


def _folds(limits: LimitSamples, body: Body, number: int, tube: SampledSurface, reach: float) -> RowBlock:
    """Distances within one surface, outside the neighbourhood."""
    spec = limits.spec.fold
    # Walls farther apart than the neighbourhood are not folds.
    bound = min(spec.distance + reach, spec.neighbourhood)
    source = _asking(limits, number, tube)
    fold = nearest_fold(tube, spec.neighbourhood, bound, source)
    found = np.flatnonzero(np.isfinite(fold.distance))
    some, near, offset, facing = source[found], fold.near[found], fold.offset[found].copy(), fold.facing[found]
    _, _, offset[facing] = tube.closest(tube.x[some[facing]], near[facing])
    cell = _cell(limits, number, tube, some)
    pick = worst_of_cells(-fold.distance[found], cell)
    one = _Place(number, tube, some[pick], np.zeros((len(pick), 2)))
    other = _Place(number, tube, near[pick], offset[pick])
    return _between(limits, body, "fold", one, other, cell[pick], spec.distance)


NEARBY = (-0.5, -0.25, 0.0, 0.25, 0.5)
"""Points between samples, in units of the sample distance, that are tried around samples close to their bounds."""


class _Place(NamedTuple):
    """Points on the surface with index `number`: samples (m,), and offsets (m, 2) in mm of both parameters."""

    number: int
    surface: SampledSurface
    sample: Ints
    offset: Floats


def _between(
    limits: LimitSamples,
    body: Body,
    kind: str,
    one: _Place,
    other: _Place,
    cell: Ints,
    bound: float,
    outward: Floats | None = None,
) -> RowBlock:
    """Rows of the distances between two sets of points, which are held at fixed parameters.

    The error is of second order, because at closest points the derivatives with respect to the parameters vanish. If
    the normals (m, 3) of the other surface are given, the distance of points that have passed through it is negative.
    """
    ends = _combination(body, one), _combination(body, other)
    return _separation(kind, body.control_points(), *ends, limits.first[one.number] + cell, bound, outward)


def _separation(
    kind: str,
    points: Floats,
    one: tuple[Ints, Floats],
    other: tuple[Ints, Floats],
    cell: Ints,
    bound: float,
    outward: Floats | None = None,
) -> RowBlock:
    """Rows of the distances between two sets of points, given as control points and their weights."""
    ways = np.zeros((len(cell), 3)) if outward is None else outward
    shape = len(cell), 3 * (one[0].shape[1] + other[0].shape[1])
    value, column, entry = np.empty(len(cell)), np.empty(shape, dtype=np.int64), np.empty(shape)
    _separate(points, *one, *other, ways, bound, value, column, entry)
    return RowBlock(np.full(len(cell), KINDS.index(kind)), cell, value, column, entry)


@numba.njit(cache=True, nogil=True)
def _separate(points, column_a, weight_a, column_b, weight_b, outward, bound, value, column, entry):
    """Fill the values (m,), columns and entries (m, k) of `_separation`; without normals `outward` is zero."""
    gap, wide = np.empty(3), column_a.shape[1]
    for m in range(len(value)):
        gap[:] = 0.0
        for k in range(wide):
            for c in range(3):
                gap[c] += weight_a[m, k] * points[column_a[m, k], c]
        for k in range(column_b.shape[1]):
            for c in range(3):
                gap[c] -= weight_b[m, k] * points[column_b[m, k], c]
        distance = np.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2)
        way = 1.0 / max(distance, 1e-9)
        if way * (gap[0] * outward[m, 0] + gap[1] * outward[m, 1] + gap[2] * outward[m, 2]) > 0.7:
            way, distance = -way, -distance
        value[m] = 1.0 - distance / bound
        for k in range(wide):
            for c in range(3):
                column[m, 3 * k + c] = 3 * column_a[m, k] + c
                entry[m, 3 * k + c] = -weight_a[m, k] / bound * way * gap[c]
        for k in range(column_b.shape[1]):
            for c in range(3):
                column[m, 3 * (wide + k) + c] = 3 * column_b[m, k] + c
                entry[m, 3 * (wide + k) + c] = weight_b[m, k] / bound * way * gap[c]


def _combination(body: Body, place: _Place) -> tuple[Ints, Floats]:
    """Indices (m, k) of control points of the body, and their weights, for points on a tube or its end discs."""
    surface, samples, rings = body.surfaces[place.number], place.surface.grid, place.surface.rings
    row, column = np.divmod(place.sample, place.surface.columns)
    around = samples.q[column] + place.offset[:, 0] / surface.size[0]
    along = samples.r[np.clip(row - rings, 0, len(samples.r) - 1)] + place.offset[:, 1] / surface.size[1]
    if not rings:
        return _weights(body, place.number, around, along)
    base, tip = row < rings, row >= rings + len(samples.r)
    nearest_ring = np.where(tip, len(samples.r) + 2 * rings - 1 - row, row)
    outward = np.where(tip, -1.0, 1.0) * place.offset[:, 1] * 2.0 * np.pi / surface.size[0]
    s = np.where(base | tip, samples.rings[np.minimum(nearest_ring, rings - 1)] + outward, 1.0)
    return _weights(body, place.number, around, np.where(base, 0.0, np.where(tip, 1.0, along)), s)


def _weights(body: Body, number: int, q: Floats, r: Floats, s: Floats | None = None) -> tuple[Ints, Floats]:
    """The same for points (q, r); with s for (1 - s)·centre + s·point, where the centre is the mean of the end row."""
    surface, first = body.surfaces[number], body.slices[number].start
    numbers, weights = point_weights(surface, q, r)
    if s is None:
        return first + numbers, weights
    rows, columns = surface.net.shape[:2]
    end_row = np.where(r > 0.5, rows - 1, 0)[:, None] * columns + np.arange(columns)
    centre = np.repeat((1.0 - s)[:, None] / columns, columns, axis=1)
    return first + np.concatenate([numbers, end_row], axis=1), np.concatenate([s[:, None] * weights, centre], axis=1)


def gaps_at(limits: LimitSamples, body: Body, name: str, found: Pairs) -> Iterator[RowBlock]:
    """Rows of the distances between pairs of points that a certificate has found too close."""
    bound = limits.spec.wall if name == "wall" else limits.spec.fold.distance
    points = body.control_points()
    for a, b in sorted(set(zip(found.surface_a.tolist(), found.surface_b.tolist(), strict=True))):
        some = (found.surface_a == a) & (found.surface_b == b)
        one, other = found.a[some], found.b[some]
        cell = limits.first[a] + cell_of(limits, a, one[:, 0], one[:, 1])
        yield _separation(name, points, _weights(body, a, *one.T), _weights(body, b, *other.T), cell, bound)


def _asking(limits: LimitSamples, number: int, surface: SampledSurface) -> Ints:
    """The samples of a surface from which distances are measured; those on an end disc go with the ones at its rim."""
    own = limits.own_coarse[number]
    rings = (surface.rings, surface.rings)
    return np.flatnonzero(np.pad(own, (rings, (0, 0)), mode="edge"))


def _cell(limits: LimitSamples, number: int, surface: SampledSurface, sample: Ints) -> Ints:
    """Knot-span cells of samples; samples on an end disc belong to the cells at its rim."""
    row, column = np.divmod(sample, surface.columns)
    row = np.clip(row - surface.rings, 0, len(surface.grid.r) - 1)
    around, along = limits.spans[number]
    return np.minimum(row // COARSE[1], along - 1) * around + column // COARSE[0]
