"""How much of the nearest limit every point of a body uses: what the optimiser sees at samples, as shares of limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from pneumorph.geometry import Body
from pneumorph.limits.measures.distances import SampledSurface, closest_within, nearest_fold, sampled_surface
from pneumorph.limits.measures.grid import Grid, heights, rim_share, sampled_fields
from pneumorph.limits.measures.shape import measured_samples
from pneumorph.limits.rows.samples import COARSE, FINE, SHAPE, LimitSamples
from pneumorph.limits.table import BY_NAME, OF_SHAPE

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

PER_SPAN = (2, 2)
"""Points per knot span in q and r at which shares are given; each has the largest share around it."""

LEAST = 0.5
"""Distances are measured only where at least this share of their limits is used: to find farther ones takes longer."""

NAMES = tuple(limit.name for limit in OF_SHAPE if limit.name != "ends")
"""The limits that can be used up: the ends of the exterior need no distance from their planes."""


class Usage(NamedTuple):
    """Of a surface, at equal steps of r (rows, both ends included) and of q (columns, q = 1 left out).

    Attributes
    ----------
    share : (rows, columns) array
        Share of the nearest limit that is used: 1 at the limit, more where it is violated.
    limit : (rows, columns) array
        Index in `NAMES` of that limit.
    """

    share: Floats
    limit: Ints


def usage(limits: LimitSamples, body: Body) -> list[Usage]:
    """The share of the nearest limit used everywhere on each surface of a body, the exterior first."""
    tubes, closed = [], []
    for surface, samples in zip(body.surfaces, limits.coarse, strict=True):
        field = sampled_fields(surface, samples)
        tubes.append(sampled_surface(field, samples, discs=False))
        closed.append(sampled_surface(field, samples, discs=samples.cavity))
    found = []
    for number, samples in enumerate(limits.coarse):
        shares = np.zeros((len(NAMES), *_pooled(np.zeros(samples.shape), COARSE).shape))
        for name, used in _distances(limits, number, tubes[number], closed):
            shares[NAMES.index(name)] = _pooled(used.reshape(samples.shape), COARSE)
        for name, used in _shapes(limits, body, number):
            shares[NAMES.index(name)] = _pooled(used, FINE)
        found.append(Usage(shares.max(axis=0), shares.argmax(axis=0)))
    return found


def _shapes(limits: LimitSamples, body: Body, number: int) -> Iterator[tuple[str, Floats]]:
    """Shares (rows, columns) of the limits on curvature, skew, stretch and area, on the fine samples."""
    values = measured_samples(body.surfaces[number], limits.fine[number], limits.spec.stretch.form)
    for name, value in zip(SHAPE, values, strict=True):
        yield name, _used(limits, name, value)


def _distances(
    limits: LimitSamples, number: int, tube: SampledSurface, closed: list[SampledSurface]
) -> Iterator[tuple[str, Floats]]:
    """Shares of the limits on distances, on all coarse samples of a tube."""
    spec, samples, x = limits.spec, limits.coarse[number], np.moveaxis(tube.x.reshape(*tube.grid.shape, 3), 2, 0)
    walls = [_wall(tube, other, spec.wall / LEAST) for place, other in enumerate(closed) if place != number]
    yield "wall", _used(limits, "wall", np.min(walls, axis=0))
    yield "fold", _used(limits, "fold", _fold(tube, spec.fold.neighbourhood, spec.fold.distance / LEAST))
    if len(samples.rings):
        yield "rim", _used(limits, "rim", _rim(x, samples, spec.fold.neighbourhood))
    if samples.cavity:
        yield "planes", _used(limits, "planes", np.minimum(x[2], limits.length - x[2]))
    elif spec.envelope is not None:
        yield "envelope", _used(limits, "envelope", np.hypot(x[0], x[1]))


def _used(limits: LimitSamples, name: str, values: Floats) -> Floats:
    limit = BY_NAME[name]
    bound = limit.read(limits.spec)
    assert bound is not None
    return limit.used(values, bound)


def _wall(tube: SampledSurface, other: SampledSurface, bound: float) -> Floats:
    """Distances (n,) of the samples of a tube from another surface; infinite beyond the bound."""
    some, _, near, _ = closest_within(tube.x, other, bound)
    distance = np.full(len(tube.x), np.inf)
    distance[some] = near
    return distance


def _fold(tube: SampledSurface, neighbourhood: float, bound: float) -> Floats:
    """Distances (n,) of the samples of a tube from its nearest points outside the neighbourhood."""
    # Walls farther apart than the neighbourhood are not folds.
    fold = nearest_fold(tube, neighbourhood, min(bound, neighbourhood), np.arange(len(tube.x)))
    distance, facing = fold.distance.copy(), np.flatnonzero(fold.facing)
    distance[facing] = tube.closest(tube.x[facing], fold.near[facing])[0]
    return distance


def _rim(x: Floats, samples: Grid, neighbourhood: float) -> Floats:
    """Heights (rows, columns) over the nearer end plane, relative to the part of the distance to be kept there."""
    ratio = np.full(x.shape[1:], np.inf)
    for share, height in zip(rim_share(samples, neighbourhood), heights(x, samples), strict=True):
        ratio[1:-1] = np.minimum(ratio[1:-1], height[1:-1] / share[1:-1])
    ratio[0], ratio[-1] = ratio[1], ratio[-2]
    return ratio


def _pooled(values: Floats, per_span: tuple[int, int]) -> Floats:
    """The largest of samples around each point that `PER_SPAN` says."""
    across, along = (fine // coarse for fine, coarse in zip(per_span, PER_SPAN, strict=True))
    rows = maximum_filter1d(values, 2 * (along // 2) + 1, axis=0, mode="nearest")[::along]
    return maximum_filter1d(rows, 2 * (across // 2) + 1, axis=1, mode="wrap")[:, ::across]
