"""Pointwise limits of a surface: the paper's curvature (25), skew (27), stretch (29), and a bound on its area element.

Nothing here divides by zero: where a net has folded, so that tangents vanish or align, denominators stop at one
hundredth of the starting tube's, ten times below what the bound on the area element admits.
"""

from __future__ import annotations

from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.constraint.sampling import Fields, Grid

Form = Literal["per_mm", "printed"]

MIN_AREA = 0.1  # smallest admissible area element sqrt(EG - F²), relative to the starting tube's
_BLOCK = 12_000  # samples evaluated at a time
_FLOOR = 0.01  # where denominators stop, relative to the starting tube's


class Measures(NamedTuple):
    """Limited quantities on the measured rows of a grid, each (rows, columns).

    curvature is h₁ in 1/mm², skew h₂, stretch h₃ in 1/mm², area sqrt(EG - F²) relative to the
    starting tube's.
    """

    curvature: Array
    skew: Array
    stretch: Array
    area: Array


def measures(fields: Fields, grid: Grid, form: Form = "per_mm") -> Measures:
    """Evaluate h₁ = (k₁² + k₂²)/2 (25), h₂ = F²/(EG) (27), h₃ (29) and the area element.

    Parameters
    ----------
    fields : Fields
        Of the tube, derivatives per mm.
    grid : Grid
    form : "per_mm" or "printed"
        h₃ as the squared gradient per millimetre of ln sqrt(E) and ln sqrt(G), or to the letter of (29), which adds the
        two derivatives over the unit square before it squares and divides both by the same τ.
    """
    rows = grid.measured
    derivatives = tuple(field[:, rows] for field in fields[1:])
    shrink, polar = jnp.asarray(grid.shrink[rows]), jnp.asarray(grid.polar[rows])
    return _pointwise(derivatives, shrink, polar, grid.size[1] / grid.size[0], form)


def measures_of_net(net: Array, grid: Grid, form: Form = "per_mm") -> Measures:
    """The same from the control net (n_r, n_q, 3), some rows at a time, which keeps the work in the cache.

    The gradient evaluates each block once more instead of keeping what it needs of all of them: memory that is too
    large for the allocator's pool costs more than the arithmetic.
    """
    rows = np.arange(len(grid.r))[grid.measured]
    blocks = max(1, round(len(rows) * len(grid.q) / _BLOCK))
    height = -(-len(rows) // blocks)
    padded = np.concatenate([rows, np.full(blocks * height - len(rows), rows[-1])]).reshape(blocks, height)
    along = jnp.einsum("kbRr,rqc->bkcRq", np.stack([values[padded] for values in grid.values_r]), net)

    @jax.checkpoint
    def block(part: tuple[Array, Array, Array]) -> Measures:
        along, shrink, polar = part
        orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        derivatives = tuple(jnp.matmul(along[dr], grid.values_q[dq].T) for dq, dr in orders)
        return _pointwise(derivatives, shrink, polar, grid.size[1] / grid.size[0], form)

    found = jax.lax.map(block, (along, jnp.asarray(grid.shrink[padded]), jnp.asarray(grid.polar[padded])))
    return Measures(*(part.reshape(blocks * height, -1)[: len(rows)] for part in found))


@partial(jax.jit, static_argnames="form")
def _pointwise(derivatives: tuple[Array, ...], shrink: Array, polar: Array, aspect: float, form: Form) -> Measures:
    """The measures from r_q, r_r, r_qq, r_qr, r_rr, each (3, rows, columns)."""
    q, r, qq, qr, rr = (tuple(field) for field in derivatives)
    E, F, G = _dot(q, q), _dot(q, r), _dot(r, r)
    n = _cross(q, r)
    area2 = _dot(n, n)
    safe_area2 = jnp.maximum(area2, (_FLOOR * shrink) ** 2)
    safe_E = jnp.maximum(E, (_FLOOR * shrink) ** 2)
    safe_G = jnp.maximum(G, _FLOOR**2)

    # Second fundamental form without its factor 1/sqrt(EG - F²), which the powers of area2 make up for.
    L, M, N = _dot(qq, n), _dot(qr, n), _dot(rr, n)
    twice_H = E * N + G * L - 2.0 * F * M
    curvature = twice_H**2 / (2.0 * safe_area2**3) - (L * N - M**2) / safe_area2**2

    # Logarithmic derivatives of the tangents' lengths per mm; towards a pole, beyond what the dome itself asks for.
    E_q, E_r = _dot(q, qq) / safe_E, _dot(q, qr) / safe_E - polar
    G_q, G_r = _dot(r, qr) / safe_G, _dot(r, rr) / safe_G
    if form == "per_mm":
        stretch = E_q**2 + E_r**2 + G_q**2 + G_r**2
    else:
        stretch = (E_q + aspect * E_r) ** 2 + (G_q / aspect + G_r) ** 2

    return Measures(
        curvature=curvature,
        skew=F**2 / (safe_E * safe_G),
        stretch=stretch,
        area=jnp.sqrt(area2 + (1e-3 * shrink) ** 2) / shrink,
    )


def _dot(a: tuple[Array, ...], b: tuple[Array, ...]) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: tuple[Array, ...], b: tuple[Array, ...]) -> tuple[Array, ...]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
