"""Sheets and fibres along surfaces of the solid, as terms of the potential: energies per area, without bending.

    membrane   W = c k [φ(ε₁) + (1 + ν)/(1 − ν) φ((ε₂ + ν ε₁)/(1 + ν))],   fibres   W = Σ_families k φ(λ − 1)

with k a stiffness in N/mm, c the covered share of the face, ε₁ ≥ ε₂ the principal stretches of the face less one, and λ
the stretch along a fibre. φ(x) is x²/2 in tension. For a taut sheet that is k/(2(1 − ν²)) (ε₁² + ε₂² + 2ν ε₁ε₂), so
forces per width are linear in the stretches. In compression φ′ tends to −ε_c, where fibres buckle or wrinkles form: a
sheet without compressive strength, φ(x) = 0 for x < 0, is that of tension-field theory (Pipkin 1986, IMA J. Appl. Math.
36, 85–99), with the least energy of all states with wrinkles. For every convex φ with two continuous derivatives W is
convex in the stretches and has two as well, where the stretches are equal too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values, connect
from pneumorph.mesh.tets import Covered, triangle_gradient


def connect_covered(covered: Covered) -> Connectivity:
    """The connectivity of covered faces; their data (E, 3, 15) at each point are its weight, the direction from base to
    tip in the coordinates of the face, and the derivatives (6, 2) of the shape functions.
    """
    points = covered.points
    slopes = triangle_gradient(points[..., :2]).reshape(*points.shape[:2], 12)
    return connect(covered.nodes, data=np.concatenate([points[..., 2:], slopes], axis=-1))


def metric(local: Local, places: Values) -> Array:
    """Products g₁₁, g₁₂, g₂₂ (E, 3, 3) of the tangents, at the points of faces with nodes at these places (E, 6, 3)."""
    slopes = local.data[..., 3:15].reshape(*local.data.shape[:2], 6, 2)
    tangents = jnp.einsum("eai,eqak->eqki", places, slopes)
    one, two = tangents[..., 0, :], tangents[..., 1, :]
    return jnp.stack([jnp.sum(a * b, axis=-1) for a, b in ((one, one), (one, two), (two, two))], axis=-1)


def _parts(of: Array) -> tuple[Array, Array, Array]:
    """g₁₁, g₁₂, g₂₂."""
    return of[..., 0], of[..., 1], of[..., 2]


_APART = 1e-8
"""Added to the difference of stretches by squares, so that its root has derivatives where they are equal."""


def _tension(strain: Array, end: Values) -> Array:
    """φ: half the square of a strain in tension; in compression its slope tends to −`end` as 1 − exp does."""
    short = jnp.minimum(strain, 0.0)
    return jnp.where(strain > 0, strain * strain / 2, end * end * jnp.expm1(short / end) - end * short)


class Reinforcement(ElementEnergy):
    """A sheet, or fibres: its energy depends on the deformed faces by their metrics alone."""

    of_cover: ClassVar[bool] = True

    stiffness: Values
    number: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        return jnp.sum(self.stored(metric(local, local.X + local.u), local, loads), axis=1)

    def stored(self, deformed: Array, local: Local, loads: Loads) -> Array:
        """The share (E, 3) of each point in the energy, by the metrics (E, 3, 3) of the deformed faces."""
        raise NotImplementedError


@partial(register_dataclass, data_fields=["stiffness", "poisson", "wrinkling", "coverage", "number"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Membrane(Reinforcement):
    """∫ W over the covered faces of the undeformed body: stiffness k in N/mm, Poisson's ratio, strain of wrinkling.

    Of the faces a share is covered. Stiffness and coverage are changed by the row `number` of `Loads.reinforcement`.
    """

    stiffness: Values
    poisson: Values
    wrinkling: Values
    coverage: Values = 1.0
    number: Values = 0

    def stored(self, deformed: Array, local: Local, loads: Loads) -> Array:
        (A, B, C), (a, b, c) = _parts(metric(local, local.X)), _parts(deformed)
        area = jnp.sqrt(A * C - B * B)
        change = jnp.sqrt(a * c - b * b) / area
        # Components of C = UᵀU along the first tangent and across it: differences of them, not of its invariants, are
        # exact where the stretches are nearly equal.
        along, shear = a / A, (A * b - B * a) / (A * area)
        across = (c * A - 2 * b * B + a * B * B / A) / area**2
        twice = jnp.sqrt(along + across + 2 * change)
        mean = twice / 2 - 1
        apart = jnp.sqrt(((along - across) ** 2 + 4 * shear**2) / (2 * twice) ** 2 + _APART**2)
        larger, smaller = mean + apart, mean - apart
        ratio = self.poisson
        # Per width sheets bear 1/(1 − ν) times the slope of φ.
        end = (1 - ratio) * self.wrinkling
        value = _tension(larger, end) + (1 + ratio) / (1 - ratio) * _tension(
            (smaller + ratio * larger) / (1 + ratio), end
        )
        changed = jnp.asarray(loads.reinforcement)[self.number]
        stiffness = (self.stiffness + changed[0]) * (self.coverage + changed[1])
        return local.data[..., 0] * area * stiffness * value


@partial(register_dataclass, data_fields=["stiffness", "winding", "buckling", "number"], meta_fields=["hands"])
@dataclass(frozen=True, eq=False)
class Fibres(Reinforcement):
    """∫ W over the covered faces of the undeformed body: stiffness k of each family in N/mm, angle and buckling strain.

    The winding angle in rad is that from the lines from base to tip; `hands` has 1 for a family at this angle, which
    is a right-handed screw, and −1 for one at its opposite. Stiffness and angle are changed by the row `number` of
    `Loads.reinforcement`.
    """

    stiffness: Values
    winding: Values
    buckling: Values
    hands: tuple[int, ...]
    number: Values = 0

    def stored(self, deformed: Array, local: Local, loads: Loads) -> Array:
        (A, B, C), (a, b, c) = _parts(metric(local, local.X)), _parts(deformed)
        area = jnp.sqrt(A * C - B * B)
        s, t = local.data[..., 1], local.data[..., 2]
        length = jnp.sqrt(A * s * s + 2 * B * s * t + C * t * t)
        s, t = s / length, t / length
        # Normal to it in the face, counter-clockwise about the axis as seen from the tip.
        across, over = (B * s + C * t) / area, -(A * s + B * t) / area
        changed = jnp.asarray(loads.reinforcement)[self.number]
        stiffness, winding = self.stiffness + changed[0], self.winding + changed[1]
        value = jnp.zeros_like(area)
        for hand in self.hands:
            cosine, sine = jnp.cos(winding), hand * jnp.sin(winding)
            one, two = cosine * s + sine * across, cosine * t + sine * over
            stretch = jnp.sqrt(a * one * one + 2 * b * one * two + c * two * two)
            value += _tension(stretch - 1, self.buckling)
        return local.data[..., 0] * area * stiffness * value
