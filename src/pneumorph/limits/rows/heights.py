"""Linearised limits (rows) on single points: rims, end planes and the envelope."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.local import nonzero_functions, point_weights
from pneumorph.limits.certify.report import Points
from pneumorph.limits.measures.grid import SampledFields
from pneumorph.limits.measures.spline_fields import combined
from pneumorph.limits.rows.samples import COARSE, FINE, KINDS, LimitSamples, RowBlock, cell_of, worst_samples

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

EDGE = 1e-3
"""Distance from the rim, relative to a knot span, at which the slope of a wall on its rim is evaluated."""


class _At(NamedTuple):
    """Points (q, r) of the surface with index `number`, in the given knot-span cells; all arrays are (m,)."""

    number: int
    cell: Ints
    q: Floats
    r: Floats


def heights(limits: LimitSamples, body: Body, number: int, field: SampledFields, reach: float) -> Iterator[RowBlock]:
    """The rows of a surface's limits on single points that are at most `reach` mm within their bounds.

    `field` are its coarse samples.
    """
    wall, samples = limits.spec.wall, limits.coarse[number]
    if len(samples.rings):
        yield _rims(limits, body, _worst_at_rims(limits, body, number, reach))
    z = field.x[2]
    c = (1.0 if samples.cavity else 0.0) - np.minimum(z, limits.length - z) / wall
    if not samples.cavity:
        c[[0, -1]] = -np.inf
    yield _planes(limits, body, _worst(limits, number, c, -reach / wall))
    if number == 0 and limits.spec.envelope is not None:
        away = np.hypot(field.x[0], field.x[1])
        yield _envelope(limits, body, _worst(limits, 0, (away - limits.spec.envelope.radius) / wall, -reach / wall))


def heights_at(limits: LimitSamples, body: Body, name: str, found: Points) -> Iterator[RowBlock]:
    """The rows of points where a certificate has found one of these limits broken."""
    rows = {"rim": _rims, "planes": _planes, "ends": _planes, "envelope": _envelope}[name]
    for number in np.unique(found.surface):
        q, r = found.q[found.surface == number], found.r[found.surface == number]
        yield rows(limits, body, _At(int(number), cell_of(limits, number, q, r), q, r))


def _worst(limits: LimitSamples, number: int, c: Floats, least: float) -> _At:
    """The worst coarse samples of every cell, for values c (rows, columns) above `least`."""
    samples = limits.coarse[number]
    row, column, cell = worst_samples(c, limits.own_coarse[number], COARSE, limits.spans[number], least)
    return _At(number, cell, samples.q[column], samples.r[row])


def _worst_at_rims(limits: LimitSamples, body: Body, number: int, reach: float) -> _At:
    """The worst fine samples of every cell for heights over the end planes; the nearer end counts."""
    samples, spec, surface = limits.fine[number], limits.spec.fold, body.surfaces[number]
    r = np.clip(samples.r, *_within_edges(limits, number))
    support, functions = nonzero_functions(surface.basis_r, r)
    net = np.ascontiguousarray(np.moveaxis(surface.net[..., 2:], 2, 0))
    z = combined(net, support, functions[None, None], samples.support_q, samples.local_q, np.zeros((1, 2), int))[0, 0]
    slope, end = _over_planes(limits, body, number, r)
    c = 1.0 + slope[:, None] * (z - surface.net[end, 0, 2][:, None])
    own, least = limits.own_fine[number], -reach / spec.distance
    row, column, cell = worst_samples(c, own, FINE, limits.spans[number], least)
    return _At(number, cell, samples.q[column], r[row])


def _within_edges(limits: LimitSamples, number: int) -> tuple[float, float]:
    edge = EDGE / limits.spans[number][1]
    return edge, 1.0 - edge


def _over_planes(limits: LimitSamples, body: Body, number: int, r: Floats) -> tuple[Floats, Ints]:
    """Derivative (m,) of c by the height of points at r over the plane of the nearer end, and the row of that end."""
    spec, surface, tip = limits.spec.fold, body.surfaces[number], r > 0.5
    along = np.where(tip, 1.0 - r, r) * surface.size[1]
    slope = np.where(tip, 1.0, -1.0) / (spec.distance * np.minimum(along / spec.neighbourhood, 1.0))
    return slope, np.where(tip, surface.net.shape[0] - 1, 0)


def _rims(limits: LimitSamples, body: Body, at: _At) -> RowBlock:
    """Heights of a tube over the planes of its own flat ends, including its rims; see `grid.rim_share`."""
    surface = body.surfaces[at.number]
    r = np.clip(at.r, *_within_edges(limits, at.number))
    slope, end = _over_planes(limits, body, at.number, r)
    numbers, weights = point_weights(surface, at.q, r)
    z = np.einsum("mk,mk->m", weights, surface.net[..., 2].ravel()[numbers])
    # The plane moves with the end row, whose points all have the same z.
    ends, whole = point_weights(surface, at.q, np.where(end > 0, 1.0, 0.0))
    return RowBlock(
        np.full(len(at.cell), KINDS.index("rim")),
        limits.first[at.number] + at.cell,
        1.0 + slope * (z - surface.net[end, 0, 2]),
        3 * (body.slices[at.number].start + np.concatenate([numbers, ends], axis=1)) + 2,
        slope[:, None] * np.concatenate([weights, -whole], axis=1),
    )


def _planes(limits: LimitSamples, body: Body, at: _At) -> RowBlock:
    """Distances of chambers from the nearer plane of the body's ends, which the exterior must not pass."""
    wall, surface, cavity = limits.spec.wall, body.surfaces[at.number], limits.coarse[at.number].cavity
    numbers, weights = point_weights(surface, at.q, at.r)
    z = np.einsum("mk,mk->m", weights, surface.net[..., 2].ravel()[numbers])
    slope = np.where(z < 0.5 * limits.length, -1.0, 1.0) / wall
    return RowBlock(
        np.full(len(at.cell), KINDS.index("planes" if cavity else "ends")),
        limits.first[at.number] + at.cell,
        (1.0 if cavity else 0.0) - np.minimum(z, limits.length - z) / wall,
        3 * (body.slices[at.number].start + numbers) + 2,
        slope[:, None] * weights,
    )


def _envelope(limits: LimitSamples, body: Body, at: _At) -> RowBlock:
    """Distances of the exterior from the z axis."""
    envelope, wall = limits.spec.envelope, limits.spec.wall
    assert envelope is not None
    numbers, weights = point_weights(body.exterior, at.q, at.r)
    x = np.einsum("mk,mkc->mc", weights, body.exterior.net[..., :2].reshape(-1, 2)[numbers])
    away = np.hypot(*x.T)
    return RowBlock(
        np.full(len(at.cell), KINDS.index("envelope")),
        limits.first[0] + at.cell,
        (away - envelope.radius) / wall,
        (3 * numbers[..., None] + np.arange(2)).reshape(len(at.cell), 32),
        (weights[..., None] * (x / away[:, None])[:, None, :] / wall).reshape(len(at.cell), 32),
    )
