"""Bounds of curvature, skew, stretch and area element on whole surfaces, by Taylor models on cells.

The tangents are those of `pole_frame`. On a knot span at a pole, r_q and S (see `TubeSurface.parallels`) have a common
factor v, and the z of r_q has a factor v². They are divided out of the polynomials, so that bounds hold up to the pole
itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.enclosed import Accuracy, CellBounds
from pneumorph.limits.tube.certify.cells import (
    BACKWARDS,
    Bounds,
    Cells,
    KnotSpans,
    derivative,
    power,
    recentre,
    refine,
    span_bounds,
    whole,
)
from pneumorph.limits.tube.certify.taylor import bottom, highest_sample, inverse, largest, modelled, top
from pneumorph.limits.tube.measures.formulas import FLOOR, SMOOTHING, Form, Forms, forms, quantities
from pneumorph.limits.tube.measures.pole_frame import meridian, side_of
from pneumorph.threads import each

Floats = NDArray[np.float64]

_compiled = numba.njit(error_model="numpy")
_SHARE = 1000  # cells that a thread takes at once
_FLAT = 1e-6  # mm; largest height of the row next to a pole over the pole's plane


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials from which the tangents are computed, on the knot spans of a surface.

    Attributes
    ----------
    parts : (n, f, 4, 4) array
        Coefficients of v^i u^j of r_q (x, y, z) and r_r (x, y, z), both per mm of the starting tube, and turned as in
        `pole_frame`. With poles, r_q
        and the z of r_r are divided by v in the spans next to them, and four more follow: the z of r_q divided by v²,
        the z of r_r, S divided by v, and S.
    scale : (n, 2) array
        1/mm: du/d(q τ_q) and dv/d(r τ_r).
    poles : bool
        Whether there are poles.
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
    broken = np.zeros(n, dtype=bool)
    at_base, at_tip = surface.poles
    side = [side_of(at_base, at_tip, r) for r in spans.r[:, 0] + 0.5 * spans.r[:, 1]]
    x = np.einsum("ncij,ncd->ndij", spans.x, meridian(surface).turns[side])
    r_q = derivative(x, -1) * scale[:, 0, None, None, None]
    r_r = derivative(x, -2) * scale[:, 1, None, None, None]
    if not (at_base or at_tip):
        return Polynomials(np.concatenate([r_q, r_r], axis=1), scale, False, broken)

    rows, columns = surface.basis_r.spans, surface.basis_q.spans
    S = np.einsum("aij,j->ai", power(surface.basis_r), surface.parallels)
    S[-1] = BACKWARDS @ S[-1] if at_tip else S[-1]
    S = np.repeat(S, columns, axis=0)
    beside = np.zeros(n, dtype=bool)
    beside[:columns], beside[(rows - 1) * columns :] = at_base, at_tip
    broken[beside] = np.abs(x[beside, 2, 1]).max(axis=-1) > _FLAT

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
) -> list[CellBounds]:
    """Bounds of curvature, skew, stretch and area element, its sign changed, on the knot spans to bound.

    Parameters
    ----------
    surface, spans
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    accuracies, worst : lists of four
        In this order, see `refine`.
    """
    made, aspect = polynomials(surface, spans), surface.size[1] / surface.size[0]
    # In one order, for which the kernels are compiled once.
    parts, broken = np.ascontiguousarray(made.parts), made.broken if made.poles else None

    def evaluate(cells: Cells) -> Bounds:
        n = len(cells.span)
        bounds = Bounds(np.empty((n, 4)), np.empty((n, 4)), np.zeros((n, 4, 2)), np.zeros((n, 2)))

        def work(some: slice) -> None:
            into = tuple(part[some] for part in bounds)
            _enclose(parts, made.scale, broken, aspect, form == "per_mm", tuple(cells.select(some)), into)

        each(work, [slice(first, first + _SHARE) for first in range(0, n, _SHARE)])
        return bounds

    upper, attained, place = refine(evaluate, whole(len(spans.x)).select(spans.own), accuracies, worst, len(spans.x))
    return [span_bounds(spans, upper[:, k], attained[:, k], place[:, k]) for k in range(4)]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _enclose(parts, scale, broken, aspect, per_mm, cells, into):
    """The bounds of some `Cells`; fills the `Bounds` that are `into`, of which `vary` is that of the tangents.

    `broken` is None without poles: then what is for them is not compiled.
    """
    span, centre, half = cells
    upper, attained, place, vary = into
    local, slope = np.empty(parts.shape[1:]), np.zeros((4, 4))
    for n in range(len(span)):
        k = span[n]
        recentre(parts[k], centre[n], half[n], local)
        by_q, by_r = scale[k, 0] / half[n, 0], scale[k, 1] / half[n, 1]
        if broken is None:
            f = _flat_forms(local, slope, by_q, by_r, vary[n])
        else:
            f = _polar_forms(local, slope, by_q, by_r, vary[n])
        _bound(f, aspect, per_mm, upper[n], attained[n], place[n])
        if broken is not None and broken[k]:
            upper[n, 0], attained[n, 0] = np.inf, np.inf


@_compiled
def _flat_forms(local, slope, by_q, by_r, vary):
    """Models of the forms on a cell of a surface with flat ends, from the polynomials of its tangents."""
    across = (modelled(local[0]), modelled(local[1]), modelled(local[2]))
    along = (modelled(local[3]), modelled(local[4]), modelled(local[5]))
    across_q = (_by_q(local[0], by_q, slope), _by_q(local[1], by_q, slope), _by_q(local[2], by_q, slope))
    across_r = (_by_r(local[0], by_r, slope), _by_r(local[1], by_r, slope), _by_r(local[2], by_r, slope))
    along_r = (_by_r(local[3], by_r, slope), _by_r(local[4], by_r, slope), _by_r(local[5], by_r, slope))
    _vary(across, along, across_q, across_r, vary)
    return forms(across, along, across_q, across_r, along_r, 1.0, 0.0)


@_compiled
def _polar_forms(local, slope, by_q, by_r, vary):
    """Models of the forms on a cell of a surface with poles, see `Polynomials`."""
    S_r, over = _by_r(local[9], by_r, slope), inverse(modelled(local[8]))
    over2 = over * over
    u = (modelled(local[0]) * over, modelled(local[1]) * over, modelled(local[2]) * over)
    over_r = _by_r(local[8], by_r, slope)
    across = (u[0], u[1], modelled(local[6]) * over2)
    along = (modelled(local[3]), modelled(local[4]), modelled(local[5]) * over)
    across_q = (
        _by_q(local[0], by_q, slope) * over,
        _by_q(local[1], by_q, slope) * over,
        _by_q(local[6], by_q, slope) * over2,
    )
    across_r = (
        (_by_r(local[0], by_r, slope) - u[0] * over_r) * over,
        (_by_r(local[1], by_r, slope) - u[1] * over_r) * over,
        (_by_r(local[2], by_r, slope) - u[2] * over_r) * over,
    )
    along_r = (_by_r(local[3], by_r, slope), _by_r(local[4], by_r, slope), _by_r(local[7], by_r, slope))
    _vary(across, along, across_q, across_r, vary)
    return forms(across, along, across_q, across_r, along_r, modelled(local[9]), S_r)


@_compiled
def _by_q(p, scale, slope):
    """The model of a polynomial's derivative with respect to s, times `scale`; `slope` (4, 4) is overwritten."""
    for i in range(4):
        slope[i, 3] = 0.0
        for j in range(3):
            slope[i, j] = (j + 1) * scale * p[i, j + 1]
    return modelled(slope)


@_compiled
def _by_r(p, scale, slope):
    """The same with respect to t."""
    for j in range(4):
        slope[3, j] = 0.0
        for i in range(3):
            slope[i, j] = (i + 1) * scale * p[i + 1, j]
    return modelled(slope)


@_compiled
def _vary(across, along, across_q, across_r, vary):
    """Variation of the tangents along u and v."""
    for group in (across, along, across_q, across_r):
        for part in group:
            vary[0] += abs(part.c1) + abs(part.c3)
            vary[1] += abs(part.c2) + abs(part.c5)


@_compiled
def _bound(f, aspect, per_mm, upper, attained, place):
    """Bounds of the four quantities (4,); denominators that may vanish are replaced by their floor."""
    # Of models; of the values at the centre; and of absolute values, which gives upper bounds.
    models = quantities(f, aspect, per_mm, inverse(f.area2), inverse(f.E), inverse(f.G))
    at = Forms(f.E.c0, f.F.c0, f.G.c0, f.area2.c0, f.twice_H.c0, f.gauss.c0, f.E_q.c0, f.E_r.c0, f.G_q.c0, f.G_r.c0)
    exact = quantities(
        at, aspect, per_mm, 1.0 / max(at.area2, FLOOR**2), 1.0 / max(at.E, FLOOR**2), 1.0 / max(at.G, FLOOR**2)
    )
    least_area2, least_E, least_G = bottom(f.area2), bottom(f.E), bottom(f.G)
    most = Forms(
        largest(f.E),
        largest(f.F),
        largest(f.G),
        largest(f.area2),
        largest(f.twice_H),
        -largest(f.gauss),
        largest(f.E_q),
        largest(f.E_r),
        largest(f.G_q),
        largest(f.G_r),
    )
    rough = quantities(
        most,
        aspect,
        per_mm,
        1.0 / max(least_area2, FLOOR**2),
        1.0 / max(least_E, FLOOR**2),
        1.0 / max(least_G, FLOOR**2),
    )
    rough = (rough[0], min(rough[1], 1.0), rough[2])
    lengths = least_E > FLOOR**2 and least_G > FLOOR**2
    for k in range(3):
        upper[k], attained[k] = rough[k], exact[k]
        if lengths if k else least_area2 > FLOOR**2:
            upper[k] = min(top(models[k]), rough[k])
            value, s, t = highest_sample(models[k])
            if value > attained[k]:
                attained[k], place[k, 0], place[k, 1] = value, s, t
    value, place[3, 0], place[3, 1] = highest_sample(f.area2 * -1.0)
    upper[3] = -np.sqrt(max(least_area2, 0.0) + SMOOTHING**2)
    attained[3] = -np.sqrt(max(-value, 0.0) + SMOOTHING**2)
