"""Linearised limits near a design: a sparse row for the worst point of every knot-span cell.

A limit on a surface must hold at infinitely many points. For each limit only the worst sample of every knot-span cell
(or half a cell) is kept, and only if it is near its bound. This gives hundreds or thousands of rows, each with the
sixteen control points on which it depends (for a distance those of both walls). The samples change from one
linearisation to the next: an exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.geometry import Body
from pneumorph.limits.certify.places import Places, Points, joined
from pneumorph.limits.table import KINDS, ROWS
from pneumorph.limits.tube.rows.samples import LimitSamples, Near, RowBlock, SampledBody

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Rows(NamedTuple):
    """Linearised limits, c + J dP ≤ 0.

    Attributes
    ----------
    kind : (m,) int
        Indices into `ROWS`.
    cell : (m,) int
        The knot-span cells, numbered over all surfaces.
    value : (m,) float
        c relative to the bound: 0.01 is one per cent beyond it.
    jacobian : csr (m, 3·n_points)
        J, per mm of the control points' coordinates; entries of the same place are to be added.
    places : {name: Points}
        Points where curvature, skew, stretch or area are close to their bounds.
    """

    kind: Ints
    cell: Ints
    value: Floats
    jacobian: sparse.csr_array
    places: Mapping[str, Points]


def linearised(
    limits: LimitSamples,
    body: Body,
    reach: float,
    least: float,
    places: Mapping[str, Points] | None = None,
    broken: Places | None = None,
) -> Rows:
    """Linearise the limits of a body.

    Parameters
    ----------
    limits : LimitSamples
    body : Body
        With nets of the shapes for which the samples were made.
    reach : float
        Distances within their bounds by up to this much get a row, mm.
    least : float
        Curvature, skew, stretch and area with c above this get a row.
    places : {name: Points}, optional
        Points of the previous linearisation, which also get rows. If only the worst point of a cell were kept,
        repairing it would alternately violate the limit at its neighbours.
    broken : Places, optional
        Places where certificates have found limits broken; they get rows too, those of curvature, skew, stretch and
        area only as a part of `places`.
    """
    at, near = SampledBody(limits, body), Near(reach, least, places)
    kinds, blocks, close = [], [], {}

    def add(numbers: list[int], found: Iterable[RowBlock]) -> None:
        for block in found:
            kinds.append(np.array(numbers)[block.kind])
            blocks.append(block)
            for name, points in block.close.items():
                close[name] = joined(close[name], points) if name in close else points

    for kind in KINDS:
        add([ROWS.index(limit.name) for limit in kind.limits], kind.rows(at, near))
    if broken is not None:
        for kind in KINDS:
            for limit in kind.limits:
                if limit.name in broken:
                    add([ROWS.index(limit.name)], kind.rows_at(at, limit.name, broken[limit.name]))
    column, entry = (np.concatenate([getattr(block, name).ravel() for block in blocks]) for name in ("column", "entry"))
    width = np.concatenate([np.full(len(block.cell), block.column.shape[1]) for block in blocks])
    start = np.concatenate([[0], np.cumsum(width)])
    jacobian = sparse.csr_array((entry, column, start), shape=(len(width), 3 * body.n_points))
    cell, value = (np.concatenate([getattr(block, name) for block in blocks]) for name in ("cell", "value"))
    return Rows(np.concatenate(kinds), cell, value, jacobian, close)
