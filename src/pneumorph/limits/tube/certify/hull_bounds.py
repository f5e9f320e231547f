"""Bounds of quantities from control nets: a polynomial patch lies in the convex hull of its net.

Halving a patch reduces the distance between net and patch to a quarter. What is bounded are functions of the net's
points whose maximum over the hull is at one of these points: convex ones, such as the distance beyond a convex region,
and quotients of two polynomials with a positive denominator.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.enclosed import Accuracy, CellBounds
from pneumorph.limits.tube.certify.cells import (
    Bounds,
    Cells,
    KnotSpans,
    recentred,
    refine,
    span_bounds,
    whole,
)

Floats = NDArray[np.float64]

# Bernstein coefficients on [0, 1] from powers of u in [0, 1], and from powers of s in [-1, 1].
FROM_POWERS = np.array([[comb(k, i) / comb(3, i) if i <= k else 0.0 for i in range(4)] for k in range(4)])
_FROM_CENTRE = FROM_POWERS @ np.array(
    [[comb(i, k) * (-1.0) ** (i - k) * 2.0**k if i >= k else 0.0 for i in range(4)] for k in range(4)]
)


def hull_bounds(
    coefficients: Floats,
    read: Callable[[Floats], Floats],
    spans: KnotSpans,
    accuracy: Accuracy,
    worst: float,
    cells: Cells | None = None,
) -> CellBounds:
    """Bounds of a quantity on knot spans, or on parts of them.

    Parameters
    ----------
    coefficients : (n, f, 4, 4) array
        Of f polynomials on the n spans, as in `KnotSpans.x`.
    read : function
        The quantity (n, 4, 4) from nets (n, f, 4, 4) of control values of the polynomials.
    spans : KnotSpans
        With `q`, `r` and `own` of the n spans.
    accuracy : Accuracy
    worst : float
        Its worst value attained elsewhere.
    cells : Cells, optional
        One part of each span; all of it by default.
    """

    def evaluate(cells: Cells) -> Bounds:
        net = _nets(coefficients, cells)
        value = read(net)
        corners = value[:, ::3, ::3].reshape(-1, 4)
        best = np.argmax(corners, axis=1)
        bend = [np.abs(np.diff(value, 2, axis=axis)).max(axis=(1, 2)) for axis in (2, 1)]
        return Bounds(
            upper=value.max(axis=(1, 2))[:, None],
            attained=corners[np.arange(len(best)), best][:, None],
            place=np.stack([best % 2, best // 2], axis=1)[:, None] * 2.0 - 1.0,
            vary=np.stack(bend, axis=1),
        )

    count = len(coefficients)
    start = (whole(count) if cells is None else cells).select(spans.own)
    upper, attained, place = refine(evaluate, start, [accuracy], [worst], count)
    return span_bounds(spans, upper[:, 0], attained[:, 0], place[:, 0])


def _nets(coefficients: Floats, cells: Cells) -> Floats:
    """Control nets (n, f, 4, 4) on cells of polynomials with coefficients (spans, f, 4, 4) in u and v."""
    local = recentred(np.moveaxis(coefficients, 0, -1), cells)
    return _FROM_CENTRE @ np.moveaxis(local, -1, 0) @ _FROM_CENTRE.T


# Two triangles of the corners of a patch, each (v, u) as 2 v + u.
_HALVES = np.array([[0, 1, 3], [0, 3, 2]])
# Its sides along u and along v.
_SIDES = np.array([[[0, 1], [2, 3]], [[0, 2], [1, 3]]])


def facet_bounds(
    read: Callable[[Floats, Floats], tuple[Floats, Floats]], spans: KnotSpans, accuracy: Accuracy, worst: float
) -> CellBounds:
    """Bounds of a function of places on knot spans, see `EnclosedBody.faceted`.

    A patch is no farther from the bilinear one between its corners than their nets are, and that one no farther from
    the triangles on both sides of a diagonal than a quarter of its twist.

    Parameters
    ----------
    read : function
        As `bounds` there.
    spans : KnotSpans
    accuracy : Accuracy
    worst : float
        Its worst value attained elsewhere.
    """
    along = np.linspace(0.0, 1.0, 4)
    weights = np.column_stack([1.0 - along, along])

    def evaluate(cells: Cells) -> Bounds:
        net = _nets(spans.x, cells)
        corners = net[:, :, ::3, ::3]
        bends = np.linalg.norm(net - weights @ corners @ weights.T, axis=1).max(axis=(1, 2))
        twist = corners[..., 0, 0] - corners[..., 0, 1] - corners[..., 1, 0] + corners[..., 1, 1]
        error = bends + 0.25 * np.linalg.norm(twist, axis=1)
        x = np.moveaxis(corners.reshape(-1, 3, 4), 1, 2)
        above, values = read(x[:, _HALVES].reshape(-1, 3, 3), np.repeat(error, 2))
        attained = np.full((len(x), 4), -np.inf)
        for half, value in zip(_HALVES, np.moveaxis(values.reshape(-1, 2, 3), 1, 0), strict=True):
            attained[:, half] = value
        best = np.argmax(attained, axis=1)
        across = [np.linalg.norm(np.diff(x[:, pairs], axis=2)[:, :, 0], axis=2).max(axis=1) for pairs in _SIDES]
        return Bounds(
            upper=above.reshape(-1, 2).max(axis=1)[:, None],
            attained=attained[np.arange(len(best)), best][:, None],
            place=np.stack([best % 2, best // 2], axis=1)[:, None] * 2.0 - 1.0,
            vary=np.stack(across, axis=1),
        )

    count = len(spans.x)
    start = whole(count).select(spans.own)
    upper, attained, place = refine(evaluate, start, [accuracy], [worst], count)
    return span_bounds(spans, upper[:, 0], attained[:, 0], place[:, 0])
