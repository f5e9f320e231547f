"""Cells of a surface on which limits are bounded, and their subdivision until the bounds are accurate enough.

A surface is one polynomial on every knot span (a rectangle in q and r between neighbouring knots). Cells are rectangles
within knot spans. Larger is worse for all quantities here; distances therefore have their sign changed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import comb, factorial
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Basis
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.enclosed import Accuracy, CellBounds
from pneumorph.limits.tube.points import on_tube

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

_ROUNDS = 9  # of halving cells
_MAX_CELLS = 300  # cells per knot span in all rounds


class KnotSpans(NamedTuple):
    """Knot spans of a surface as polynomials in u, v ∈ [0, 1], where q = q₀ + u Δq and r = r₀ + v Δr.

    Attributes
    ----------
    x : (n, 3, 4, 4) array
        Coefficients of v^i u^j, mm.
    q, r : (n, 2) arrays
        Start and width. The direction of r is reversed in spans at a tip's pole, so that poles are always at v = 0.
    own : (n,) array of bool
        Which are bounded; in a symmetric body the others are images of these.
    """

    x: Floats
    q: Floats
    r: Floats
    own: Mask


class Cells(NamedTuple):
    """Rectangles within knot spans: index of the span (n,); centre (n, 2) and half the width (n, 2) in u and v."""

    span: Ints
    centre: Floats
    half: Floats

    def select(self, which: NDArray[np.bool_] | slice) -> Cells:
        """Some of the cells."""
        return Cells(self.span[which], self.centre[which], self.half[which])


class Bounds(NamedTuple):
    """Bounds of m quantities on n cells.

    Attributes
    ----------
    upper, attained : (n, m) arrays
        Certified upper bound, and a value that some point of the cell attains.
    place : (n, m, 2) array
        That point on the cell, from -1 to 1 in u and v.
    vary : (n, 2) array
        Measure of the variation along u and v, which decides how the cell is halved.
    """

    upper: Floats
    attained: Floats
    place: Floats
    vary: Floats


def power(basis: Basis) -> Floats:
    """Coefficients (spans, 4, count) of the basis functions in powers of u on every knot span."""
    # Expanded about the middle, where rounding cannot select the wrong side of a knot.
    width = 1.0 / basis.spans
    middle = (np.arange(basis.spans) + 0.5) * width
    about = np.stack([basis.matrix(middle, k) * width**k / factorial(k) for k in range(4)], axis=1)
    return _shift(np.full(1, -0.5), np.ones(1)) @ about


def knot_spans(surface: TubeSurface, own: Mask | None = None) -> KnotSpans:
    """The knot spans of a surface, row by row; those to bound (n,) are all of them by default."""
    along, around = power(surface.basis_r), power(surface.basis_q)
    rows, columns = len(along), len(around)
    x = np.einsum("aij,jkc,bmk->abcim", along, surface.net, around, optimize=True)
    q = np.stack([surface.basis_q.breaks[:-1], np.full(columns, 1.0 / columns)], axis=1)
    r = np.stack([surface.basis_r.breaks[:-1], np.full(rows, 1.0 / rows)], axis=1)
    if surface.poles[1]:
        x[-1] = np.einsum("ij,bcjm->bcim", BACKWARDS, x[-1])
        r[-1] = 1.0, -1.0 / rows
    own = np.ones(rows * columns, dtype=bool) if own is None else own
    return KnotSpans(x.reshape(-1, 3, 4, 4), np.tile(q, (rows, 1)), np.repeat(r, columns, axis=0), own)


def recentred(coefficients: Floats, cells: Cells) -> Floats:
    """Coefficients (n, f, 4, 4) in s, t ∈ [-1, 1] on the cells, from (n, f, 4, 4) in u and v."""
    local = np.empty(coefficients.shape)
    # In one order, for which the kernels are compiled once.
    _recentre_each(np.ascontiguousarray(coefficients), cells.centre, cells.half, local)
    return local


@numba.njit(cache=True)
def _recentre_each(coefficients, centre, half, local):
    for n in range(len(coefficients)):
        recentre(coefficients[n], centre[n], half[n], local[n])


@numba.njit(cache=True)
def recentre(coefficients, centre, half, local):
    """The same for the polynomials (f, 4, 4) on one cell, into `local` (f, 4, 4).

    Parameters
    ----------
    coefficients : (f, 4, 4) array
        Of v^i u^j.
    centre, half : (2,) arrays
        Centre of the cell and half its width, in u and v.
    local : (f, 4, 4) array
        Overwritten by the coefficients in s and t.
    """
    along, around = np.zeros((4, 4)), np.zeros((4, 4))
    for matrix, k in ((along, 1), (around, 0)):
        for i in range(4):
            # Row by row, Pascal's triangle of (centre + half·s)^i.
            matrix[i, 0] = centre[k] * matrix[i - 1, 0] if i else 1.0
            for m in range(1, i + 1):
                matrix[i, m] = centre[k] * matrix[i - 1, m] + half[k] * matrix[i - 1, m - 1]
    for f in range(len(coefficients)):
        for i in range(4):
            for m in range(4):
                local[f, i, m] = 0.0
        for i in range(4):
            for m in range(4):
                value = 0.0
                for j in range(m, 4):
                    value += coefficients[f, i, j] * around[j, m]
                for n in range(i + 1):
                    local[f, n, m] += along[i, n] * value


def derivative(coefficients: Floats, axis: int) -> Floats:
    """Coefficients of the derivative with respect to v (axis -2) or u (axis -1), in the same shape."""
    moved = np.moveaxis(coefficients, axis, -1)
    derived = np.zeros_like(moved)
    derived[..., :-1] = moved[..., 1:] * np.arange(1, 4)
    return np.moveaxis(derived, -1, axis)


def refine(
    evaluate: Callable[[Cells], Bounds],
    start: Cells,
    accuracies: Sequence[Accuracy],
    worst: Sequence[float],
    count: int,
) -> tuple[Floats, Floats, Floats]:
    """Bound quantities on knot spans, halving cells until the bounds are as accurate as required.

    Parameters
    ----------
    evaluate : function of Cells
        Returns the Bounds of m quantities.
    start : Cells
    accuracies : sequence of m Accuracy
    worst : sequence of m floats
        Worst value of each quantity attained elsewhere.
    count : int
        Number of knot spans.

    Returns
    -------
    upper, attained : (count, m) arrays
    place : (count, m, 2) array
        Where `attained` is attained, in u and v.
    """
    m = len(accuracies)
    upper, attained, place = np.full((count, m), -np.inf), np.full((count, m), -np.inf), np.zeros((count, m, 2))
    cells, left = start, _MAX_CELLS * count
    for round in range(_ROUNDS + 1):
        bounds = evaluate(cells)
        _raise(cells, bounds, attained, place)
        enough = [
            np.maximum(accuracy.enough(attained[:, k].max(), known), accuracy.close(attained[:, k]))
            for k, (accuracy, known) in enumerate(zip(accuracies, worst, strict=True))
        ]
        open_ = _above(cells.span, bounds.upper, np.stack(enough, axis=1))
        left -= 4 * np.count_nonzero(open_)
        if round == _ROUNDS or left < 0:
            open_ = np.zeros(len(open_), dtype=bool)
        _close(cells.span, bounds.upper, open_, upper)
        if not open_.any():
            break
        cells = _halved(cells, bounds.vary, open_)
    return upper, attained, place


def whole(count: int) -> Cells:
    """One cell for each knot span, covering all of it."""
    return Cells(np.arange(count), np.full((count, 2), 0.5), np.full((count, 2), 0.5))


def span_bounds(spans: KnotSpans, upper: Floats, attained: Floats, place: Floats) -> CellBounds:
    """The bounds of one quantity on the knot spans to bound, of those (n,) on all, with places (n, 2) in u and v.

    Parameters
    ----------
    spans : KnotSpans
    upper, attained : (n,) arrays
        Certified and attained values on all knot spans.
    place : (n, 2) array
        Where the latter are, in u and v.
    """
    q = (spans.q[:, 0] + place[:, 0] * spans.q[:, 1]) % 1.0
    at = on_tube(q, spans.r[:, 0] + place[:, 1] * spans.r[:, 1])
    return CellBounds(*(part[spans.own] for part in (upper, attained, at)))


@numba.njit(cache=True, nogil=True)
def _raise(cells, bounds, attained, place):
    """Note values attained in cells that are worse than those known on their knot spans, and where they are."""
    for n in range(len(cells.span)):
        span = cells.span[n]
        for k in range(attained.shape[1]):
            if bounds.attained[n, k] > attained[span, k]:
                attained[span, k] = bounds.attained[n, k]
                for c in range(2):
                    place[span, k, c] = cells.centre[n, c] + cells.half[n, c] * bounds.place[n, k, c]


@numba.njit(cache=True, nogil=True)
def _above(span, upper, enough):
    """Whether one of the bounds (n, m) of each cell is above what is enough on its knot span."""
    open_ = np.zeros(len(span), dtype=np.bool_)
    for n in range(len(span)):
        for k in range(upper.shape[1]):
            if upper[n, k] > enough[span[n], k]:
                open_[n] = True
    return open_


@numba.njit(cache=True, nogil=True)
def _close(span, bounds, open_, upper):
    """Raise the bounds of knot spans to those of their cells that are not open; one that is no number stays."""
    for n in range(len(span)):
        if not open_[n]:
            for k in range(upper.shape[1]):
                value = bounds[n, k]
                if value > upper[span[n], k] or np.isnan(value):
                    upper[span[n], k] = value


@numba.njit(cache=True, nogil=True)
def _halved(cells, vary, open_):
    """Halves of each open cell along the direction of larger variation, or its quarters if both are similar."""
    count = 0
    for n in range(len(open_)):
        if open_[n]:
            count += _parts(vary[n, 0], vary[n, 1]) * _parts(vary[n, 1], vary[n, 0])
    span, centre, half = np.empty(count, dtype=np.int64), np.empty((count, 2)), np.empty((count, 2))
    count = 0
    for n in range(len(open_)):
        if open_[n]:
            parts_u, parts_v = _parts(vary[n, 0], vary[n, 1]), _parts(vary[n, 1], vary[n, 0])
            wide, high = cells.half[n, 0] / parts_u, cells.half[n, 1] / parts_v
            for i in range(parts_u):
                for j in range(parts_v):
                    span[count], half[count, 0], half[count, 1] = cells.span[n], wide, high
                    centre[count, 0] = cells.centre[n, 0] + (2 * i + 1 - parts_u) * wide
                    centre[count, 1] = cells.centre[n, 1] + (2 * j + 1 - parts_v) * high
                    count += 1
    return Cells(span, centre, half)


@numba.njit(cache=True, nogil=True)
def _parts(vary, other):
    """Parts into which a cell is cut along a direction, from its variation and that of the other direction."""
    return 2 if vary >= 0.4 * other else 1


def _shift(centre: Floats, half: Floats) -> Floats:
    """Matrices (n, 4, 4) from coefficients in u to those in s, where u = centre + half·s."""
    matrix = np.zeros((len(centre), 4, 4))
    for k in range(4):
        for i in range(k, 4):
            matrix[:, k, i] = comb(i, k) * centre ** (i - k) * half**k
    return matrix


# Maps coefficients in v to those in 1 - v.
BACKWARDS = np.array([[(-1) ** k * comb(i, k) for i in range(4)] for k in range(4)], dtype=float)
