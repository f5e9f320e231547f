"""Stress and stability of incompressible rubbers in uniaxial, equibiaxial and planar tension (pure shear)."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics.material.energies import Energy, Invariants, Stretches

DIRECTIONS = {"uniaxial": (1.0, -0.5), "equibiaxial": (1.0, 1.0), "planar": (1.0, 0.0)}
"""Logarithms of the first two principal stretches over that of the first, of each mode."""

PULLED = {"uniaxial": 1, "equibiaxial": 2, "planar": 1}
"""Number of directions in which a mode does work."""

POINTS = 200
"""Stretches at which stability is looked at: steps of a hundredth up to a stretch of 3."""


def nominal_stress(
    energy: Energy, parameters: np.ndarray, stretch: np.ndarray, mode: str | np.ndarray = "uniaxial"
) -> np.ndarray:
    """Nominal stress (n,) in MPa of an incompressible rubber pulled to the stretches (n,).

    It is dψ/dλ of diag(λ, λ^a, λ^(−1−a)), over the number of directions pulled; a as in `DIRECTIONS`.

    Parameters
    ----------
    energy : Energy
        One of `energies`.
    parameters : (m,) of the energy, without κ.
    stretch : (n,)
    mode : one of `DIRECTIONS`, or one for each stretch (n,).
    """
    modes = np.broadcast_to(mode, np.shape(stretch))
    directions = np.array([DIRECTIONS[str(one)] for one in modes]).reshape(-1, 2).T
    pulled = np.array([PULLED[str(one)] for one in modes], dtype=float)
    slope = _slope(energy, _with_bulk(parameters), jnp.asarray(stretch, dtype=float), jnp.asarray(directions))
    return np.asarray(slope) / pulled


@partial(jax.jit, static_argnums=0)
def _slope(energy: Energy, parameters: jax.Array, stretch: jax.Array, directions: jax.Array) -> jax.Array:
    return jax.grad(lambda stretch: jnp.sum(_principal_energy(energy, parameters, jnp.log(stretch) * directions)))(
        stretch
    )


def first_invariant(stretch: np.ndarray, mode: str) -> np.ndarray:
    """Ī₁ (n,) at stretches (n,) of a mode."""
    first, second = DIRECTIONS[mode]
    return stretch ** (2 * first) + stretch ** (2 * second) + stretch ** (-2 * (first + second))


def stretch_at(invariant: float, mode: str) -> float:
    """The stretch above 1 of a mode at which Ī₁ has a value above 3."""
    low, high = 1.0, float(np.sqrt(invariant))
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if first_invariant(np.array(middle), mode) < invariant else (low, middle)
    return high


def stable_up_to(energy: Energy, parameters: np.ndarray, mode: str, reach: float) -> float:
    """The stretch up to which Drucker's condition holds, from 1 to `reach` at most, in a mode of `DIRECTIONS`.

    It asks Σ dτ_a dε_a > 0 of the Kirchhoff stresses τ for every isochoric change of the logarithmic strains ε: the
    second derivative of ψ with regard to two of them, with −ε₁ − ε₂ as the third, is positive definite.

    Parameters
    ----------
    energy : Energy
        One of `energies`.
    parameters : (m,) of the energy, without κ.
    mode : one of `DIRECTIONS`.
    reach : float
        The largest stretch that is looked at.
    """
    stretch = np.linspace(1.0, reach, POINTS)
    logs = np.log(stretch) * np.array(DIRECTIONS[mode])[:, None]
    softest = np.linalg.eigvalsh(np.moveaxis(np.asarray(_hessian(energy, _with_bulk(parameters), logs)), -1, 0))[:, 0]
    failed = np.flatnonzero(~(softest > 0))
    return float(stretch[max(failed[0] - 1, 0)]) if len(failed) else float(reach)


def shear_modulus(energy: Energy, parameters: np.ndarray) -> float:
    """The initial shear modulus μ, MPa: ψ is μ (ε₁² + ε₂² + (ε₁ + ε₂)²) of small logarithmic strains."""
    # As many points as `stable_up_to` has, so that nothing else is compiled.
    return float(np.asarray(_hessian(energy, _with_bulk(parameters), np.zeros((2, POINTS))))[0, 0, 0]) / 4.0


@partial(jax.jit, static_argnums=0)
def _hessian(energy: Energy, parameters: jax.Array, logs: jax.Array) -> jax.Array:
    """∂²ψ/∂ε∂ε (2, 2, n)."""
    slope = jax.grad(lambda logs: jnp.sum(_principal_energy(energy, parameters, logs)))
    units = jnp.broadcast_to(jnp.eye(2)[:, :, None], (2, *logs.shape))
    return jax.vmap(lambda unit: jax.jvp(slope, (logs,), (unit,))[1])(units)


def _principal_energy(energy: Energy, parameters: jax.Array, logs: jax.Array) -> jax.Array:
    """ψ (n,) of isochoric stretches along the axes, from the logarithms of the first two (2, n)."""
    return principal_energy(energy, parameters, jnp.stack([logs[0], logs[1], -logs[0] - logs[1]]))


def principal_energy(energy: Energy, parameters: jax.Array, logs: jax.Array) -> jax.Array:
    """ψ (n,) of stretches along the axes, from their logarithms (3, n).

    Where these do not add up to zero, as those of isochoric stretches do, the formula of ψ is used all the same. The
    parameters end with κ, which is not used.
    """
    # Without F, which takes ten times as long to compile.
    if energy.of_stretches is not None:
        return energy.of_stretches(Stretches(logs, jnp.ones(logs.shape[1:])), parameters)
    if energy.of_invariants is not None:
        squares = jnp.exp(2.0 * logs)
        at = Invariants(squares.sum(0), (1.0 / squares).sum(0), jnp.ones(logs.shape[1:]))
        return energy.of_invariants(at, parameters)
    return energy(jnp.eye(3)[:, :, None] * jnp.exp(logs)[:, None], parameters)


def _with_bulk(parameters: np.ndarray) -> np.ndarray:
    """The parameters with a bulk modulus at the end, which isochoric energies do not use."""
    return np.append(np.asarray(parameters, dtype=float), 0.0)
