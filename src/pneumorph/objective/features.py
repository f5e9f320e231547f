"""Features of an equilibrium: motion of the end-effector, of sections and of chambers, differentiable by JAX."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.element import TET_N, TET_WEIGHT, reference_gradients
from pneumorph.mechanics.assembly.kinematics import State, Topology, chamber_volumes, displacement, tip_centre, tip_mean
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.material.energies import determinant
from pneumorph.objective.rotations import continued_logarithm, polar_rotation


class Features(NamedTuple):
    """What objectives are functions of; all of the whole body, where the model is half of one too.

    Attributes
    ----------
    translation : (3,) mm, of the end-effector.
    rotation : (3,) rad, its rotation vector.
    volume : {chamber: mm³} of the inflated chambers.
    section_position : (S, 3) mm, the centres of sections at equal distances, where they have gone.
    section_rotation : (S, 3, 3), how each has turned since the undeformed state.
    """

    translation: Array
    rotation: Array
    volume: dict[str, Array]
    section_position: Array
    section_rotation: Array


class Slabs(NamedTuple):
    """Sections of finite thickness: (S,) heights of their middles in the undeformed body and half the thickness, mm."""

    middle: np.ndarray
    half: float


SECTIONS_TO_TIP = 12
"""Sections that tell how often a free tip has turned round: each turns by less than half a turn against the next."""

NO_SLABS = Slabs(np.zeros(0), 1.0)


def equidistant(count: int, length: float) -> Slabs:
    """The middles of so many equal parts of a body of this length (mm), each as thick as its part."""
    half = length / (2 * max(count, 1))
    return Slabs(half * (2 * np.arange(count) + 1), half)


def features(model: Model, X: Array, state: State, slabs: Slabs = NO_SLABS) -> Features:
    """Features of a state on nodes X (N, 3), both padded.

    With a plate the motion is its own. A free tip has the area mean of the displacement as its translation, and as its
    rotation the polar factor of its mean deformation; how many half turns that is tell the sections below it.
    """
    u = displacement(model.top, X, state)
    volume = dict(zip(model.chambers, model.copies * chamber_volumes(model.top, X + u), strict=True))
    position, rotation = jnp.zeros((0, 3)), jnp.zeros((0, 3, 3))
    if len(slabs.middle):
        position, rotation = _sections(model.top, X, u, jnp.asarray(slabs.middle), slabs.half)
    if model.plate:
        return Features(state.plate[:3], state.plate[3:], volume, position, rotation)
    return Features(tip_centre(model.top, X, u), _face_rotation(model.top, X, u), volume, position, rotation)


def _face_rotation(top: Topology, X: Array, u: Array) -> Array:
    """Rotation vector of the tip face, also beyond half a turn: polar factor of the mean of (x − x̄) ⊗ (X − X̄)."""
    centre = tip_centre(top, X, X)
    offset, moved = X - centre, X + u - tip_centre(top, X, X + u)
    pairs = (moved[:, :, None] * offset[:, None, :]).reshape(-1, 9)
    turned = polar_rotation(tip_mean(top, X, pairs).reshape(3, 3) * _even_pairs(top))
    half = jax.lax.stop_gradient(centre[2]) / (2 * SECTIONS_TO_TIP)
    _, below = _sections(top, X, u, half * (2 * jnp.arange(SECTIONS_TO_TIP) + 1), half)
    return continued_logarithm(turned, jax.lax.stop_gradient(below))


def _even_pairs(top: Topology) -> Array:
    """1 for products of components (3, 3) that a mirror leaves, 0 for those that cancel over the whole body."""
    parity = 2 * top.even - 1
    return (1 + parity[:, None] * parity) / 2


@jax.jit
def _sections(top: Topology, X: Array, u: Array, middles: Array, half: Array | float) -> tuple[Array, Array]:
    """Centres (S, 3) and rotations (S, 3, 3) of slabs, means over the undeformed volume.

    Every slab is weighted by cos² of the distance from its middle: where the geometry moves nodes in and out of a slab
    means change smoothly. The rotation is the polar factor of Σ w (x − x̄) ⊗ (X − X̄).
    """
    measure = (TET_WEIGHT * determinant(reference_gradients(X[top.tets])) * top.weight).T
    place = jnp.einsum("ga,eai->egi", TET_N, X[top.tets])
    moved = place + jnp.einsum("ga,eai->egi", TET_N, u[top.tets])

    def section(middle: Array) -> tuple[Array, Array]:
        away = jnp.clip((place[..., 2] - middle) / half, -1.0, 1.0)
        weight = measure * jnp.cos(jnp.pi / 2 * away) ** 2
        weight = weight / jnp.sum(weight)
        X_mean, x_mean = (top.even * jnp.einsum("eg,egi->i", weight, points) for points in (place, moved))
        moment = jnp.einsum("eg,egi,egj->ij", weight, moved - x_mean, place - X_mean)
        return x_mean, polar_rotation(moment * _even_pairs(top))

    return jax.vmap(section)(middles)
