"""The worst samples of every half knot-span cell, and the peaks that parabolas through samples expect near them."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.constraint.sampled import CLOSE, DIGITS, FINE
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_SCALE = 10.0**DIGITS


class Picked(NamedTuple):
    """Samples (m,), and the peaks expected near them.

    Attributes
    ----------
    kind, row, column, cell : int arrays
        Kind of the values, and the sample's place and knot-span cell.
    value, expected : float arrays
        The sample's value, and that of the peak.
    aside, up : float arrays
        The peak's offsets along q and r in sample distances, at most half of one.
    """

    kind: Ints
    row: Ints
    column: Ints
    cell: Ints
    value: Floats
    expected: Floats
    aside: Floats
    up: Floats


def worst(c: Floats, spans: tuple[int, int], least: float) -> Picked:
    """Samples of values c (kinds, rows, columns), `FINE` ones, that are the worst of their half cells.

    First those with the largest values, if these are above `least`. Then those with the highest expected peaks, if
    these are close to the bound: at a kink on a knot line expectations are too high. The parabolas pass through a
    sample and its two neighbours in either direction. A peak between two samples may be several per cent above both.
    """
    found = np.empty((len(c), 2, 2 * spans[0] * spans[1]), dtype=np.int64)
    each(lambda kind: _pick(c[kind], FINE, spans, least, max(least, CLOSE), found[kind]), range(len(c)))
    by_peak, kind, half = np.nonzero(np.swapaxes(found, 0, 1) >= 0)
    row, column = np.divmod(found[kind, by_peak, half], c.shape[2])
    peaks = np.empty((len(kind), 3))
    _peaks(c, kind, row, column, peaks)
    return Picked(kind, row, column, half // 2, c[kind, row, column], *peaks.T)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _pick(c, per_span, spans, least, least_peak, found):
    """Write the worst samples of each half cell into `found` (2, halves): row times columns plus column, or -1.

    One of each half along r: if only one were kept, repairing it would alternately violate the other. Rounding errors
    must not decide between the equivalent samples of an axisymmetric body: the first of those that are equal when
    rounded is taken.
    """
    rows, columns = c.shape
    found[:] = -1
    best = np.empty(found.shape)
    for row in range(rows):
        start = 2 * min(row // per_span[1], spans[1] - 1) * spans[0] + 2 * row // per_span[1] % 2
        for column in range(columns):
            half = start + 2 * (column // per_span[0])
            if c[row, column] > least:
                value = np.rint(_SCALE * c[row, column])
                if found[0, half] < 0 or value > best[0, half]:
                    found[0, half], best[0, half] = row * columns + column, value
            if _highest(c, row, column) > least_peak:
                expected = _peak(c, row, column)[0]
                if expected > least_peak:
                    value = np.rint(_SCALE * expected)
                    if found[1, half] < 0 or value > best[1, half]:
                        found[1, half], best[1, half] = row * columns + column, value


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _peaks(c, kind, row, column, peaks):
    """Fill `peaks` (m, 3) with expected values and offsets."""
    for m in range(len(kind)):
        peaks[m, 0], peaks[m, 1], peaks[m, 2] = _peak(c[kind[m]], row[m], column[m])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _highest(c, row, column):
    """Quickly, a value that a peak near a sample does not exceed."""
    columns, inside = c.shape[1], min(max(row, 1), len(c) - 2)
    before, after = c[row, column - 1], c[row, column + 1 if column + 1 < columns else 0]
    below, above = c[inside - 1, column], c[inside + 1, column]
    slopes = abs(after - before) + abs(above - below)
    bends = abs(2.0 * c[row, column] - before - after) + abs(2.0 * c[inside, column] - below - above)
    return c[row, column] + 0.25 * slopes + 0.375 * bends + 4.0 / _SCALE


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _peak(c, row, column):
    """The value expected at the peak near a sample, and its offsets along q and r."""
    columns, here = c.shape[1], c[row, column]
    # The first and last rows belong to the parabolas of their inner neighbours.
    inside = min(max(row, 1), len(c) - 2)
    aside, rise_q = _summit(c[row, column - 1], here, c[row, column + 1 if column + 1 < columns else 0], 0.0)
    up, rise_r = _summit(c[inside - 1, column], c[inside, column], c[inside + 1, column], float(row - inside))
    return here + rise_q + rise_r, aside, up


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _summit(before, here, after, start):
    """Offset from `start` to the peak of a parabola through values at -1, 0, 1, and its rise from there.

    The peak is sought within half a step of `start`, but not beyond the three values.
    """
    bend, slope = np.rint(_SCALE * (2.0 * here - before - after)) / _SCALE, np.rint(_SCALE * (after - before)) / _SCALE
    place = 0.5 * slope / bend if bend > 0.0 else np.sign(slope)
    place = min(max(place, max(start - 0.5, -1.0)), min(start + 0.5, 1.0))
    rise = 0.5 * (slope * (place - start) - bend * (place * place - start * start))
    return place - start, max(rise, 0.0)
