"""Bounds of the extent of a surface from control nets: a polynomial patch lies in the convex hull of its net.

Halving a patch reduces the distance between net and patch to a quarter. The limits on the envelope, the planes of the
body's ends and those of a tube's own flat ends are bounded by functions of the net's points whose maximum over the hull
is at one of these points: a coordinate, the (convex) distance from the axis, and a quotient of two polynomials with a
positive denominator.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.cells import (
    BACKWARDS,
    Accuracy,
    Bounds,
    Cells,
    KnotSpans,
    SpanBounds,
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


def radius(spans: KnotSpans, accuracy: Accuracy, worst: float) -> SpanBounds:
    """Largest distances from the z axis, mm."""
    return _bounded(spans.x[:, :2], lambda net: np.hypot(net[:, 0], net[:, 1]), spans, accuracy, worst)


def beyond(spans: KnotSpans, length: float, accuracy: Accuracy, worst: float) -> SpanBounds:
    """Distances in mm by which a surface passes the planes z = 0 and z = length; negative between them."""
    return _bounded(spans.x[:, 2:], lambda net: np.maximum(-net[:, 0], net[:, 0] - length), spans, accuracy, worst)


def rims(
    surface: TubeSurface, spans: KnotSpans, neighbourhood: float, accuracy: Accuracy, worst: float
) -> list[SpanBounds]:
    """Smallest heights (mm) of a tube over the planes of its flat ends, divided by `rim_share`; signs changed.

    The share is proportional to the distance from the rim along the starting surface, up to 1 at the edge of the
    neighbourhood. Height and share both vanish on the rim, so the common factor v is divided out there.
    """
    rows = surface.basis_r.spans
    z = spans.x[:, 2].reshape(rows, -1, 4, 4)
    found = []
    for tip in (False, True):
        height = np.einsum("ij,abjm->abim", BACKWARDS, z)[::-1] if tip else z.copy()
        height[:, :, 0, 0] -= surface.net[-1 if tip else 0, 0, 2]
        height = -height if tip else height
        start, width = np.arange(rows) / rows, 1.0 / rows
        own = spans.own.reshape(rows, -1)[:: -1 if tip else 1].ravel()
        share = np.zeros_like(height)
        share[:, :, 0, 0], share[:, :, 1, 0] = start[:, None], width
        share *= surface.size[1] / neighbourhood
        near = np.stack([height, share], axis=2)
        near[0] = np.roll(near[0], -1, axis=-2)
        near[0, :, :, -1] = 0.0
        away = np.stack([height, np.zeros_like(height)], axis=2)
        away[:, :, 1, 0, 0] = 1.0

        columns = z.shape[1]
        edge = np.repeat(np.clip((neighbourhood / surface.size[1] - start) / width, 0.0, 1.0), columns)
        lower, upper = np.concatenate([np.zeros_like(edge), edge]), np.concatenate([edge, np.ones_like(edge)])
        count = len(lower)
        cells = Cells(
            np.arange(count),
            np.stack([np.full(count, 0.5), 0.5 * (lower + upper)], axis=1),
            np.stack([np.full(count, 0.5), 0.5 * (upper - lower)], axis=1),
        )
        r = np.repeat(np.stack([1.0 - start if tip else start, np.full(rows, -width if tip else width)], 1), columns, 0)
        some = (upper > lower) & np.tile(own, 2)
        both = KnotSpans(np.zeros((0, 3, 4, 4)), np.tile(spans.q, (2, 1)), np.tile(r, (2, 1)), some)
        polynomials = np.concatenate([near, away]).reshape(count, 2, 4, 4)
        found.append(_bounded(polynomials, lambda net: -net[:, 0] / net[:, 1], both, accuracy, worst, cells))
        worst = max(worst, float(found[-1].seen.max()))
    return found


def _bounded(
    coefficients: Floats,
    read: Callable[[Floats], Floats],
    spans: KnotSpans,
    accuracy: Accuracy,
    worst: float,
    cells: Cells | None = None,
) -> SpanBounds:
    """Bounds of a quantity that is a function of the nets (n, f, 4, 4) of polynomials on the knot spans, or on cells of
    these (n)."""

    def evaluate(cells: Cells) -> Bounds:
        net = _FROM_CENTRE @ recentred(coefficients[cells.span], cells) @ _FROM_CENTRE.T
        value = read(net)
        corners = value[:, ::3, ::3].reshape(-1, 4)
        best = np.argmax(corners, axis=1)
        bend = [np.abs(np.diff(value, 2, axis=axis)).max(axis=(1, 2)) for axis in (2, 1)]
        return Bounds(
            upper=value.max(axis=(1, 2))[:, None],
            seen=corners[np.arange(len(best)), best][:, None],
            place=np.stack([best % 2, best // 2], axis=1)[:, None] * 2.0 - 1.0,
            vary=np.stack(bend, axis=1),
        )

    count = len(coefficients)
    start = (whole(count) if cells is None else cells).select(spans.own)
    upper, seen, place = refine(evaluate, start, [accuracy], [worst], count)
    return span_bounds(spans, upper[:, 0], seen[:, 0], place[:, 0])
