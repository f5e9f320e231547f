"""Pointwise limits of a surface: the paper's curvature (25), skew (27), stretch (29), and a bound on its area element.

Nothing here divides by zero: if a net has folded, so that tangents vanish or become parallel, denominators have a floor
at one hundredth of the starting tube's, a tenth of what the bound on the area element allows.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numba.extending import register_jitable

from pneumorph.limits.tube.measures.grid import Grid

Form = Literal["per_mm", "printed"]

MIN_AREA = 0.1  # smallest admissible area element sqrt(EG - F²), relative to the starting tube's
FLOOR = 0.01  # smallest value used in denominators, relative to the starting tube's
SMOOTHING = 1e-3  # smoothing of the square root in the area element at zero
_BLOCK = 12_000  # samples evaluated at a time


class Measures(NamedTuple):
    """Limited quantities on a grid, each (rows, columns).

    curvature is h₁ in 1/mm², skew h₂, stretch h₃ in 1/mm², and area sqrt(EG - F²) relative to the starting tube's.
    """

    curvature: Array
    skew: Array
    stretch: Array
    area: Array


class Forms(NamedTuple):
    """Numerators and denominators of the limited quantities; any kind of number that can be added and multiplied.

    E, F, G of the tangents U = r_q / S and r_r; area2 = EG - F²; the numerators of twice the mean curvature and of the
    Gaussian curvature, without powers of area2; half the derivatives of E and G along q and r. All derivatives are per
    mm of the starting tube.
    """

    E: Any
    F: Any
    G: Any
    area2: Any
    twice_H: Any
    gauss: Any
    E_q: Any
    E_r: Any
    G_q: Any
    G_r: Any


@register_jitable
def forms(across: Any, along: Any, across_q: Any, across_r: Any, along_r: Any, S: Any, S_r: Any) -> Forms:
    """The forms from components of U, r_r, U_q, U_r and r_rr, with the z of U, r_r and U_q divided by S (`pole_frame`).

    Since r_qr = S' U + S U_r and U is a tangent, the second fundamental form has L = U_q·n / S, M = U_r·n and
    N = r_rr·n in the frame of U and r_r; n = U × r_r is not a unit vector, which the powers of area2 compensate.

    Parameters
    ----------
    across, along, across_q, across_r, along_r : three numbers each
        U, r_r, U_q, U_r and r_rr; derivatives are per mm of the starting tube.
    S, S_r : numbers
        Circumference of the starting dome relative to τ_q, and its derivative, 1/mm.
    """
    (ux, uy, V), (rx, ry, W), (uqx, uqy, V_q) = across, along, across_q
    mx, my, nz = uy * W - V * ry, V * rx - ux * W, ux * ry - uy * rx
    nx, ny, uz, rz, uqz = S * mx, S * my, S * V, S * W, S * V_q
    L = uqx * mx + uqy * my + V_q * nz
    M = across_r[0] * nx + across_r[1] * ny + across_r[2] * nz
    N = along_r[0] * nx + along_r[1] * ny + along_r[2] * nz
    u, r = (ux, uy, uz), (rx, ry, rz)
    E, F, G = _dot(u, u), _dot(u, r), _dot(r, r)
    return Forms(
        E=E,
        F=F,
        G=G,
        area2=nx * nx + ny * ny + nz * nz,
        twice_H=E * N + G * L - 2.0 * (F * M),
        gauss=L * N - M * M,
        E_q=_dot(u, (uqx, uqy, uqz)),
        E_r=_dot(u, across_r),
        G_q=S_r * F + S * _dot(r, across_r),
        G_r=_dot(r, along_r),
    )


@register_jitable
def quantities(
    f: Forms, aspect: float, per_mm: bool, over_area2: Any, over_E: Any, over_G: Any
) -> tuple[Any, Any, Any]:
    """Curvature, skew and stretch for any kind of numbers, from the forms and the inverses of their denominators.

    Parameters
    ----------
    f : Forms
    aspect : float
        Length over circumference of the starting tube.
    per_mm : bool
        The form of the stretch, see `measures`.
    over_area2, over_E, over_G : numbers
        Inverses of the denominators.
    """
    curvature = over_area2 * over_area2 * (f.twice_H * f.twice_H * over_area2 * 0.5 - f.gauss)
    skew = f.F * f.F * (over_E * over_G)
    E_q, E_r, G_q, G_r = f.E_q * over_E, f.E_r * over_E, f.G_q * over_G, f.G_r * over_G
    if per_mm:
        return curvature, skew, E_q * E_q + E_r * E_r + G_q * G_q + G_r * G_r
    first, second = E_q + E_r * aspect, G_q * (1.0 / aspect) + G_r
    return curvature, skew, first * first + second * second


def measures(net: Array, grid: Grid, form: Form = "per_mm") -> Measures:
    """Evaluate h₁ = (k₁² + k₂²)/2 (25), h₂ = F²/(EG) (27), h₃ (29) and the area element.

    Blocks of rows are evaluated one at a time, so that the data stay in the cache. For the gradient each block is
    evaluated again instead of being stored, because memory beyond the allocator's pool costs more than the arithmetic.

    Parameters
    ----------
    net : (n_r, n_q, 3) array
        Control points in mm.
    grid : Grid
    form : "per_mm" or "printed"
        h₃ as the squared gradient per millimetre of ln|U| and ln sqrt(G), or exactly as in (29), which adds the two
        derivatives over the unit square before squaring and divides both by the same τ. With flat ends |U| is sqrt(E);
        at poles it excludes the change of circumference of the starting dome itself.
    """
    rows = np.arange(len(grid.r))
    blocks = max(1, round(len(rows) * len(grid.q) / _BLOCK))
    height = -(-len(rows) // blocks)
    padded = np.concatenate([rows, np.full(blocks * height - len(rows), rows[-1])]).reshape(blocks, height)
    parts = grid.frame
    matrices = np.stack(parts[:4])[:, :, padded]
    along = sum(
        jnp.einsum("kcbRr,rqc->bkcRq", matrices * (parts.side == side)[padded][..., None], net @ parts.turns[side])
        for side in np.unique(parts.side)
    )

    @jax.checkpoint
    def block(part: tuple[Array, Array, Array]) -> Measures:
        along, shrink, slope = part
        orders = ((0, 1), (1, 0), (0, 2), (2, 1), (3, 0))
        fields = tuple(jnp.matmul(along[of], grid.values_q[order].T) for of, order in orders)
        return pointwise(fields, shrink, slope, grid.size[1] / grid.size[0], form)

    blocked = jax.lax.map(block, (along, jnp.asarray(parts.shrink[padded]), jnp.asarray(parts.slope[padded])))
    return Measures(*(part.reshape(blocks * height, -1)[: len(rows)] for part in blocked))


@partial(jax.jit, static_argnames="form")
def pointwise(fields: tuple[Array, ...], shrink: Array, slope: Array, aspect: float, form: Form) -> Measures:
    """Evaluate the measures from U, r_r, U_q, U_r, r_rr, each (3, rows, columns), see `forms`.

    Parameters
    ----------
    fields : five (3, rows, columns) arrays
    shrink, slope : (rows, 1) arrays
        S, and dS/dr in 1/mm.
    aspect : float
        Length over circumference of the starting tube.
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    """
    across, along, across_q, across_r, along_r = fields
    f = forms(tuple(across), tuple(along), tuple(across_q), tuple(across_r), tuple(along_r), shrink, slope)
    over_area2, over_E, over_G = (1.0 / jnp.maximum(part, FLOOR**2) for part in (f.area2, f.E, f.G))
    curvature, skew, stretch = quantities(f, aspect, form == "per_mm", over_area2, over_E, over_G)
    return Measures(curvature, skew, stretch, area=jnp.sqrt(f.area2 + SMOOTHING**2))


@register_jitable
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
