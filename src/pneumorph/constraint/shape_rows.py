"""Linearised limits (rows) of curvature, skew, stretch and area, with exact derivatives at the worst points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from pneumorph.constraint.frame import frame
from pneumorph.constraint.report import Points
from pneumorph.constraint.sampled import CLOSE, DIGITS, FINE, SHAPE, LimitSamples, RowBlock, cell_of, worst_samples
from pneumorph.constraint.sampling import Grid
from pneumorph.constraint.surface import MIN_AREA, Form, pointwise
from pneumorph.geometry import Body, TubeSurface
from pneumorph.geometry.local import nonzero_functions, point_weights

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_BLOCK = 4096
"""Points evaluated at a time: code is compiled for this size only, whatever the body."""


def shapes(
    limits: LimitSamples, body: Body, least: float, places: Mapping[str, Points] | None
) -> tuple[list[RowBlock], dict[str, Points]]:
    """The rows, and for each measure the points that are close to its bound."""
    spec = limits.spec
    scale = np.array([1 / spec.curvature, 1 / spec.skew, 1 / spec.stretch.limit, -1 / MIN_AREA])
    shift = np.array([-1.0, -1.0, -1.0, 1.0])
    rows, close_by = [], []
    for number, (surface, samples) in enumerate(zip(body.surfaces, limits.fine, strict=True)):
        c = scale[:, None, None] * _measured(surface, samples, spec.stretch.form) + shift[:, None, None]

        def at_places(kind: Ints, q: Floats, r: Floats, surface=surface, samples=samples) -> Floats:
            measures = _evaluated(*_tangents(surface, q, r)[0], samples, spec.stretch.form)
            return scale[kind] * measures[kind, np.arange(len(kind))] + shift[kind]

        given, worst = _added(limits, number, places), _worst_places(limits, number, c, least, at_places)
        kind, cell = (np.concatenate(pair) for pair in zip(given[:2], worst[:2], strict=True))
        q, r = (np.concatenate(pair) for pair in zip(given[2:], worst[2:], strict=True))
        kind, cell, q, r = _distinct(samples, kind, cell, q, r)
        value, entry, points = differentiated_shapes(surface, samples, kind, q, r, spec.stretch.form)
        excess = scale[kind] * value + shift[kind]
        unknowns = (3 * (body.slices[number].start + points)[..., None] + np.arange(3)).reshape(len(kind), 48)
        rows.append(RowBlock(kind, limits.first[number] + cell, excess, unknowns, scale[kind][:, None] * entry))
        close = excess > CLOSE
        close_by.append((kind[close], np.full(np.count_nonzero(close), number), q[close], r[close], value[close]))
    kind, surface, q, r, value = (np.concatenate(parts) for parts in zip(*close_by, strict=True))
    here = {name: kind == number for number, name in enumerate(SHAPE)}
    return rows, {name: Points(surface[i], q[i], r[i], value[i], value[i]) for name, i in here.items()}


def _worst_places(
    limits: LimitSamples, number: int, c: Floats, least: float, at_places: Callable[[Ints, Floats, Floats], Floats]
) -> tuple[Ints, Ints, Floats, Floats]:
    """Kind, cell, q and r of the worst samples of every cell; those near their bounds are moved to nearby peaks.

    c (kinds, rows, columns) are the values on the samples of a surface; `at_places` evaluates them at any points of it.
    """
    samples = limits.fine[number]
    expected, aside, up = _peaks(c)
    # The worst sample, and the one with the highest expected peak: at a kink on a knot line expectations are too high.
    picked = [worst_samples(values, FINE, limits.spans[number], least) for values in c]
    picked += [worst_samples(values, FINE, limits.spans[number], max(least, CLOSE)) for values in expected]
    kind = np.repeat(np.tile(np.arange(len(c)), 2), [len(cell) for _, _, cell in picked])
    row, column, cell = (np.concatenate(parts) for parts in zip(*picked, strict=True))
    at = kind, row, column
    value, q, r = c[at], samples.q[column], samples.r[row]
    close = np.flatnonzero(expected[at] > CLOSE)
    peak_q, peak_r = (
        (q[close] + aside[at][close] / len(samples.q)) % 1.0,
        r[close] + up[at][close] / (len(samples.r) - 1),
    )
    peak = at_places(kind[close], peak_q, peak_r)
    worse = peak > value[close] + 10.0**-DIGITS
    moved = close[worse]
    value[moved], q[moved], r[moved] = peak[worse], peak_q[worse], peak_r[worse]
    # Worst first: of places close together the first is kept.
    order = np.argsort(-np.round(value, DIGITS), kind="stable")
    return kind[order], cell[order], q[order], r[order]


def _distinct(samples: Grid, kind: Ints, cell: Ints, q: Floats, r: Floats) -> tuple[Ints, Ints, Floats, Floats]:
    """Remove points that are less than half the sample distance from an earlier one."""
    steps = 2.0 * np.array([len(samples.q), len(samples.r) - 1])
    rounded = np.stack([kind, np.round(q * steps[0]) % steps[0], np.round(r * steps[1])], axis=1)
    first = np.sort(np.unique(rounded, axis=0, return_index=True)[1])
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


def _peaks(c: Floats) -> tuple[Floats, Floats, Floats]:
    """Values near samples c (kinds, rows, columns) at the peaks of parabolas, and the peaks' offsets along q and r.

    The parabolas pass through a sample and its two neighbours in either direction. Offsets are in sample distances, at
    most half of one. A peak between two samples may be several per cent above both.
    """
    aside, rise_q = _peak(np.roll(c, 1, axis=2), c, np.roll(c, -1, axis=2), 0.0)
    # The first and last rows belong to the parabolas of their inner neighbours.
    inside = np.clip(np.arange(c.shape[1]), 1, c.shape[1] - 2)
    shift = (np.arange(c.shape[1]) - inside)[:, None].astype(float)
    up, rise_r = _peak(c[:, inside - 1], c[:, inside], c[:, inside + 1], shift)
    return c + rise_q + rise_r, aside, up


def _peak(before: Floats, here: Floats, after: Floats, start: Floats | float) -> tuple[Floats, Floats]:
    """Offset from `start` to the peak of a parabola through values at -1, 0, 1, and its rise from there.

    The peak is sought within half a step of `start`, but not beyond the three values.
    """
    bend, slope = np.round(2.0 * here - before - after, DIGITS), np.round(after - before, DIGITS)
    summit = np.where(bend > 0.0, 0.5 * slope / np.where(bend > 0.0, bend, 1.0), np.sign(slope))
    place = np.clip(summit, np.maximum(start - 0.5, -1.0), np.minimum(start + 0.5, 1.0))
    rise = 0.5 * (slope * (place - start) - bend * (place**2 - start**2))
    return place - start, np.maximum(rise, 0.0)


_ORDERS = ((0, 1), (1, 0), (0, 2), (2, 1), (3, 0))
"""Index of the function of r in `Frame`, and order of the derivative in q, for U, r_r, U_q, U_r and r_rr."""


def _measured(surface: TubeSurface, samples: Grid, form: Form) -> Floats:
    """All measures (4, rows, columns) on the samples."""
    parts = samples.frame
    fields = samples.combine(surface.net, samples.local_frame, _ORDERS)
    shape = fields.shape[2:]
    shrink, slope = (np.broadcast_to(part, shape).ravel() for part in (parts.shrink, parts.slope))
    return _evaluated(fields.reshape(5, 3, -1), shrink, slope, samples, form).reshape(4, *shape)


def _tangents(surface: TubeSurface, q: Floats, r: Floats) -> tuple[tuple[Floats, Floats, Floats], Floats, Floats]:
    """At points (m,): (U … r_rr (5, 3, m), S, dS/dr), and the functions of r (4, 3, m, 4) and q (3, m, 4) they use."""
    in_q, in_r = nonzero_functions(surface.basis_q, q)[0], nonzero_functions(surface.basis_r, r)[0]
    by_q = np.stack([nonzero_functions(surface.basis_q, q, order)[1] / surface.size[0] ** order for order in range(3)])
    rows, back = np.unique(r, return_inverse=True)
    parts = frame(surface, rows)
    by_r = np.take_along_axis(np.stack(parts[:4])[:, :, back], in_r[None, None], axis=3)
    net = surface.net[in_r[:, :, None], in_q[:, None, :]]
    fields = np.stack(
        [np.einsum("cmj,mjic,mi->cm", by_r[of], net, by_q[order], optimize=True) for of, order in _ORDERS]
    )
    return (fields, parts.shrink[back, 0], parts.slope[back, 0]), by_r, by_q


def differentiated_shapes(
    surface: TubeSurface, samples: Grid, kind: Ints, q: Floats, r: Floats, form: Form
) -> tuple[Floats, Floats, Ints]:
    """Measures (m,) at points, and derivatives (m, 48) with respect to the control points (m, 16), also returned."""
    arguments, by_r, by_q = _tangents(surface, q, r)
    wanted = np.zeros((len(SHAPE), len(kind)))
    wanted[kind, np.arange(len(kind))] = 1.0
    aspect = samples.size[1] / samples.size[0]
    value, slopes = _in_blocks(lambda *block: _differentiated(*block, aspect, form), (*arguments, wanted))
    entry = sum(
        np.einsum("cm,cmj,mi->mjic", slopes[k], by_r[of], by_q[order], optimize=True)
        for k, (of, order) in enumerate(_ORDERS)
    )
    points, _ = point_weights(surface, q, r)
    return value[kind, np.arange(len(kind))], np.asarray(entry).reshape(len(kind), 48), points


def _evaluated(fields: Floats, shrink: Floats, slope: Floats, samples: Grid, form: Form) -> Floats:
    """Measures (4, m) from tangents (5, 3, m), S and dS/dr (m,)."""
    aspect = samples.size[1] / samples.size[0]
    (found,) = _in_blocks(lambda *block: (_at_places(*block, aspect, form),), (fields, shrink, slope))
    return found


def _in_blocks(function: Callable[..., tuple[Array, ...]], arrays: tuple[Floats, ...]) -> tuple[Floats, ...]:
    """Apply a function of arrays (..., m) to `_BLOCK` entries of the last axis at a time."""
    count = arrays[0].shape[-1]
    answers = []
    for start in range(0, max(count, 1), _BLOCK):
        stop = min(start + _BLOCK, count)
        filled = [
            np.concatenate(
                [part := array[..., start:stop], np.ones((*part.shape[:-1], start + _BLOCK - stop))], axis=-1
            )
            for array in arrays
        ]
        answers.append([np.asarray(answer)[..., : stop - start] for answer in function(*filled)])
    return tuple(np.concatenate(parts, axis=-1) for parts in zip(*answers, strict=True))


def _measures(fields, shrink, slope, aspect, form: Form):
    return jnp.stack(pointwise(tuple(fields), shrink, slope, aspect, form))


_at_places = jax.jit(_measures, static_argnames="form")


@partial(jax.jit, static_argnames="form")
def _differentiated(fields, shrink, slope, wanted, aspect, form: Form):
    value, back = jax.vjp(lambda fields: _measures(fields, shrink, slope, aspect, form), fields)
    return value, back(wanted)[0]
