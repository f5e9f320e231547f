"""Compiled evaluation of curvature, skew, stretch and area on samples and at any points of a surface.

Every point depends on sixteen control points, and only these are looked at.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.local import pieces
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.tube.measures.derivatives import FLAGS, differentiate, forms_of, measures_of
from pneumorph.limits.tube.measures.formulas import Form
from pneumorph.limits.tube.measures.grid import Grid
from pneumorph.limits.tube.measures.pole_frame import Meridian, local_frame, meridian, side_of
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_ROWS, _POINTS = 64, 512  # rows of samples, and points, that a thread takes at once


class _Tube(NamedTuple):
    """A surface as compiled code takes it: its net in the frames of base and tip (2, n_r, n_q, 3), its basis functions,
    and how stretch is measured."""

    nets: Floats
    pieces_q: Floats
    size: tuple[float, float]
    meridian: Meridian
    per_mm: bool


def _tube(surface: TubeSurface, form: Form) -> _Tube:
    along = meridian(surface)
    nets = np.stack([np.asarray(surface.net, dtype=float) @ turn for turn in along.turns])
    tau_q, tau_r = (float(extent) for extent in surface.size)
    return _Tube(nets, pieces(surface.basis_q), (tau_q, tau_r), along, form == "per_mm")


def measured_samples(surface: TubeSurface, samples: Grid, form: Form, some: NDArray[np.bool_] | None = None) -> Floats:
    """All measures (4, rows, columns) on the samples, or on some (rows, columns) of them; NaN on the others."""
    wanted = np.ones(samples.shape, dtype=bool) if some is None else some
    tube, measured = _tube(surface, form), np.full((4, *samples.shape), np.nan)
    parts = samples.frame

    def work(some: slice) -> None:
        by_r = samples.support_r[some], samples.local_frame[:, :, some], parts.shrink[some, 0], parts.slope[some, 0]
        by_q = samples.support_q, samples.local_q
        _measure_rows(tube, parts.side[some], *by_r, *by_q, wanted[some], measured[:, some])

    each(work, [slice(first, first + _ROWS) for first in range(0, len(samples.r), _ROWS)])
    return measured


def measured(surface: TubeSurface, kind: Ints, q: Floats, r: Floats, form: Form) -> Floats:
    """One measure (m,) at each of the points.

    Parameters
    ----------
    surface : TubeSurface
    kind : (m,) int array
        0 to 3 for curvature, skew, stretch and area.
    q, r : (m,) arrays
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    """
    tube, value = _tube(surface, form), np.empty(len(kind))

    def work(some: slice) -> None:
        _measure(tube, kind[some], q[some], r[some], value[some])

    each(work, [slice(first, first + _POINTS) for first in range(0, len(kind), _POINTS)])
    return value


def differentiated(surface: TubeSurface, kind: Ints, q: Floats, r: Floats, form: Form) -> tuple[Floats, Floats, Ints]:
    """One measure (m,) at each point, and its derivatives (m, 48) with respect to coordinates of the net.

    The third result is the numbers (m, 48) of these coordinates.

    Parameters
    ----------
    surface : TubeSurface
    kind : (m,) int array
        0 to 3 for curvature, skew, stretch and area.
    q, r : (m,) arrays
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    """
    tube, value = _tube(surface, form), np.empty(len(kind))
    entry, number = np.empty((len(kind), 4, 4, 3)), np.empty((len(kind), 4, 4, 3), dtype=np.int64)

    def work(some: slice) -> None:
        _differentiate(tube, kind[some], q[some], r[some], value[some], entry[some], number[some])

    each(work, [slice(first, first + _POINTS) for first in range(0, len(kind), _POINTS)])
    return value, entry.reshape(-1, 48), number.reshape(-1, 48)


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def _measure_rows(tube, side, support_r, by_r, shrink, slope, support_q, by_q, wanted, into):
    """Fill `into` (4, rows, columns) with the measures on the `wanted` (rows, columns) samples."""
    aspect = tube.size[1] / tube.size[0]
    lines, tangents = np.empty((tube.nets.shape[2], 4, 3)), np.empty((5, 3))
    for row in range(len(support_r)):
        net = tube.nets[side[row]]
        # The net's columns, combined by the functions of r.
        for j in range(len(lines)):
            for k in range(4):
                for c in range(3):
                    value = 0.0
                    for i in range(4):
                        value += by_r[k, c, row, i] * net[support_r[row, i], j, c]
                    lines[j, k, c] = value
        for column in range(len(support_q)):
            if not wanted[row, column]:
                continue
            tangents[:] = 0.0
            for j in range(4):
                line, b = lines[support_q[column, j]], by_q[:, column, j]
                for c in range(3):
                    tangents[0, c] += b[1] * line[0, c]
                    tangents[1, c] += b[0] * line[1, c]
                    tangents[2, c] += b[2] * line[0, c]
                    tangents[3, c] += b[1] * line[2, c]
                    tangents[4, c] += b[0] * line[3, c]
            values = measures_of(forms_of(tangents, shrink[row], slope[row]), aspect, tube.per_mm)
            into[0, row, column], into[1, row, column], into[2, row, column], into[3, row, column] = values


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def _measure(tube, kind, q, r, value):
    """Fill `value` with one measure at each of the points."""
    by_q, by_r, tangents = np.empty((3, 4)), np.empty((4, 3, 4)), np.empty((5, 3))
    for m in range(len(kind)):
        _, _, S, S_r = _tangents(tube, q[m], r[m], by_q, by_r, tangents)
        f = forms_of(tangents, S, S_r)
        value[m] = measures_of(f, tube.size[1] / tube.size[0], tube.per_mm)[kind[m]]


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def _differentiate(tube, kind, q, r, value, entry, number):
    """Fill `value`, `entry` and `number` (…, 4, 4, 3), see `differentiated`."""
    aspect, columns = tube.size[1] / tube.size[0], tube.nets.shape[2]
    by_q, by_r = np.empty((3, 4)), np.empty((4, 3, 4))
    tangents, slopes, own = np.empty((5, 3)), np.empty((5, 3)), np.empty((3, 3))
    for m in range(len(kind)):
        row, column, S, S_r = _tangents(tube, q[m], r[m], by_q, by_r, tangents)
        value[m] = differentiate(kind[m], tangents, S, S_r, aspect, tube.per_mm, slopes)
        turn = tube.meridian.turns[side_of(tube.meridian.base, tube.meridian.tip, r[m])]
        for j in range(4):
            for d in range(3):
                # The derivatives with respect to the three combinations of row j of the turned net by functions of q.
                own[0, d] = slopes[1, d] * by_r[1, d, j] + slopes[4, d] * by_r[3, d, j]
                own[1, d] = slopes[0, d] * by_r[0, d, j] + slopes[3, d] * by_r[2, d, j]
                own[2, d] = slopes[2, d] * by_r[0, d, j]
            for c in range(3):
                zeroth, first, second = 0.0, 0.0, 0.0
                for d in range(3):
                    zeroth += turn[c, d] * own[0, d]
                    first += turn[c, d] * own[1, d]
                    second += turn[c, d] * own[2, d]
                for i in range(4):
                    entry[m, j, i, c] = zeroth * by_q[0, i] + first * by_q[1, i] + second * by_q[2, i]
                    number[m, j, i, c] = 3 * ((row + j) * columns + (column + i) % columns) + c


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def _tangents(tube, q, r, by_q, by_r, tangents):
    """Write U, r_r, U_q, U_r and r_rr (5, 3), and the functions of q (3, 4) and r (4, 3, 4), at a point.

    Returns the first row and column of the net on which they depend, S and dS/dr.
    """
    columns = len(tube.pieces_q)
    q = q % 1.0
    span = min(int(q * columns), columns - 1)
    u, rate = q * columns - span, columns / tube.size[0]
    for i in range(4):
        a = tube.pieces_q[span, i]
        by_q[0, i] = a[0] + u * (a[1] + u * (a[2] + u * a[3]))
        by_q[1, i] = rate * (a[1] + u * (2.0 * a[2] + u * 3.0 * a[3]))
        by_q[2, i] = rate * rate * (2.0 * a[2] + u * 6.0 * a[3])
    row, S, S_r = local_frame(tube.meridian, r, by_r)
    net = tube.nets[side_of(tube.meridian.base, tube.meridian.tip, r)]
    tangents[:] = 0.0
    for j in range(4):
        for c in range(3):
            zeroth, first, second = 0.0, 0.0, 0.0
            for i in range(4):
                x = net[row + j, (span - 1 + i) % columns, c]
                zeroth, first, second = zeroth + by_q[0, i] * x, first + by_q[1, i] * x, second + by_q[2, i] * x
            tangents[0, c] += by_r[0, c, j] * first
            tangents[1, c] += by_r[1, c, j] * zeroth
            tangents[2, c] += by_r[0, c, j] * second
            tangents[3, c] += by_r[2, c, j] * first
            tangents[4, c] += by_r[3, c, j] * zeroth
    return row, span - 1, S, S_r
