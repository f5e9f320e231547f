"""Bounds of curvature, skew, stretch and area element on whole surfaces, by Taylor models on cells.

The tangents are those of `frame`. On a knot span at a pole, r_q and S (see `TubeSurface.parallels`) have a common
factor v, and the z of r_q has a factor v². They are divided out of the polynomials, so that bounds hold up to the pole
itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.constraint.cells import (
    BACKWARDS,
    Accuracy,
    Bounds,
    Cells,
    KnotSpans,
    SpanBounds,
    derivative,
    power,
    recentred,
    refine,
    span_bounds,
    whole,
)
from pneumorph.constraint.surface import FLOOR, SMOOTHING, Form, Forms, forms
from pneumorph.constraint.taylor import taylor
from pneumorph.geometry import TubeSurface

Floats = NDArray[np.float64]

NAMES = ("curvature", "skew", "stretch", "area")
_BLOCK = 3000  # cells evaluated at a time, so that the data stay in the cache
_FLAT = 1e-6  # mm; largest height of the row next to a pole over the pole's plane


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials from which the tangents are computed, on the knot spans of a surface.

    Attributes
    ----------
    parts : (n, f, 4, 4) array
        Coefficients of v^i u^j of r_q (x, y, z) and r_r (x, y, z), both per mm of the starting tube. With poles, r_q
        and the z of r_r are divided by v in the spans next to them, and four more follow: the z of r_q divided by v²,
        the z of r_r, S divided by v, and S.
    scale : (n, 2) array
        1/mm: du/d(q τ_q) and dv/d(r τ_r).
    poles : bool
        Whether the ends are poles.
    broken : (n,) array of bool
        Whether the span is next to a pole without a tangent plane.
    """

    parts: Floats
    scale: Floats
    poles: bool
    broken: NDArray[np.bool_]


def polynomials(surface: TubeSurface, spans: KnotSpans) -> Polynomials:
    """The polynomials of a surface."""
    (tau_q, tau_r), n = surface.size, len(spans.x)
    scale = np.stack([1.0 / (spans.q[:, 1] * tau_q), 1.0 / (spans.r[:, 1] * tau_r)], axis=1)
    r_q = derivative(spans.x, -1) * scale[:, 0, None, None, None]
    r_r = derivative(spans.x, -2) * scale[:, 1, None, None, None]
    broken = np.zeros(n, dtype=bool)
    if surface.ends == "flat":
        return Polynomials(np.concatenate([r_q, r_r], axis=1), scale, False, broken)

    rows, columns = surface.basis_r.spans, surface.basis_q.spans
    S = np.einsum("aij,j->ai", power(surface.basis_r), surface.parallels)
    S[-1] = BACKWARDS @ S[-1]
    S = np.repeat(S, columns, axis=0)
    beside = np.zeros(n, dtype=bool)
    beside[:columns] = beside[(rows - 1) * columns :] = True
    broken[beside] = np.abs(spans.x[beside, 2, 1]).max(axis=-1) > _FLAT

    def divided(part: Floats, times: int = 1) -> Floats:
        part = part.copy()
        shorter = np.zeros_like(part[beside])
        shorter[..., : 4 - times, :] = part[beside][..., times:, :]
        part[beside] = shorter
        return part

    around = np.zeros((n, 1, 4, 4))
    around[:, 0, :, 0] = S
    parts = [divided(r_q), r_r[:, :2], divided(r_r[:, 2:]), divided(r_q[:, 2:], 2), r_r[:, 2:], divided(around), around]
    return Polynomials(np.concatenate(parts, axis=1), scale, True, broken)


def enclosed(
    surface: TubeSurface, spans: KnotSpans, form: Form, accuracies: list[Accuracy], worst: list[float]
) -> dict[str, SpanBounds]:
    """Bounds of the four limited quantities on every knot span; the area element with its sign changed.

    Parameters
    ----------
    surface, spans
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    accuracies, worst : lists of four
        In the order of `NAMES`, see `refine`.
    """
    made, aspect = polynomials(surface, spans), surface.size[1] / surface.size[0]

    def evaluate(cells: Cells) -> Bounds:
        parts = []
        for first in range(0, len(cells.span), _BLOCK):
            block = cells.select(slice(first, first + _BLOCK))
            found, vary = _forms(made, block)
            parts.append(_bounds(found, aspect, form, vary, made.broken[block.span]))
        return Bounds(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    upper, seen, place = refine(evaluate, whole(len(spans.x)), accuracies, worst, len(spans.x))
    return {name: span_bounds(spans, upper[:, k], seen[:, k], place[:, k]) for k, name in enumerate(NAMES)}


def _forms(made: Polynomials, cells: Cells) -> tuple[Forms, Floats]:
    """Taylor models of the forms on cells, and the variation of the tangents along u and v."""
    local = recentred(made.parts[cells.span], cells)
    by_q, by_r = (made.scale[cells.span] / cells.half).T[:, :, None, None]
    m = [taylor(local[:, k]) for k in range(local.shape[1])]
    d_q = {k: taylor(derivative(local[:, k], -1) * by_q) for k in range(local.shape[1]) if k < 3 or k == 6}
    d_r = {k: taylor(derivative(local[:, k], -2) * by_r) for k in range(local.shape[1])}
    if made.poles:
        over = m[8].inverse()
        over2 = over * over
        across = (m[0] * over, m[1] * over, m[6] * over2)
        along = (m[3], m[4], m[5] * over)
        across_q = (d_q[0] * over, d_q[1] * over, d_q[6] * over2)
        across_r = tuple((d_r[k] - m[k] * over * d_r[8]) * over for k in range(3))
        along_r = (d_r[3], d_r[4], d_r[7])
        found = forms(across, along, across_q, across_r, along_r, m[9], d_r[9])
    else:
        across, along, across_q, across_r = m[:3], m[3:6], [d_q[k] for k in range(3)], [d_r[k] for k in range(3)]
        found = forms(across, along, across_q, across_r, [d_r[k] for k in range(3, 6)], 1.0, 0.0)
    vary = np.zeros((len(cells.span), 2))
    for part in (*across, *along, *across_q, *across_r):
        vary += np.stack([np.abs(part.c[1]) + np.abs(part.c[3]), np.abs(part.c[2]) + np.abs(part.c[5])], axis=1)
    return found, vary


def _bounds(f: Forms, aspect: float, form: Form, vary: Floats, broken: NDArray[np.bool_]) -> Bounds:
    """Bounds of the four quantities; denominators that may vanish are replaced by their floor."""
    with np.errstate(all="ignore"):
        models = _quantities(f, aspect, form, f.area2.inverse(), f.E.inverse(), f.G.inverse())
        centre = Forms(*(part.c[0] for part in f))
        stopped = [np.maximum(part, FLOOR**2) for part in (centre.area2, centre.E, centre.G)]
        exact = _quantities(centre, aspect, form, *(1.0 / part for part in stopped))
        least = [np.maximum(part.bottom(), FLOOR**2) for part in (f.area2, f.E, f.G)]
        largest = Forms(*(part.largest for part in f))
        rough = _quantities(largest._replace(gauss=-largest.gauss), aspect, form, *(1.0 / part for part in least))
        rough = (rough[0], np.minimum(rough[1], 1.0), rough[2])
        sound = [least[0] > FLOOR**2, (least[1] > FLOOR**2) & (least[2] > FLOOR**2)]
        upper, seen, place = [], [], []
        for quantity, at_centre, bound, where in zip(models, exact, rough, (sound[0], sound[1], sound[1]), strict=True):
            top, (value, at) = quantity.top(), quantity.attained()
            better = where & (value > at_centre)
            upper.append(np.where(where, np.minimum(top, bound), bound))
            seen.append(np.where(better, value, at_centre))
            place.append(np.where(better[:, None], at, 0.0))
        value, at = (f.area2 * -1.0).attained()
        upper.append(-np.sqrt(np.maximum(f.area2.bottom(), 0.0) + SMOOTHING**2))
        seen.append(-np.sqrt(np.maximum(-value, 0.0) + SMOOTHING**2))
        place.append(at)
    upper[0] = np.where(broken, np.inf, upper[0])
    seen[0] = np.where(broken, np.inf, seen[0])
    return Bounds(np.stack(upper, axis=1), np.stack(seen, axis=1), np.stack(place, axis=1), vary)


def _quantities(f: Forms, aspect: float, form: Form, over_area2: Any, over_E: Any, over_G: Any) -> tuple[Any, Any, Any]:
    """Curvature, skew and stretch for any kind of numbers; from absolute values it gives upper bounds."""
    curvature = over_area2 * over_area2 * (f.twice_H * f.twice_H * over_area2 * 0.5 - f.gauss)
    skew = f.F * f.F * (over_E * over_G)
    E_q, E_r, G_q, G_r = f.E_q * over_E, f.E_r * over_E, f.G_q * over_G, f.G_r * over_G
    if form == "per_mm":
        return curvature, skew, E_q * E_q + E_r * E_r + G_q * G_q + G_r * G_r
    first, second = E_q + E_r * aspect, G_q * (1.0 / aspect) + G_r
    return curvature, skew, first * first + second * second
