"""Rows of limits on the distances between pairs of points, on two surfaces or on one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.local import point_weights
from pneumorph.limits.certify.places import Pairs
from pneumorph.limits.tube.measures.distances import SampledSurface
from pneumorph.limits.tube.rows.samples import COARSE, LimitSamples, RowBlock, SampledBody, cell_of

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


LEAST_SHARE = 0.5
"""Used shares of limits on distances are measured only above this: to find what is farther away takes longer."""


class Place(NamedTuple):
    """Points on the surface with index `number`: samples (m,), and offsets (m, 2) in mm of both parameters."""

    number: int
    surface: SampledSurface
    sample: Ints
    offset: Floats


def rows_between(
    at: SampledBody, one: Place, other: Place, cell: Ints, bound: float, outward: Floats | None = None
) -> RowBlock:
    """Rows of the distances between two sets of points, which are held at fixed parameters.

    The error is of second order, because at closest points the derivatives with respect to the parameters vanish.

    Parameters
    ----------
    at : SampledBody
    one, other : Place
        The points, m on either side.
    cell : (m,) int
        Knot-span cells of the first ones, on their surface.
    bound : float
        mm.
    outward : (m, 3) array, optional
        Normals of the other surface: the distance of points that have passed through it is then negative.
    """
    ends = _combination(at.body, one), _combination(at.body, other)
    return _separation(at.body.control_points(), *ends, at.samples.first[one.number] + cell, bound, outward)


def rows_at_pairs(at: SampledBody, found: Pairs, bound: float) -> Iterator[RowBlock]:
    """Rows of the distances between pairs of points that a certificate has found closer than a bound in mm."""
    body, points = at.body, at.body.control_points()
    for a, b in sorted(set(zip(found.surface_a.tolist(), found.surface_b.tolist(), strict=True))):
        some = (found.surface_a == a) & (found.surface_b == b)
        one, other = found.a[some], found.b[some]
        cell = at.samples.first[a] + cell_of(at.samples, a, one[:, 0], one[:, 1])
        yield _separation(points, _weights(body, a, *one.T), _weights(body, b, *other.T), cell, bound)


def asking_samples(limits: LimitSamples, number: int, surface: SampledSurface) -> Ints:
    """The samples of a surface from which distances are measured; those on an end disc go with the ones at its rim."""
    own = limits.own_coarse[number]
    rings = (surface.rings, surface.rings)
    return np.flatnonzero(np.pad(own, (rings, (0, 0)), mode="edge"))


def cell_of_samples(limits: LimitSamples, number: int, surface: SampledSurface, sample: Ints) -> Ints:
    """Knot-span cells of samples; samples on an end disc belong to the cells at its rim.

    Parameters
    ----------
    limits : LimitSamples
    number : int
        Index of the surface.
    surface : SampledSurface
        It, with or without end discs.
    sample : (m,) int array
    """
    row, column = np.divmod(sample, surface.columns)
    row = np.clip(row - surface.rings, 0, len(surface.grid.r) - 1)
    around, along = limits.spans[number]
    return np.minimum(row // COARSE[1], along - 1) * around + column // COARSE[0]


def _separation(
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
    _separate(points, one, other, ways, bound, (value, column, entry))
    return RowBlock(np.zeros(len(cell), dtype=np.int64), cell, value, column, entry)


@numba.njit(cache=True, nogil=True)
def _separate(points, one, other, outward, bound, into):
    """Fill the values (m,), columns and entries (m, k) of `_separation`, `into`; without normals `outward` is zero."""
    (column_a, weight_a), (column_b, weight_b), (value, column, entry) = one, other, into
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


def _combination(body: Body, place: Place) -> tuple[Ints, Floats]:
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
