"""The limit at rims: a wall leaves its flat end at an angle, so that it never lies flat on its end disc.

The tube is kept in the half-space beyond the plane of its own end, by a part of the fold distance that grows with the
distance from the rim along the starting surface, up to all of it at the edge of the neighbourhood.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.local import nonzero_functions, point_weights
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.enclosed import Accuracy, CellBounds
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import Near, Placed, RowBlock, by_surface
from pneumorph.limits.tube.certify.cells import BACKWARDS, Cells, KnotSpans
from pneumorph.limits.tube.certify.hull_bounds import hull_bounds
from pneumorph.limits.tube.enclosed import EnclosedTubes
from pneumorph.limits.tube.measures.grid import Grid
from pneumorph.limits.tube.measures.spline_fields import combined
from pneumorph.limits.tube.peaks import beside
from pneumorph.limits.tube.points import on_tube
from pneumorph.limits.tube.sampled import SampledTubes
from pneumorph.limits.tube.samples import FINE, LimitSamples, worst_samples

if TYPE_CHECKING:
    from jax import Array

    from pneumorph.limits.tube.smooth import SmoothTubes

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

RIM = Limit("rim", "fold", "mm", True, 0.002, None, lambda limits: limits.fold.distance, "fold")

EDGE = 1e-4
"""Distance from the rim, relative to a knot span, at which the slope of a wall on its rim is evaluated."""


@dataclass(frozen=True)
class Rims:
    """The heights of tubes with flat ends over the planes of these, relative to the part that is to be kept there."""

    limits: tuple[Limit, ...] = (RIM,)

    def rows(self, at: SampledTubes, near: Near) -> Iterator[RowBlock]:
        for number, samples in enumerate(at.samples.coarse):
            if any(samples.flat):
                yield _rows(at, _worst(at.samples, at.body, number, near.reach))

    def rows_at(self, at: SampledTubes, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        for points in by_surface(at, places):
            yield _rows(at, points)

    def certify(self, body: EnclosedTubes, tallies: Mapping[str, Tally]) -> None:
        tally = tallies[RIM.name]
        for number in body.own:
            surface, spans = body.body.surfaces[number], body.spans[number]
            for bounded in bounds(surface, spans, body.spec.fold.neighbourhood, tally.accuracy, tally.worst):
                tally.points(number, bounded)

    def shares(self, at: SampledTubes, number: int) -> Iterator[tuple[str, Floats]]:
        samples, spec, x = at.samples.coarse[number], at.samples.spec.fold, at.fields[number].x
        if any(samples.flat):
            ratio = np.min(_ratios(x, samples, spec.neighbourhood), axis=0)
            yield RIM.name, RIM.used(np.concatenate([ratio[:1], ratio, ratio[-1:]]), spec.distance)

    def smooth(self, at: SmoothTubes) -> dict[str, Array]:
        values, spec = [], at.samples.spec.fold
        for x, grid in zip(at.tubes, at.samples.grids, strict=True):
            if any(grid.flat):
                ratios, xp = _ratios(x, grid, spec.neighbourhood), x.__array_namespace__()
                # On the rim itself the value is that of the wall's slope, found by extrapolation.
                outer = [(0, 1), (-1, -2)]
                beside = [each for each, flat in zip(outer, grid.flat, strict=True) if flat]
                rims = [2.0 * ratio[one] - ratio[two] for ratio, (one, two) in zip(ratios, beside, strict=True)]
                least = xp.min(xp.stack(ratios), axis=0).ravel()
                values.append(1.0 - xp.concatenate([least, *rims]) / spec.distance)
        return {RIM.name: at.joined(values)}


def _ratios(x: Any, grid: Grid, neighbourhood: float) -> list[Any]:
    """Heights in mm (rows - 2, columns) of samples x (3, rows, columns) over the planes of the flat ends, from the base
    on, relative to the part of the fold distance to be kept there; samples on the rims are left out."""
    along = grid.r[1:-1, None] * grid.size[1] / neighbourhood
    upwards, onwards = (np.array(direction)[:, None, None] for direction in grid.directions)
    base, tip = (upwards * (x - x[:, :1])).sum(axis=0), (onwards * (x[:, -1:] - x)).sum(axis=0)
    ratios = base[1:-1] / np.minimum(along, 1.0), tip[1:-1] / np.minimum(along[::-1], 1.0)
    return [ratio for ratio, flat in zip(ratios, grid.flat, strict=True) if flat]


def _worst(limits: LimitSamples, body: Body, number: int, reach: float) -> Placed:
    """The worst fine samples of every cell; the nearer flat end counts."""
    samples, surface = limits.fine[number], body.surfaces[number]
    r = np.clip(samples.r, *_within_edges(limits, number))
    support, functions = nonzero_functions(surface.basis_r, r)
    net = np.ascontiguousarray(np.moveaxis(surface.net, 2, 0))
    # One for each coordinate: the kernel does not check the bounds of what it reads.
    of_r = np.tile(functions, (1, len(net), 1, 1))
    x = combined(net, support, of_r, samples.support_q, samples.local_q, np.zeros((1, 2), int))[0]
    slope, end = _over_planes(limits, body, number, r)
    c = 1.0 + np.einsum("rc,crq->rq", slope, x - surface.net[end, 0].T[..., None])
    own, least = limits.own_fine[number], -reach / RIM.bound(limits.spec)
    row, column, cell = worst_samples(c, own, FINE, limits.spans[number], least)
    return Placed(number, limits.first[number] + cell, on_tube(*beside(samples, c, row, column)))


def _within_edges(limits: LimitSamples, number: int) -> tuple[float, float]:
    edge = EDGE / limits.spans[number][1]
    return edge, 1.0 - edge


def _over_planes(limits: LimitSamples, body: Body, number: int, r: Floats) -> tuple[Floats, Ints]:
    """Derivative (m, 3) of c by points at r, relative to those of the nearer flat end, and the row of that end."""
    spec, surface = limits.spec.fold, body.surfaces[number]
    base_pole, tip_pole = surface.poles
    tip = ((r > 0.5) | base_pole) & (not tip_pole)
    along = np.where(tip, 1.0 - r, r) * surface.size[1]
    slope = np.where(tip, 1.0, -1.0) / (spec.distance * np.minimum(along / spec.neighbourhood, 1.0))
    return slope[:, None] * np.array(surface.directions)[tip.astype(int)], np.where(tip, surface.net.shape[0] - 1, 0)


def _rows(at: SampledTubes, points: Placed) -> RowBlock:
    """The rows of points, which may be on the rims."""
    limits, body, surface = at.samples, at.body, at.body.surfaces[points.number]
    q, r = points.at[:, 0], np.clip(points.at[:, 1], *_within_edges(limits, points.number))
    slope, end = _over_planes(limits, body, points.number, r)
    numbers, weights = point_weights(surface, q, r)
    x = np.einsum("mk,mkc->mc", weights, surface.net.reshape(-1, 3)[numbers])
    # The plane moves with the end row, whose points are all in it.
    ends, whole = point_weights(surface, q, np.where(end > 0, 1.0, 0.0))
    numbers, weights = np.concatenate([numbers, ends], axis=1), np.concatenate([weights, -whole], axis=1)
    # Coordinates in the planes are left out.
    some = np.flatnonzero(np.any(surface.directions, axis=0))
    wide = numbers.shape[1] * len(some)
    return RowBlock(
        np.zeros(len(x), dtype=np.int64),
        points.cell,
        1.0 + np.einsum("mc,mc->m", slope, x - surface.net[end, 0]),
        (3 * (body.slices[points.number].start + numbers)[..., None] + some).reshape(len(x), wide),
        (weights[..., None] * slope[:, None, some]).reshape(len(x), wide),
    )


def bounds(
    surface: TubeSurface, spans: KnotSpans, neighbourhood: float, accuracy: Accuracy, worst: float
) -> list[CellBounds]:
    """Smallest heights (mm) of a tube over the planes of its flat ends, relative to the part to be kept; signs changed.

    Height and part both vanish on the rim, so the common factor v is divided out there.

    Parameters
    ----------
    surface : TubeSurface
    spans : KnotSpans
    neighbourhood : float
        Distance from the rim beyond which the whole fold distance is kept, mm.
    accuracy : Accuracy
        Of heights with their sign changed.
    worst : float
        Worst of these attained elsewhere, mm.
    """
    rows = surface.basis_r.spans
    per_end = []
    for tip, pole in zip((False, True), surface.poles, strict=True):
        if pole:
            continue
        direction = np.array(surface.directions[tip])
        along = np.einsum("ncij,c->nij", spans.x, direction).reshape(rows, -1, 4, 4)
        if surface.poles[1]:
            along[-1] = np.einsum("ij,bjm->bim", BACKWARDS, along[-1])
        height = np.einsum("ij,abjm->abim", BACKWARDS, along)[::-1] if tip else along
        height[:, :, 0, 0] -= surface.net[-1 if tip else 0, 0] @ direction
        height = -height if tip else height
        start, width = np.arange(rows) / rows, 1.0 / rows
        own = spans.own.reshape(rows, -1)[:: -1 if tip else 1].ravel()
        share = np.zeros_like(height)
        share[:, :, 0, 0], share[:, :, 1, 0] = start[:, None], width
        share *= surface.size[1] / neighbourhood
        near = np.stack([height, share], axis=2)
        near[0] = np.roll(near[0], -1, axis=-2)
        near[0, :, :, -1] = 0.0
        away = np.stack([height, np.zeros_like(height)], axis=2)
        away[:, :, 1, 0, 0] = 1.0

        columns = along.shape[1]
        edge = np.repeat(np.clip((neighbourhood / surface.size[1] - start) / width, 0.0, 1.0), columns)
        lower, upper = np.concatenate([np.zeros_like(edge), edge]), np.concatenate([edge, np.ones_like(edge)])
        count = len(lower)
        cells = Cells(
            np.arange(count),
            np.stack([np.full(count, 0.5), 0.5 * (lower + upper)], axis=1),
            np.stack([np.full(count, 0.5), 0.5 * (upper - lower)], axis=1),
        )
        r = np.repeat(np.stack([1.0 - start if tip else start, np.full(rows, -width if tip else width)], 1), columns, 0)
        some = (upper > lower) & np.tile(own, 2)
        both = KnotSpans(np.zeros((0, 3, 4, 4)), np.tile(spans.q, (2, 1)), np.tile(r, (2, 1)), some)
        polynomials = np.concatenate([near, away]).reshape(count, 2, 4, 4)
        per_end.append(hull_bounds(polynomials, lambda net: -net[:, 0] / net[:, 1], both, accuracy, worst, cells))
        worst = max(worst, float(per_end[-1].attained.max()))
    return per_end
