"""Bounds of curvature, skew, stretch and area element on whole surfaces, by Taylor models on cells.

The tangents are those of `pole_frame`. On a knot span at a pole, r_q and S (see `TubeSurface.parallels`) have a common
factor v, and the z of r_q has a factor v². They are divided out of the polynomials, so that bounds hold up to the pole
itself.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    recentred,
    refine,
    span_bounds,
    whole,
)
from pneumorph.limits.tube.certify.taylor import Taylor, modelled
from pneumorph.limits.tube.measures.formulas import FLOOR, SMOOTHING, Form, Forms, forms, quantities
from pneumorph.limits.tube.measures.pole_frame import meridian, side_of
from pneumorph.threads import each

Floats = NDArray[np.float64]
Models = tuple[Taylor, ...]

_SHARE = 4000  # cells that a thread takes at once
_TIMES = np.array([[1.0], [2.0], [3.0]])
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

    def evaluate(cells: Cells) -> Bounds:
        shares = [cells.select(slice(first, first + _SHARE)) for first in range(0, len(cells.span), _SHARE)]
        found = each(lambda some: _enclosed(made, some, aspect, form == "per_mm"), shares)
        return Bounds(*(np.concatenate(part) for part in zip(*found, strict=True)))

    upper, attained, place = refine(evaluate, whole(len(spans.x)).select(spans.own), accuracies, worst, len(spans.x))
    return [span_bounds(spans, upper[:, k], attained[:, k], place[:, k]) for k in range(4)]


@np.errstate(all="ignore")
def _enclosed(made: Polynomials, cells: Cells, aspect: float, per_mm: bool) -> Bounds:
    """The bounds on some cells, of which `vary` is that of the tangents."""
    local = recentred(np.moveaxis(made.parts, 0, -1), cells)
    by_q, by_r = (made.scale[cells.span] / cells.half).T
    f, vary = (_polar_forms if made.poles else _flat_forms)(local, by_q, by_r)
    bounds = _bound(f, aspect, per_mm, vary)
    broken = made.broken[cells.span]
    bounds.upper[broken, 0], bounds.attained[broken, 0] = np.inf, np.inf
    return bounds


def _flat_forms(local: Floats, by_q: Floats, by_r: Floats) -> tuple[Forms, Floats]:
    """Models of the forms on cells of a surface with flat ends, and what its tangents vary."""
    across, along = local[:3], local[3:]
    tangents = modelled(across), modelled(along), _by_q(across, by_q), _by_r(across, by_r)
    return forms(*tangents, _by_r(along, by_r), 1.0, 0.0), _variation(tangents)


def _polar_forms(local: Floats, by_q: Floats, by_r: Floats) -> tuple[Forms, Floats]:
    """The same on cells of a surface with poles, see `Polynomials`."""
    f = modelled(local)
    over = f[8].inverse
    over2 = over * over
    u = [part * over for part in f[:3]]
    x_q, y_q, z_q = _by_q(local[[0, 1, 6]], by_q)
    *u_r, x_r, y_r, z_r, over_r, S_r = _by_r(local[[0, 1, 2, 3, 4, 7, 8, 9]], by_r)
    tangents = (
        (u[0], u[1], f[6] * over2),
        (f[3], f[4], f[5] * over),
        (x_q * over, y_q * over, z_q * over2),
        tuple((slope - part * over_r) * over for slope, part in zip(u_r, u, strict=True)),
    )
    return forms(*tangents, (x_r, y_r, z_r), f[9], S_r), _variation(tangents)


def _by_q(polynomials: Floats, scale: Floats) -> Models:
    """Models of the derivatives of polynomials (f, 4, 4, n) with respect to s, times a factor (n,) for each cell."""
    return modelled(polynomials[:, :, 1:] * (_TIMES * scale))


def _by_r(polynomials: Floats, scale: Floats) -> Models:
    """The same with respect to t."""
    return modelled(polynomials[:, 1:] * (_TIMES * scale)[:, None])


def _variation(tangents: tuple[Models, ...]) -> Floats:
    """Variation of the tangents along u and v (n, 2)."""
    c = np.zeros((5, tangents[0][0].c.shape[1]))
    for group in tangents:
        for part in group:
            c += np.abs(part.c[1:6])
    return np.stack([c[0] + c[2], c[1] + c[4]], axis=1)


def _bound(f: Forms, aspect: float, per_mm: bool, vary: Floats) -> Bounds:
    """Bounds of the four quantities; denominators that may vanish are replaced by their floor."""

    def over(*squares: Floats) -> list[Floats]:
        return [1.0 / np.maximum(square, FLOOR**2) for square in squares]

    # Of models; of the values at the centre; and of absolute values, which gives upper bounds.
    models = quantities(f, aspect, per_mm, f.area2.inverse, f.E.inverse, f.G.inverse)
    at = Forms(*(form.c[0] for form in f))
    exact = quantities(at, aspect, per_mm, *over(at.area2, at.E, at.G))
    most = Forms(*(form.largest for form in f))
    least = [form.bottom for form in (f.area2, f.E, f.G)]
    rough = quantities(most._replace(gauss=-most.gauss), aspect, per_mm, *over(*least))
    rough = rough[0], np.minimum(rough[1], 1.0), rough[2]
    sound = np.stack(least) > FLOOR**2
    upper, attained = np.empty((len(least[0]), 4)), np.empty((len(least[0]), 4))
    place = np.zeros((len(upper), 4, 2))
    for k, usable in enumerate((sound[0], sound[1] & sound[2], sound[1] & sound[2])):
        top, (value, where) = models[k].top, models[k].highest_sample()
        upper[:, k] = np.where(usable & ~(rough[k] < top), top, rough[k])
        better = usable & (value > exact[k])
        attained[:, k], place[:, k] = np.where(better, value, exact[k]), np.where(better[:, None], where, 0.0)
    value, place[:, 3] = (f.area2 * -1.0).highest_sample()
    upper[:, 3] = -np.sqrt(np.maximum(least[0], 0.0) + SMOOTHING**2)
    attained[:, 3] = -np.sqrt(np.maximum(-value, 0.0) + SMOOTHING**2)
    return Bounds(upper, attained, place, vary)
