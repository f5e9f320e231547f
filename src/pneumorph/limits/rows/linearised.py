"""Linearised limits near a design: a sparse row for the worst point of every knot-span cell.

A limit on a surface must hold at infinitely many points. For each limit only the worst sample of every knot-span cell
(or half a cell) is kept, and only if it is near its bound. This gives hundreds or thousands of rows, each with the
sixteen control points on which it depends (for a distance those of both walls). The samples change from one
linearisation to the next: an exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.geometry import Body
from pneumorph.limits.certify.report import Places, Points
from pneumorph.limits.rows.distances import distances, gaps_at
from pneumorph.limits.rows.heights import heights_at
from pneumorph.limits.rows.samples import SHAPE, LimitSamples
from pneumorph.limits.rows.shape import shapes

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Rows(NamedTuple):
    """Linearised limits, c + J dP ≤ 0.

    Attributes
    ----------
    kind : (m,) int
        Indices into `KINDS`.
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
    of_shape, close = shapes(limits, body, least, places)
    parts = [*of_shape, *distances(limits, body, reach)]
    if broken is not None:
        for name, pairs in broken.pairs.items():
            parts.extend(gaps_at(limits, body, name, pairs))
        for name, points in broken.points.items():
            if name not in SHAPE:
                parts.extend(heights_at(limits, body, name, points))
    column = np.concatenate([part.column.ravel() for part in parts])
    entry = np.concatenate([part.entry.ravel() for part in parts])
    width = np.concatenate([np.full(len(part.cell), part.column.shape[1]) for part in parts])
    start = np.concatenate([[0], np.cumsum(width)])
    jacobian = sparse.csr_array((entry, column, start), shape=(len(width), 3 * body.n_points))
    kind, cell, value = (np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "cell", "value"))
    return Rows(kind, cell, value, jacobian, close)
