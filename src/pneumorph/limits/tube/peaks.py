"""Peaks between samples, estimated by parabolas through a sample and its two neighbours in either direction.

A peak between two samples may be several per cent above both.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.rows.sampled import CLOSE, DIGITS, rounded
from pneumorph.limits.tube.measures.grid import Grid
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


def expected_peaks(c: Floats, least: float, own: NDArray[np.bool_]) -> Floats:
    """Estimated peaks near own samples of c (kinds, rows, columns); minus infinity where they are not above `least`."""
    peaks = np.full_like(c, -np.inf)
    each(lambda kind: _expect(c[kind], least, own, peaks[kind]), range(len(c)))
    return peaks


def peaks_at(c: Floats, kind: Ints, row: Ints, column: Ints) -> tuple[Floats, Floats, Floats]:
    """Estimated peaks (m,) near some of the samples, and their offsets along q and r.

    Offsets are in sample distances, at most half of one.

    Parameters
    ----------
    c : (kinds, rows, columns) array
    kind, row, column : (m,) int arrays
        The samples.
    """
    value, aside, up = np.empty((3, len(kind)))
    _locate(c, kind, row, column, value, aside, up)
    return value, aside, up


def beside(samples: Grid, c: Floats, row: Ints, column: Ints) -> tuple[Floats, Floats]:
    """q and r (m,) of some samples of c (rows, columns), those near their bound moved to the peaks expected there."""
    peak, aside, up = peaks_at(c[None], np.zeros(len(row), dtype=np.int64), row, column)
    return at_offset(samples, row, column, *np.where(peak > CLOSE, (aside, up), 0.0))


def at_offset(samples: Grid, row: Ints, column: Ints, aside: Floats, up: Floats) -> tuple[Floats, Floats]:
    """q and r (m,) of points at offsets from samples of a surface.

    Parameters
    ----------
    samples : Grid
    row, column : (m,) int arrays
    aside, up : (m,) arrays
        Along q and r, in sample distances.
    """
    q = (samples.q[column] + aside / len(samples.q)) % 1.0
    return q, np.clip(samples.r[row] + up / (len(samples.r) - 1), 0.0, 1.0)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect(c, least, own, into):
    """Write the values of `expected_peaks` for one kind, where they are above `least`, to `into` (rows, columns)."""
    for row in range(c.shape[0]):
        for column in range(c.shape[1]):
            if own[row, column] and _highest(c, row, column) > least:
                value = _peak(c, row, column)[0]
                if value > least:
                    into[row, column] = value


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _locate(c, kind, row, column, value, aside, up):
    """The results of `peaks_at`, into the last three arguments."""
    for m in range(len(kind)):
        value[m], aside[m], up[m] = _peak(c[kind[m]], row[m], column[m])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _highest(c, row, column):
    """Quickly, a value that a peak near a sample does not exceed."""
    columns, inside = c.shape[1], min(max(row, 1), len(c) - 2)
    before, after = c[row, column - 1], c[row, column + 1 if column + 1 < columns else 0]
    below, above = c[inside - 1, column], c[inside + 1, column]
    slopes = abs(after - before) + abs(above - below)
    bends = abs(2.0 * c[row, column] - before - after) + abs(2.0 * c[inside, column] - below - above)
    return c[row, column] + 0.25 * slopes + 0.375 * bends + 4.0 * 10.0**-DIGITS


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

    The peak is sought within half a step of `start`, not beyond the three values, and not where one is infinite.
    """
    bend, slope = rounded(2.0 * here - before - after), rounded(after - before)
    if not np.isfinite(bend):
        return 0.0, 0.0
    place = 0.5 * slope / bend if bend > 0.0 else np.sign(slope)
    place = min(max(place, max(start - 0.5, -1.0)), min(start + 0.5, 1.0))
    rise = 0.5 * (slope * (place - start) - bend * (place * place - start * start))
    return place - start, max(rise, 0.0)
