"""Features of an equilibrium: motion of the end-effector and chamber volumes, differentiable by JAX."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from pneumorph.mechanics.model import Model
from pneumorph.mechanics.potential import State, chamber_volumes, displacement, tip_centre, tip_mean


class Features(NamedTuple):
    """What objectives are functions of.

    translation (3,) mm and rotation vector (3,) rad of the end-effector; volume (C,) mm³ of the inflated chambers. All
    of the whole body, where the model is half of one too.
    """

    translation: Array
    rotation: Array
    volume: Array


def features(model: Model, X: Array, state: State) -> Features:
    """Features of a state on nodes X (N, 3), both padded.

    With a plate the motion is its own. A free tip has the area mean of the displacement as its translation, and as its
    rotation the polar factor of its mean deformation.
    """
    u = displacement(model.top, X, state)
    volume = model.copies * chamber_volumes(model.top, X + u)
    if model.plate:
        return Features(state.plate[:3], state.plate[3:], volume)
    return Features(tip_centre(model.top, X, u), _face_rotation(model, X, X + u), volume)


def _face_rotation(model: Model, X: Array, x: Array) -> Array:
    """Rotation vector of the tip face: polar factor of the mean of (x − x̄) ⊗ (X − X̄).

    The normal, which a flat face leaves open, is completed by the cross product.
    """
    offset, moved = X - tip_centre(model.top, X, X), x - tip_centre(model.top, X, x)
    pairs = (moved[:, :, None] * offset[:, None, :2]).reshape(-1, 6)
    parity = 2 * model.top.even - 1
    # Products that a mirror turns round cancel over the whole face.
    moment = tip_mean(model.top, X, pairs).reshape(3, 2) * (1 + parity[:, None] * parity[:2]) / 2
    # Polar factor of a 3×2 matrix M (MᵀM)^(−1/2), the root of a 2×2 matrix in closed form.
    square = moment.T @ moment
    det = jnp.sqrt(square[0, 0] * square[1, 1] - square[0, 1] ** 2)
    root = (square + det * jnp.eye(2)) / jnp.sqrt(square[0, 0] + square[1, 1] + 2 * det)
    axes = moment @ jnp.linalg.inv(root)
    return rotation_logarithm(jnp.column_stack([axes, jnp.cross(axes[:, 0], axes[:, 1])]))


def rotation_logarithm(R: Array) -> Array:
    """Rotation vector (3,) of a rotation matrix turned by less than π; smooth at the identity."""
    axis = jnp.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    square = jnp.sum(axis * axis)
    cosine = (jnp.trace(R) - 1) / 2
    small = (square < 1e-6) & (cosine > 0)
    sine = jnp.sqrt(jnp.where(small, 1.0, square))
    factor = jnp.where(small, 1 + square / 6 + 3 * square**2 / 40, jnp.arctan2(sine, cosine) / sine)
    return factor * axis
