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
    """Coefficients (f, 4, 4, n) in s, t ∈ [-1, 1] on n cells, from those (f, 4, 4, spans) in u and v on knot spans."""
    local = np.ascontiguousarray(coefficients[..., cells.span])
    _recentre(local.reshape(-1, 16, len(cells.span)), cells.centre, cells.half)
    return local


@numba.njit(cache=True, nogil=True)
def _recentre(p, centre, half):
    """Replace polynomials (f, 16, n) in u and v by those in s and t."""
    for f in range(p.shape[0]):
        for place in range(8):
            # Lines of coefficients along u, and then along v.
            k, step = place // 4, 1 if place < 4 else 4
            first = 4 * place if place < 4 else place - 4
            for n in range(p.shape[2]):
                c, h = centre[n, k], half[n, k]
                p0, p1, p2, p3 = (
                    p[f, first, n],
                    p[f, first + step, n],
                    p[f, first + 2 * step, n],
                    p[f, first + 3 * step, n],
                )
                p[f, first, n] = p0 + c * (p1 + c * (p2 + c * p3))
                p[f, first + step, n] = h * (p1 + c * (2.0 * p2 + c * 3.0 * p3))
                p[f, first + 2 * step, n] = h * h * (p2 + c * 3.0 * p3)
                p[f, first + 3 * step, n] = h * h * h * p3


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
        open_ = np.asarray((bounds.upper > np.stack(enough, axis=1)[cells.span]).any(axis=1))
        left -= 4 * np.count_nonzero(open_)
        if round == _ROUNDS or left < 0:
            open_ = np.zeros(len(open_), dtype=bool)
        for k in range(m):
            # One that is no number stays.
            np.maximum.at(upper[:, k], cells.span[~open_], bounds.upper[~open_, k])
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


def _raise(cells: Cells, bounds: Bounds, attained: Floats, place: Floats) -> None:
    """Note values attained in cells that are worse than those known on their knot spans, and where they are."""
    for k, value in enumerate(bounds.attained.T):
        known = attained[cells.span, k]
        np.fmax.at(attained[:, k], cells.span, value)
        # The first of those that are as bad is written last.
        n = np.flatnonzero((value > known) & (value == attained[cells.span, k]))[::-1]
        place[cells.span[n], k] = cells.centre[n] + cells.half[n] * bounds.place[n, k]


def _halved(cells: Cells, vary: Floats, open_: Mask) -> Cells:
    """Halves of each open cell along the direction of larger variation, or its quarters if both are similar."""
    vary, cells = vary[open_], cells.select(open_)
    parts = np.where(vary >= 0.4 * vary[:, ::-1], 2, 1)
    count = parts.prod(axis=1)
    cell = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    parts, half = parts[cell], (cells.half / parts)[cell]
    place = np.stack(np.divmod(number, parts[:, 1]), axis=1)
    return Cells(cells.span[cell], cells.centre[cell] + (2 * place + 1 - parts) * half, half)


def _shift(centre: Floats, half: Floats) -> Floats:
    """Matrices (n, 4, 4) from coefficients in u to those in s, where u = centre + half·s."""
    matrix = np.zeros((len(centre), 4, 4))
    for k in range(4):
        for i in range(k, 4):
            matrix[:, k, i] = comb(i, k) * centre ** (i - k) * half**k
    return matrix


# Maps coefficients in v to those in 1 - v.
BACKWARDS = np.array([[(-1) ** k * comb(i, k) for i in range(4)] for k in range(4)], dtype=float)
