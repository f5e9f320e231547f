"""The rigid end-effector plate: six unknowns, a translation c (mm) and a rotation vector θ (rad).

The tip face is bonded to the plate, so its nodes are x = X_c + c + exp(θ̂)(X − X_c), with X_c the centroid of the
undeformed tip face.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

COMPONENTS = ("shift_x", "shift_y", "axial", "bending_x", "bending_y", "torsion")


def rotation(theta: Array) -> Array:
    """exp(θ̂), the rotation matrix of a rotation vector θ (3,) in rad (Rodrigues); exact, and smooth at θ = 0."""
    square = jnp.sum(theta * theta)
    small = square < 1e-4
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    # Series where sin(t)/t and (1 − cos t)/t² are 0/0, so that second derivatives stay right; exact to 1e-17 at
    # t² = 1e-4.
    sine = jnp.where(small, 1 - square / 6 + square**2 / 120 - square**3 / 5040, jnp.sin(angle) / angle)
    cosine = jnp.where(small, 0.5 - square / 24 + square**2 / 720 - square**3 / 40320, (1 - jnp.cos(angle)) / angle**2)
    return jnp.eye(3) + sine * skew(theta) + cosine * (jnp.outer(theta, theta) - square * jnp.eye(3))


def skew(a: Array) -> Array:
    """â, the matrix (3, 3) of the cross product with a (3,)."""
    x, y, z = a
    zero = jnp.zeros(())
    return jnp.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])


def rigid_displacement(X: Array, centre: Array, plate: Array) -> Array:
    """Displacements (n, 3) of points X (n, 3) on a plate that moves by plate = [c, θ] about `centre`."""
    turn = rotation(plate[3:]) - jnp.eye(3)
    return plate[:3] + (X - centre) @ turn.T


def rotation_vector(R: np.ndarray) -> np.ndarray:
    """The rotation vector (3,) of a rotation matrix, angle in [0, π]."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine, cosine = np.linalg.norm(axis), (np.trace(R) - 1) / 2
    if sine > 1e-8:
        return axis * (np.arctan2(sine, cosine) / sine)
    if cosine > 0:
        return axis
    # At half a turn the axis is in the symmetric part.
    column = np.argmax(np.diag(R))
    direction = (R + np.eye(3))[:, column]
    return np.pi * direction / np.linalg.norm(direction)
