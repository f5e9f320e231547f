"""Linearised limits near a design: a sparse row for the worst point of every cell of its surfaces.

A limit on a surface must hold at infinitely many points. For each limit only the worst sample of every cell (a knot
span of a spline, or half of one) is kept, and only if it is near its bound. This gives hundreds or thousands of rows,
each with the few control points on which it depends (for a distance those of both walls). The samples change from one
linearisation to the next: an exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.limits.certify.places import Places, Points, joined
from pneumorph.limits.kinds.kind import Kind, Sampled
from pneumorph.limits.rows.sampled import Near, RowBlock
from pneumorph.limits.table import ROWS
from pneumorph.threads import each

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Rows(NamedTuple):
    """Linearised limits, c + J dP ≤ 0.

    Attributes
    ----------
    kind : (m,) int
        Indices into `ROWS`.
    cell : (m,) int
        The cells, numbered over all surfaces.
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
    kinds: Sequence[Kind[Sampled, Any, Any]],
    at: Sampled,
    reach: float,
    least: float,
    places: Mapping[str, Points] | None = None,
    violated: Places | None = None,
) -> Rows:
    """Linearise the limits of a body.

    Parameters
    ----------
    kinds : sequence of Kind
        Of limits.
    at : SampledBody
        The body at its samples.
    reach : float
        Distances within their bounds by up to this much get a row, mm.
    least : float
        Curvature, skew, stretch and area with c above this get a row.
    places : {name: Points}, optional
        Points of the previous linearisation, which also get rows. If only the worst point of a cell were kept,
        repairing it would alternately violate the limit at its neighbours.
    violated : Places, optional
        Places where certificates have found limits violated; they get rows too, those of curvature, skew, stretch and
        area only as a part of `places`.
    """
    near = Near(reach, least, places)
    numbers, blocks, close = [], [], {}

    def add(own: list[int], more: Iterable[RowBlock]) -> None:
        for block in more:
            numbers.append(np.array(own)[block.kind])
            blocks.append(block)
            for name, points in block.close.items():
                close[name] = joined(close[name], points) if name in close else points

    # Most of the time goes into kernels that release the Python lock.
    found = each(lambda kind: list(kind.rows(at, near)), kinds)
    for kind, more in zip(kinds, found, strict=True):
        add([ROWS.index(limit.name) for limit in kind.limits], more)
    if violated is not None:
        for kind in kinds:
            for limit in kind.limits:
                if limit.name in violated:
                    add([ROWS.index(limit.name)], kind.rows_at(at, limit.name, violated[limit.name]))
    if not blocks:
        none = np.zeros(0, dtype=int)
        return Rows(none, none, np.zeros(0), sparse.csr_array((0, 3 * at.body.n_points)), close)
    column, entry = (np.concatenate([getattr(block, name).ravel() for block in blocks]) for name in ("column", "entry"))
    width = np.concatenate([np.full(len(block.cell), block.column.shape[1]) for block in blocks])
    start = np.concatenate([[0], np.cumsum(width)])
    jacobian = sparse.csr_array((entry, column, start), shape=(len(width), 3 * at.body.n_points))
    cell, value = (np.concatenate([getattr(block, name) for block in blocks]) for name in ("cell", "value"))
    return Rows(np.concatenate(numbers), cell, value, jacobian, close)
