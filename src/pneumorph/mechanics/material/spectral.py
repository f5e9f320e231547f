"""Powers of symmetric positive matrices (3, 3, …), with derivatives that are right where eigenvalues are equal.

A function of eigenvalues is smooth where two of them meet, but eigenvectors are not. So nothing here is differentiated
through an eigenvalue solver: the derivative of Cᵖ along Ċ is Q (Φ ∘ QᵀĊQ) Qᵀ with the divided differences
Φ_ab = (c_aᵖ − c_bᵖ)/(c_a − c_b) (Daleckii and Krein; Higham, Functions of Matrices, 2008, §3.2). Written with
hyperbolic sines, these tend to p cᵖ⁻¹ without cancellation.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

SWEEPS = 5
"""Sweeps of Jacobi's method: it converges quadratically, and four reach rounding error for 3×3 matrices."""

SMALLEST = 1e-8
"""Smallest eigenvalue whose logarithm is taken; smaller ones occur only in elements being turned inside out."""


class Spectrum(NamedTuple):
    """Logarithms of eigenvalues (3, …) and eigenvectors as columns (3, 3, …), not differentiated."""

    logs: Array
    Q: Array


def spectrum(C: Array) -> Spectrum:
    """The spectrum of symmetric positive matrices C (3, 3, …), by Jacobi's method.

    For all points at once, and accurate where eigenvalues are equal, unlike closed forms.
    """
    C = jax.lax.stop_gradient(C)
    start = jnp.broadcast_to(jnp.eye(3).reshape(3, 3, *[1] * (C.ndim - 2)), C.shape)
    # As a loop: unrolled, the compiler would compute the rotations again wherever they are used, and take long for it.
    C, Q = jax.lax.fori_loop(0, 3 * SWEEPS, lambda _, state: _turn(*state), (C, start))
    values = jnp.stack([C[i, i] for i in range(3)])
    return Spectrum(jnp.log(jnp.maximum(values, SMALLEST)), Q)


@jax.custom_jvp
def trace_of_power(C: Array, p: Array, at: Spectrum) -> Array:
    """tr Cᵖ (…) of symmetric positive matrices C (3, 3, …) with spectrum `at`; may be differentiated twice."""
    return jnp.sum(jnp.exp(p * at.logs), axis=0)


@trace_of_power.defjvp
def _trace_along(primals, tangents):
    (C, p, at), (dC, dp, _) = primals, tangents
    change = p * jnp.sum(power(C, p - 1.0, at) * dC, axis=(0, 1)) + dp * _trace_of_logarithm(C, p, at)
    # The value goes through its own rule again, for `at` is a constant in derivatives of this one.
    return trace_of_power(C, p, at), change


@jax.custom_jvp
def _trace_of_logarithm(C: Array, p: Array, at: Spectrum) -> Array:
    """tr(Cᵖ ln C) (…), the derivative of tr Cᵖ by p; may be differentiated once."""
    return jnp.sum(jnp.exp(p * at.logs) * at.logs, axis=0)


@_trace_of_logarithm.defjvp
def _trace_of_logarithm_along(primals, tangents):
    (C, p, at), (dC, dp, _) = primals, tangents
    logs, Q = at
    slope = _assembled(Q, jnp.exp((p - 1.0) * logs) * (1.0 + p * logs))
    change = jnp.sum(slope * dC, axis=(0, 1)) + dp * jnp.sum(jnp.exp(p * logs) * logs**2, axis=0)
    return _trace_of_logarithm(C, p, at), change


@jax.custom_jvp
def power(C: Array, p: Array, at: Spectrum) -> Array:
    """Cᵖ (3, 3, …) of symmetric positive matrices C (3, 3, …) with spectrum `at`; may be differentiated once."""
    return _assembled(at.Q, jnp.exp(p * at.logs))


@power.defjvp
def _power_along(primals, tangents):
    (C, p, at), (dC, dp, _) = primals, tangents
    logs, Q = at
    powers = jnp.exp(p * logs)
    half = 0.5 * (logs[:, None] - logs[None, :])
    middle = 0.5 * (logs[:, None] + logs[None, :])
    differences = p * jnp.exp((p - 1.0) * middle) * _sinhc(p * half) / _sinhc(half)
    # Computed once for all directions dC, not again in the loop over them.
    differences = jax.lax.optimization_barrier(differences)
    turned = differences * _product(_transposed(Q), _product(dC, Q))
    change = _product(Q, _product(turned, _transposed(Q))) + dp * _assembled(Q, powers * logs)
    return power(C, p, at), change


def _turn(C: Array, Q: Array) -> tuple[Array, Array]:
    """A rotation of the first two axes, so that C's element between them vanishes; then all axes move on by one."""
    gap, off = C[1, 1] - C[0, 0], 2.0 * C[0, 1]
    span = jnp.abs(gap) + jnp.sqrt(gap * gap + off * off)
    tangent = jnp.where(gap < 0, -off, off) / jnp.where(span > 0, span, 1.0)
    cosine = 1.0 / jnp.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    first, second = C[0, 0] - tangent * C[0, 1], C[1, 1] + tangent * C[0, 1]
    beside_first, beside_second = cosine * C[0, 2] - sine * C[1, 2], sine * C[0, 2] + cosine * C[1, 2]
    zero = jnp.zeros_like(off)
    turned = [[second, beside_second, zero], [beside_second, C[2, 2], beside_first], [zero, beside_first, first]]
    columns = [sine * Q[:, 0] + cosine * Q[:, 1], Q[:, 2], cosine * Q[:, 0] - sine * Q[:, 1]]
    return jnp.stack([jnp.stack(row) for row in turned]), jnp.stack(columns, axis=1)


def _sinhc(x: Array) -> Array:
    """sinh x / x."""
    small = jnp.abs(x) < 1e-3
    safe = jnp.where(small, 1.0, x)
    return jnp.where(small, 1.0 + x * x / 6.0 * (1.0 + x * x / 20.0), jnp.sinh(safe) / safe)


def _product(A: Array, B: Array) -> Array:
    """A·B, element by element: a sum over an axis of a larger array takes twice as long."""
    rows = [[A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j] for j in range(3)] for i in range(3)]
    return jnp.stack([jnp.stack(row) for row in rows])


def _transposed(A: Array) -> Array:
    return jnp.swapaxes(A, 0, 1)


def _assembled(Q: Array, values: Array) -> Array:
    """Q diag(values) Qᵀ."""
    return _product(Q * values[None], _transposed(Q))
