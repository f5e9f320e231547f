"""Rows of limits on the distances between pairs of points, on two surfaces or on one."""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np

from pneumorph.limits.certify.places import Pairs
from pneumorph.limits.rows.sampled import Couples, RowBlock, SampledBody


def rows_of_couples(at: SampledBody, couples: Couples, bound: float) -> RowBlock:
    """Rows of the distances between pairs of points, which are held at fixed parameters; `bound` in mm.

    The error is of second order, because at closest points the derivatives with respect to the parameters vanish.
    """
    count = len(couples.cell)
    ways = np.zeros((count, 3)) if couples.outward is None else couples.outward
    shape = count, 3 * (couples.one.number.shape[1] + couples.other.number.shape[1])
    value, column, entry = np.empty(count), np.empty(shape, dtype=np.int64), np.empty(shape)
    into = value, column, entry
    _separate(at.body.control_points(), tuple(couples.one), tuple(couples.other), ways, bound, into)
    value += couples.less / bound
    return RowBlock(np.zeros(count, dtype=np.int64), couples.cell, value, column, entry)


def rows_at_pairs(at: SampledBody, pairs: Pairs, bound: float) -> Iterator[RowBlock]:
    """Rows of the distances between pairs of points that a certificate has found closer than a bound in mm."""
    for a, b in sorted(set(zip(pairs.surface_a.tolist(), pairs.surface_b.tolist(), strict=True))):
        some = (pairs.surface_a == a) & (pairs.surface_b == b)
        one, other = at.placed(a, pairs.a[some]), at.placed(b, pairs.b[some])
        couples = Couples(one.cell, at.sums(one), at.sums(other), less=one.margin + other.margin)
        yield rows_of_couples(at, couples, bound)


@numba.njit(cache=True, nogil=True)
def _separate(points, one, other, outward, bound, into):
    """Fill the values (m,), columns and entries (m, k) of rows, `into`; without normals `outward` is zero."""
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
