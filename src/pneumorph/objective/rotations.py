"""Best-fit rotations, rotation vectors and the angle between rotations, all differentiable by JAX."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.plate import skew


@jax.custom_jvp
def polar_rotation(M: Array) -> Array:
    """The rotation R (3, 3) nearest to M, for which Rᵀ M is symmetric; M may be of rank 2.

    A singular value decomposition is not differentiable where two singular values are equal, as on every round section,
    but R is: with S = Rᵀ M and dR = R Ω, Ω S + S Ω = Rᵀ dM − dMᵀ R.
    """
    U, _, V = jnp.linalg.svd(M)
    sign = jnp.sign(jnp.linalg.det(U @ V))
    return U @ jnp.diag(jnp.array([1.0, 1.0, 1.0]).at[2].set(sign)) @ V


@polar_rotation.defjvp
def _polar_rotation_jvp(primals, tangents):
    (M,), (dM,) = primals, tangents
    R = polar_rotation(M)
    S = R.T @ M
    turned = R.T @ dM
    # For a skew-symmetric Ω with axial vector ω, Ω S + S Ω is the skew-symmetric matrix of (tr S − S) ω.
    omega = jnp.linalg.solve(jnp.trace(S) * jnp.eye(3) - S, 2 * axial(turned))
    return R, R @ skew(omega)


def axial(A: Array) -> Array:
    """Axial vector (3,) of the skew-symmetric part of A (3, 3)."""
    return jnp.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]]) / 2


def rotation_logarithm(R: Array) -> Array:
    """Rotation vector (3,) in rad of a rotation matrix by less than π; smooth at the identity."""
    axis = axial(R)
    square = jnp.sum(axis * axis)
    cosine = (jnp.trace(R) - 1) / 2
    small = (square < 1e-6) & (cosine > 0)
    sine = jnp.sqrt(jnp.where(small, 1.0, square))
    factor = jnp.where(small, 1 + square / 6 + 3 * square**2 / 40, jnp.arctan2(sine, cosine) / sine)
    return factor * axis


def continued_logarithm(R: Array, before: Array) -> Array:
    """Rotation vector of R (3, 3) in rad with full turns, which are counted along a chain of rotations (n, 3, 3) to R.

    Each rotation of the chain is less than half a turn from the previous one, and the first from the identity.
    """
    chain = jnp.concatenate([jnp.eye(3)[None], before, R[None]])
    steps = jax.vmap(lambda last, following: rotation_logarithm(following @ last.T))(chain[:-1], chain[1:])
    vector, total = rotation_logarithm(R), jnp.sum(steps, axis=0)
    angle = jnp.sqrt(jnp.maximum(jnp.sum(vector * vector), 1e-24))
    turns = jnp.round((total - vector) @ vector / angle / (2 * jnp.pi))
    return vector * (1 + 2 * jnp.pi * jax.lax.stop_gradient(turns) / angle)


def angle_residual(R: Array, target: Array) -> Array:
    """√2 times the rotation vector (3,) of Rᵀ R* in rad, with R* the target; its square is (10) of the paper.

    That is ‖log(Rᵀ R*)‖² in the Frobenius norm, twice the squared angle between the two rotations.
    """
    return np.sqrt(2.0) * rotation_logarithm(R.T @ target)
