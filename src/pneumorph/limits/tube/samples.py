"""Samples of tubes, and the choice among them: the worst sample of every knot-span cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import KDTree

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Region
from pneumorph.geometry.tube.local import point_weights
from pneumorph.geometry.tube.surface import between_ends
from pneumorph.limits.rows.sampled import rounded
from pneumorph.limits.tube.measures.grid import Grid, grid

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

FINE, COARSE = (4, 8), (2, 4)
"""Samples per knot span in q and r: fine ones for curvature, skew, stretch and area, coarse ones for distances."""

BESIDE, SAME = 1e-3, 1e-6
"""Distance in r from the ends at which samples of an end are compared, and in mm within which they are the same."""


@dataclass(frozen=True, eq=False)
class LimitSamples:
    """The limits of a problem and the samples from which rows are chosen; built by `sample_limits`.

    Attributes
    ----------
    spec : problem.Limits
    between : Region
        What is between the planes of the body's ends, in which its end discs lie.
    fine, coarse : tuples of Grid
        Samples of each surface, see `FINE` and `COARSE`.
    spans : tuple of (int, int)
        Knot spans of each surface in q and in r.
    own_fine, own_coarse : tuples of (rows, columns) bool
        Of samples that are images of each other in a symmetric body, the first: no other has a row.
    own_spans : tuple of (n,) bool
        Of its knot spans that are images of each other, the first: no other is certified.
    """

    spec: Limits
    between: Region
    fine: tuple[Grid, ...]
    coarse: tuple[Grid, ...]
    spans: tuple[tuple[int, int], ...]
    own_fine: tuple[Mask, ...]
    own_coarse: tuple[Mask, ...]
    own_spans: tuple[Mask, ...]

    @cached_property
    def seen_fine(self) -> tuple[Mask, ...]:
        """Of the fine samples those that are own, and the neighbours from which peaks are expected (`peaks.py`)."""
        return tuple(map(_with_neighbours, self.own_fine))

    @property
    def first(self) -> Ints:
        """Index of each surface's first knot-span cell, and finally the number of all cells."""
        return np.concatenate([[0], np.cumsum([around * along for around, along in self.spans])])


def sample_limits(body: Body, spec: Limits, group: Sequence[Floats] = ()) -> LimitSamples:
    """Build the samples for all bodies of a run, which share net shapes, starting sizes, ends and symmetry.

    The operations (3, 3) of the symmetry group act about (0, 0, length/2).
    """
    fine = tuple(grid(surface, FINE) for surface in body.surfaces)
    coarse = tuple(grid(surface, COARSE) for surface in body.surfaces)
    spans = tuple((surface.basis_q.spans, surface.basis_r.spans) for surface in body.surfaces)
    middles = [tuple((np.arange(count) + 0.5) / count for count in counts) for counts in spans]
    return LimitSamples(
        spec=spec,
        between=between_ends(body),
        fine=fine,
        coarse=coarse,
        spans=spans,
        own_fine=_own(body, [(each.q, each.r) for each in fine], group),
        own_coarse=_own(body, [(each.q, each.r) for each in coarse], group),
        own_spans=tuple(mask.ravel() for mask in _own(body, middles, group)),
    )


def _own(body: Body, samples: Sequence[tuple[Floats, ...]], group: Sequence[Floats]) -> tuple[Mask, ...]:
    """Of samples that the operations carry to each other, the first: a mask (rows, columns) for each surface, whose
    samples are given by their q (columns,) and r (rows,)."""
    shapes = [(len(r), len(q)) for q, r in samples]
    places = []
    for surface, (q, along) in zip(body.surfaces, samples, strict=True):
        # All samples of a pole are one point, so the places are those beside it.
        r = np.clip(along, BESIDE, 1.0 - BESIDE)
        numbers, weights = point_weights(surface, np.tile(q, len(r)), np.repeat(r, len(q)))
        places.append(np.einsum("mk,mkc->mc", weights, surface.net.reshape(-1, 3)[numbers]))
    x = np.concatenate(places)
    centre, tree, first = np.array([0.0, 0.0, body.exterior.net[-1, 0, 2] / 2.0]), KDTree(x), np.arange(len(x))
    # The identity is the first.
    for operation in group[1:]:
        distance, image = tree.query((x - centre) @ operation.T + centre, distance_upper_bound=SAME)
        first = np.where(distance < SAME, np.minimum(first, image), first)
    split = np.split(first == np.arange(len(x)), np.cumsum([rows * columns for rows, columns in shapes])[:-1])
    return tuple(mask.reshape(shape) for mask, shape in zip(split, shapes, strict=True))


def _with_neighbours(own: Mask) -> Mask:
    """Samples (rows, columns) of a closed surface at most two from own ones along it, or one around it."""
    along = maximum_filter1d(own.astype(np.uint8), 5, axis=0, mode="constant")
    return maximum_filter1d(along, 3, axis=1, mode="wrap") > 0


def cell_of(limits: LimitSamples, number: int, q: Floats, r: Floats) -> Ints:
    """Knot-span cells (n,) of points (q, r) on the surface with index `number`.

    Parameters
    ----------
    limits : LimitSamples
    number : int
    q, r : (n,) arrays
    """
    around, along = limits.spans[number]
    return np.minimum((r * along).astype(np.int64), along - 1) * around + (q % 1.0 * around).astype(np.int64)


def worst_samples(
    c: Floats, own: Mask, per_span: tuple[int, int], spans: tuple[int, int], least: float
) -> tuple[Ints, Ints, Ints]:
    """Row, column and cell of the worst `own` samples of each cell, for values c (rows, columns) above `least`.

    Parameters
    ----------
    c : (rows, columns) array
    own : (rows, columns) bool array
        Samples that may have rows.
    per_span, spans : (int, int)
        Samples per knot span, and knot spans, in q and in r.
    least : float
    """
    # One of each half along r: if only one were kept, repairing it would alternately violate the other.
    worst = np.full(2 * spans[0] * spans[1], -1)
    _pick(np.ascontiguousarray(c, dtype=float), own, per_span, spans, float(least), worst)
    half = np.flatnonzero(worst >= 0)
    row, column = np.divmod(worst[half], c.shape[1])
    return row, column, half // 2


@numba.njit(cache=True, nogil=True)
def _pick(c, own, per_span, spans, least, into):
    """Write the worst samples above `least` to `into` (halves of cells,) by their indices; the first of equal ones."""
    best = np.empty(len(into))
    for row in range(c.shape[0]):
        first = 2 * min(row // per_span[1], spans[1] - 1) * spans[0] + 2 * row // per_span[1] % 2
        for column in range(c.shape[1]):
            if own[row, column] and c[row, column] > least:
                half, value = first + 2 * (column // per_span[0]), rounded(c[row, column])
                if into[half] < 0 or value > best[half]:
                    into[half], best[half] = row * c.shape[1] + column, value
