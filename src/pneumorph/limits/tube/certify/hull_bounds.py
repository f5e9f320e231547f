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
        net = _FROM_CENTRE @ recentred(coefficients[cells.span], cells) @ _FROM_CENTRE.T
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
