"""Linearised limits (rows) of curvature, skew, stretch and area, with exact derivatives at the worst points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.report import Points
from pneumorph.limits.measures.formulas import MIN_AREA
from pneumorph.limits.measures.grid import Grid
from pneumorph.limits.measures.shape import differentiated, measured, measured_samples
from pneumorph.limits.rows.peaks import expected_peaks, peaks_at
from pneumorph.limits.rows.samples import CLOSE, DIGITS, FINE, SHAPE, LimitSamples, RowBlock, cell_of, worst_samples
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def shapes(
    limits: LimitSamples, body: Body, least: float, places: Mapping[str, Points] | None
) -> tuple[list[RowBlock], dict[str, Points]]:
    """The rows of a body, and for each measure the points that are close to its bound."""
    spec = limits.spec
    scale = np.array([1 / spec.curvature, 1 / spec.skew, 1 / spec.stretch.limit, -1 / MIN_AREA])
    shift = np.array([-1.0, -1.0, -1.0, 1.0])
    rows, close_by = [], []
    for number, surface in enumerate(body.surfaces):
        given = _added(limits, number, places)
        found = _worst_places(limits, number, surface, scale, shift, least)
        kind, cell = (np.concatenate(pair) for pair in zip(given[:2], found[:2], strict=True))
        q, r = (np.concatenate(pair) for pair in zip(given[2:], found[2:], strict=True))
        kind, cell, q, r = _distinct(limits.fine[number], kind, cell, q, r)
        value, entry, column = differentiated(surface, kind, q, r, spec.stretch.form)
        excess = scale[kind] * value + shift[kind]
        entry *= scale[kind][:, None]
        column += 3 * body.slices[number].start
        rows.append(RowBlock(kind, limits.first[number] + cell, excess, column, entry))
        close = excess > CLOSE
        close_by.append((kind[close], np.full(np.count_nonzero(close), number), q[close], r[close], value[close]))
    kind, surface, q, r, value = (np.concatenate(parts) for parts in zip(*close_by, strict=True))
    here = {name: kind == number for number, name in enumerate(SHAPE)}
    return rows, {name: Points(surface[i], q[i], r[i], value[i], value[i]) for name, i in here.items()}


def _worst_places(
    limits: LimitSamples, number: int, surface: TubeSurface, scale: Floats, shift: Floats, least: float
) -> tuple[Ints, Ints, Floats, Floats]:
    """Kind, cell, q and r of the worst samples of every cell; those near their bounds are moved to nearby peaks."""
    samples, form = limits.fine[number], limits.spec.stretch.form
    c = measured_samples(surface, samples, form)
    for kind in range(len(c)):
        c[kind] = scale[kind] * c[kind] + shift[kind]
    # The worst sample, and the one with the highest expected peak: at a kink on a knot line expectations are too high.
    near = max(least, CLOSE)
    fields = [(values, least) for values in c] + [(values, near) for values in expected_peaks(c, near)]
    own, spans = limits.own_fine[number], limits.spans[number]
    picked = each(lambda field: worst_samples(field[0], own, FINE, spans, field[1]), fields)
    kind = np.repeat(np.tile(np.arange(len(c)), 2), [len(cell) for _, _, cell in picked])
    row, column, cell = (np.concatenate(parts) for parts in zip(*picked, strict=True))
    value, q, r = c[kind, row, column], samples.q[column], samples.r[row]
    expected, aside, up = peaks_at(c, kind, row, column)
    close = np.flatnonzero(expected > CLOSE)
    peak_q, peak_r = (q[close] + aside[close] / len(samples.q)) % 1.0, r[close] + up[close] / (len(samples.r) - 1)
    peak = scale[kind[close]] * measured(surface, kind[close], peak_q, peak_r, form) + shift[kind[close]]
    worse = peak > value[close] + 10.0**-DIGITS
    moved = close[worse]
    value[moved], q[moved], r[moved] = peak[worse], peak_q[worse], peak_r[worse]
    # Worst first: of places close together the first is kept.
    order = np.argsort(-np.round(value, DIGITS), kind="stable")
    return kind[order], cell[order], q[order], r[order]


def _distinct(samples: Grid, kind: Ints, cell: Ints, q: Floats, r: Floats) -> tuple[Ints, Ints, Floats, Floats]:
    """Remove points that are less than half the sample distance from an earlier one."""
    around, along = 2 * len(samples.q), 2 * (len(samples.r) - 1)
    place_q, place_r = np.round(q * around).astype(np.int64) % around, np.round(r * along).astype(np.int64)
    first = np.sort(np.unique((kind * around + place_q) * (along + 1) + place_r, return_index=True)[1])
    return kind[first], cell[first], q[first], r[first]


def _added(limits: LimitSamples, number: int, places: Mapping[str, Points] | None) -> tuple[Ints, Ints, Floats, Floats]:
    """Kind, cell, q and r of the given points on a surface, which get rows whatever their values."""
    none = np.zeros(0, dtype=np.int64)
    if places is None:
        return none, none, np.zeros(0), np.zeros(0)
    parts = []
    for kind, name in enumerate(SHAPE):
        found = places[name]
        here = found.surface == number
        q, r = found.q[here], found.r[here]
        parts.append((np.full(len(q), kind), cell_of(limits, number, q, r), q, r))
    kind, cell, q, r = (np.concatenate(part) for part in zip(*parts, strict=True))
    return kind, cell, q, r
