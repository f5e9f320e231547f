"""Limits on the shape of a surface: curvature (25), skew (27), stretch (29), and the area element.

They are measured together. Rows have exact derivatives at the worst points.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import CLOSE, DIGITS, Near, RowBlock
from pneumorph.limits.tube.certify.shape_bounds import enclosed
from pneumorph.limits.tube.enclosed import EnclosedTubes
from pneumorph.limits.tube.measures.formulas import MIN_AREA
from pneumorph.limits.tube.measures.grid import Grid
from pneumorph.limits.tube.measures.shape import differentiated, measured, measured_samples
from pneumorph.limits.tube.peaks import at_offset, expected_peaks, peaks_at
from pneumorph.limits.tube.points import on_tube
from pneumorph.limits.tube.sampled import SampledTubes
from pneumorph.limits.tube.samples import FINE, LimitSamples, cell_of, worst_samples
from pneumorph.threads import each

if TYPE_CHECKING:
    from jax import Array

    from pneumorph.limits.tube.smooth import SmoothTubes
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


CURVATURE = Limit("curvature", "curvature", "/mm²", False, 0.004, "curvature", lambda limits: limits.curvature)
SKEW = Limit("skew", "skew", "", False, 0.004, "skew", lambda limits: limits.skew)
STRETCH = Limit("stretch", "stretch", "/mm²", False, 0.004, "stretch", lambda limits: limits.stretch.limit)
AREA = Limit("area", "relative area", "", True, 0.004, None, lambda limits: MIN_AREA)

_LIMITS = (CURVATURE, SKEW, STRETCH, AREA)
"""In the order in which measures are numbered."""

_SQUARES = (CURVATURE, SKEW, STRETCH)
"""The first of them, which are squares. Their rows are of twice the roots, which have the same value and slope at the
bound and are nearer to linear in the control points: a row of the square itself asks for too short a motion."""

_STEEP = 0.25
"""Share of the bound below which a root would be too steep, and goes on as its tangent."""

EXPECTED = np.array([(1, 1), (1, 0), (0, 1)])
"""Where a peak beside a sample is sought first: parts of its expected offsets along q and r."""

CROSS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
STEPS = (0.5, 0.25)
"""Then along q and r from the worst place so far, by these parts of a sample distance: at a kink on a knot line the
expected offsets are wrong."""


class _Places(NamedTuple):
    """Points of a surface: kinds of measures, cells, q and r, and c, (m,) each."""

    kind: Ints
    cell: Ints
    q: Floats
    r: Floats
    value: Floats


def _scale_and_shift(spec: Limits) -> tuple[Floats, Floats]:
    """Factors (4,) and constants (4,) that make c of the measures."""
    signs = np.array([limit.sign for limit in _LIMITS])
    return signs / [limit.bound(spec) for limit in _LIMITS], -signs


@dataclass(frozen=True)
class Shapes:
    """The limits on curvature, skew, stretch and area of all surfaces."""

    limits: tuple[Limit, ...] = _LIMITS

    def rows(self, at: SampledTubes, near: Near) -> Iterator[RowBlock]:
        samples, body = at.samples, at.body
        scale, shift = _scale_and_shift(samples.spec)
        for number, surface in enumerate(body.surfaces):
            given = _added(samples, number, surface, scale, shift, near.places)
            worst = _worst_places(samples, number, surface, scale, shift, near.least)
            kind, cell, q, r = _distinct(samples.fine[number], given, worst)
            value, entry, column = differentiated(surface, kind, q, r, samples.spec.stretch.form)
            excess = scale[kind] * value + shift[kind]
            c, slope = _straightened(kind, excess)
            entry *= (slope * scale[kind])[:, None]
            column += 3 * body.slices[number].start
            close = {}
            for k, limit in enumerate(self.limits):
                some = np.flatnonzero((excess > CLOSE) & (kind == k))
                here = np.full(len(some), number)
                close[limit.name] = Points(here, on_tube(q[some], r[some]), value[some], value[some])
            yield RowBlock(kind, samples.first[number] + cell, c, column, entry, close)

    def rows_at(self, at: SampledTubes, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        # They are among `Near.places`.
        yield from ()

    def certify(self, body: EnclosedTubes, tallies: Mapping[str, Tally]) -> None:
        for number in body.own:
            some = [tallies[limit.name] for limit in self.limits]
            accuracies, worst = [tally.accuracy for tally in some], [tally.worst for tally in some]
            surface, spans = body.body.surfaces[number], body.spans[number]
            enclosures = enclosed(surface, spans, body.spec.stretch.form, accuracies, worst)
            for tally, bounds in zip(some, enclosures, strict=True):
                tally.points(number, bounds)

    def shares(self, at: SampledTubes, number: int) -> Iterator[tuple[str, Floats]]:
        spec = at.samples.spec
        values = measured_samples(at.body.surfaces[number], at.samples.fine[number], spec.stretch.form)
        for limit, value in zip(self.limits, values, strict=True):
            yield limit.name, limit.used(value, limit.bound(spec))

    def smooth(self, at: SmoothTubes) -> dict[str, Array]:
        spec = at.samples.spec
        return {each.name: each.sign * (at.measured(each.name) / each.bound(spec) - 1.0) for each in self.limits}


def _straightened(kind: Ints, excess: Floats) -> tuple[Floats, Floats]:
    """c, and its derivative by the excess over the bound, (m,) each, of roots where the measures are squares."""
    share = np.maximum(1.0 + excess, _STEEP)
    root = np.sqrt(share)
    c = 2.0 * (root - 1.0) + (1.0 + excess - share) / root
    square = kind < len(_SQUARES)
    return np.where(square, c, excess), np.where(square, 1.0 / root, 1.0)


def _worst_places(
    limits: LimitSamples, number: int, surface: TubeSurface, scale: Floats, shift: Floats, least: float
) -> _Places:
    """The worst samples of every cell; those near their bounds are moved to nearby peaks."""
    samples, form = limits.fine[number], limits.spec.stretch.form
    own, spans = limits.own_fine[number], limits.spans[number]
    c = measured_samples(surface, samples, form, limits.seen_fine[number])
    for kind in range(len(c)):
        c[kind] = scale[kind] * c[kind] + shift[kind]
    # The worst sample, and the one with the highest expected peak: at a kink on a knot line expectations are too high.
    near = max(least, CLOSE)
    fields = [(values, least) for values in c] + [(values, near) for values in expected_peaks(c, near, own)]
    picked = each(lambda field: worst_samples(field[0], own, FINE, spans, field[1]), fields)
    kind = np.repeat(np.tile(np.arange(len(c)), 2), [len(cell) for _, _, cell in picked])
    row, column, cell = (np.concatenate(parts) for parts in zip(*picked, strict=True))
    # Often they are the same.
    first = np.unique(np.ravel_multi_index((kind, row, column), c.shape), return_index=True)[1]
    kind, row, column, cell = (part[first] for part in (kind, row, column, cell))
    value, q, r = c[kind, row, column], samples.q[column], samples.r[row]
    expected, aside, up = peaks_at(c, kind, row, column)
    close = np.flatnonzero(expected > CLOSE)
    across, along = np.zeros((2, len(close)))

    def look(to_q: Floats, to_r: Floats) -> None:
        """Move to the worst of places (tries, m), so that images move to images whatever the order of the tries."""
        peak_q, peak_r = at_offset(samples, row[close], column[close], to_q, to_r)
        kinds = np.broadcast_to(kind[close], to_q.shape)
        flat = measured(surface, kinds.ravel(), peak_q.ravel(), peak_r.ravel(), form).reshape(to_q.shape)
        peak = scale[kinds] * flat + shift[kinds]
        of = np.argmax(np.round(peak, DIGITS), axis=0), np.arange(len(close))
        worse = np.flatnonzero(peak[of] > value[close] + 10.0**-DIGITS)
        of, moved = (of[0][worse], worse), close[worse]
        value[moved], q[moved], r[moved] = peak[of], peak_q[of], peak_r[of]
        across[worse], along[worse] = to_q[of], to_r[of]

    look(*(parts[:, None] * each[close] for parts, each in zip(EXPECTED.T, (aside, up), strict=True)))
    for step in STEPS:
        look(*(here + step * parts[:, None] for parts, here in zip(CROSS.T, (across, along), strict=True)))
    return _Places(kind, cell, q, r, value)


def _distinct(samples: Grid, given: _Places, worst: _Places) -> tuple[Ints, Ints, Floats, Floats]:
    """Kind, cell, q and r of all points but those within half the sample distance of another with a worse value."""
    order = np.argsort(-np.round(np.concatenate([given.value, worst.value]), DIGITS), kind="stable")
    kind, cell = (np.concatenate(pair)[order] for pair in ((given.kind, worst.kind), (given.cell, worst.cell)))
    q, r = (np.concatenate(pair)[order] for pair in ((given.q, worst.q), (given.r, worst.r)))
    around, along = 2 * len(samples.q), 2 * (len(samples.r) - 1)
    place_q, place_r = np.round(q * around).astype(np.int64) % around, np.round(r * along).astype(np.int64)
    first = np.sort(np.unique((kind * around + place_q) * (along + 1) + place_r, return_index=True)[1])
    return kind[first], cell[first], q[first], r[first]


def _added(
    limits: LimitSamples,
    number: int,
    surface: TubeSurface,
    scale: Floats,
    shift: Floats,
    places: Mapping[str, Points] | None,
) -> _Places:
    """The given points on a surface, which get rows whatever their values."""
    none = np.zeros(0, dtype=np.int64)
    if places is None:
        return _Places(none, none, *np.zeros((3, 0)))
    parts = []
    for kind, limit in enumerate(_LIMITS):
        points = places[limit.name]
        here = points.surface == number
        q, r = points.at[here, 0], points.at[here, 1]
        parts.append((np.full(len(q), kind), cell_of(limits, number, q, r), q, r))
    kind, cell = (np.concatenate([part[k] for part in parts]) for k in range(2))
    q, r = (np.concatenate([part[k] for part in parts]) for k in range(2, 4))
    value = scale[kind] * measured(surface, kind, q, r, limits.spec.stretch.form) + shift[kind]
    return _Places(kind, cell, q, r, value)
