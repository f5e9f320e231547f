"""Samples that rows are chosen from, and the choice: the worst of every knot-span cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumorph.constraint.sampling import Grid, grid
from pneumorph.constraint.table import TABLE
from pneumorph.geometry import Body

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

SHAPE = ("curvature", "skew", "stretch", "area")
KINDS = (*SHAPE, *(limit.name for limit in TABLE if limit.name not in SHAPE))
"""Kinds of rows: the limits of the table, in the order in which they are numbered."""

FINE, COARSE = (4, 8), (2, 4)
"""Samples to each knot span in q and r: of what curvature and the like peak in, and of what distances start from."""


CLOSE = -0.03
"""Where c is above this, what is limited is followed to its worst place between samples."""

DIGITS = 9
"""Values that are equal to so many digits are equal."""


class RowBlock(NamedTuple):
    """Some rows of one kind: cells and values (m,), columns and entries (m, k)."""

    kind: Ints
    cell: Ints
    value: Floats
    column: Ints
    entry: Floats


@dataclass(frozen=True, eq=False)
class LimitSamples:
    """The limits of a problem on samples from which rows are chosen; make it with `sample_limits`.

    Attributes
    ----------
    spec : problem.Limits
    length : float
        Of the body, mm: its end discs lie at z = 0 and z = length.
    fine, coarse : tuples of Grid
        Samples of each surface, see `FINE` and `COARSE`.
    spans : tuple of (int, int)
        Knot spans of each surface in q and in r.
    """

    spec: Limits
    length: float
    fine: tuple[Grid, ...]
    coarse: tuple[Grid, ...]
    spans: tuple[tuple[int, int], ...]

    @property
    def first(self) -> Ints:
        """Number of each surface's first cell, and last the number of all cells."""
        return np.concatenate([[0], np.cumsum([around * along for around, along in self.spans])])


def sample_limits(body: Body, spec: Limits) -> LimitSamples:
    """Samples for a body, of which only what never changes in a run is taken: net shapes, starting sizes, length."""
    return LimitSamples(
        spec=spec,
        length=float(body.exterior.net[-1, 0, 2]),
        fine=tuple(grid(surface, FINE) for surface in body.surfaces),
        coarse=tuple(grid(surface, COARSE) for surface in body.surfaces),
        spans=tuple((surface.basis_q.spans, surface.basis_r.spans) for surface in body.surfaces),
    )


def cell_of(limits: LimitSamples, number: int, q: Floats, r: Floats) -> Ints:
    """Cells of places given by their parameters."""
    around, along = limits.spans[number]
    return np.minimum((r * along).astype(np.int64), along - 1) * around + (q % 1.0 * around).astype(np.int64)


def worst_samples(
    c: Floats, per_span: tuple[int, int], spans: tuple[int, int], least: float
) -> tuple[Ints, Ints, Ints]:
    """Row, column and cell of the worst samples of each cell, of values (rows, columns) above `least`."""
    row, column = np.nonzero(c > least)
    cell = np.minimum(row // per_span[1], spans[1] - 1) * spans[0] + column // per_span[0]
    # Of both halves along r: where one alone is kept, motions that fix it spoil the other by turns.
    half = 2 * cell + 2 * row // per_span[1] % 2
    pick = worst_of_cells(c[row, column], half)
    return row[pick], column[pick], cell[pick]


def worst_of_cells(c: Floats, cell: Ints) -> Ints:
    """Which of some values is the largest of its cell, a number for each cell; the first of those that are equal."""
    # Rounding must not choose among the samples of a body that is the same all round.
    order = np.lexsort((-np.round(c, DIGITS), cell))
    return order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
