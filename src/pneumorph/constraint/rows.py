"""The limits that matter near a design, linearised: the worst place of every knot-span cell as a sparse row.

A limit on a surface holds at infinitely many points. Of each cell of a control net (or half of one) only the worst
sample of each limit is kept, and only where it is near its bound: hundreds or thousands of rows, each with the sixteen
control points that move it (those of both walls for a distance). Which samples these are changes from one linearisation
to the next: an exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.constraint.distance_rows import distances, gaps
from pneumorph.constraint.report import Pairs, Points
from pneumorph.constraint.sampled import LimitSamples
from pneumorph.constraint.shape_rows import shapes
from pneumorph.geometry import Body

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Rows(NamedTuple):
    """Linearised limits, c + J dP ≤ 0.

    Attributes
    ----------
    kind : (m,) int, which of `KINDS`.
    cell : (m,) int, the knot-span cell, numbered through all surfaces.
    value : (m,) c relative to the bound: 0.01 is one per cent beyond it.
    jacobian : csr (m, 3·n_points), per mm of the control points' coordinates.
    places : {name: Points}
        Of the measures of shape that are close to their bounds.
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
    pairs: Mapping[str, Pairs] | None = None,
) -> Rows:
    """Linearise the limits of a body.

    Parameters
    ----------
    limits : LimitSamples
    body : Body
        Of the net shapes that the samples are for.
    reach : float
        Distances in mm up to this much within their bound give a row.
    least : float
        Measures of the shape with c above this give a row.
    places : {name: Points}, optional
        Of measures of shape, rows of their own: those of the linearisation before. Where the worst place of a cell
        alone is kept, motions that fix it spoil its neighbours by turns.
    pairs : {name: Pairs}, optional
        Pairs of places, "wall" and "fold", where a certificate has found them too close: rows of their own.
    """
    of_shape, close = shapes(limits, body, least, places)
    parts = [*of_shape, *distances(limits, body, reach)]
    if pairs is not None:
        parts.extend(gaps(limits, body, name, pairs[name]) for name in ("wall", "fold"))
    column = np.concatenate([part.column.ravel() for part in parts])
    entry = np.concatenate([part.entry.ravel() for part in parts])
    width = np.concatenate([np.full(len(part.cell), part.column.shape[1]) for part in parts])
    start = np.concatenate([[0], np.cumsum(width)])
    jacobian = sparse.csr_array((entry, column, start), shape=(len(width), 3 * body.n_points))
    jacobian.sum_duplicates()
    kind, cell, value = (np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "cell", "value"))
    return Rows(kind, cell, value, jacobian, close)
