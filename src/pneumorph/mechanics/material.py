"""Strain-energy densities ψ(F): a rubber is one function, everything else is its derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import jax
import jax.numpy as jnp
from jax import Array

Energy = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Rubber:
    """A hyperelastic solid, ψ(F) = ψ_iso(F) + U(J) with U = κ/2 (J − 1)².

    Parameters
    ----------
    isochoric : callable
        ψ_iso(F, parameters) in MPa, blind to a change of volume, for deformation gradients F (3, 3, …); the trailing
        axes are points.
    parameters : tuple of float
        What ψ takes, in MPa or pure numbers; the last is the bulk modulus κ.
    density : float
        Mass density of the undeformed rubber, t/mm³.
    """

    isochoric: Energy
    parameters: tuple[float, ...]
    density: float

    @property
    def energy(self) -> Energy:
        """ψ(F, parameters), MPa: one and the same function for all rubbers of a model, so that it is compiled once."""
        return complete(self.isochoric)

    @property
    def bulk_modulus(self) -> float:
        """κ, MPa."""
        return self.parameters[-1]

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus μ in MPa: the curvature of ψ in a simple shear of the undeformed rubber."""
        return _initial_shear_modulus(self.isochoric, self.parameters)


@cache
def complete(isochoric: Energy) -> Energy:
    """ψ(F, parameters) = ψ_iso + κ/2 (J − 1)² of an isochoric energy; κ is the last of the parameters."""

    def energy(F: Array, parameters: Array) -> Array:
        return isochoric(F, parameters) + 0.5 * parameters[-1] * (determinant(F) - 1.0) ** 2

    return energy


@cache
def _initial_shear_modulus(isochoric: Energy, parameters: tuple[float, ...]) -> float:
    shear = jnp.zeros((3, 3)).at[0, 1].set(1.0)
    given = jnp.asarray(parameters, dtype=float)
    return float(jax.grad(jax.grad(lambda amount: isochoric(jnp.eye(3) + amount * shear, given)))(0.0))


def determinant(F: Array) -> Array:
    """Determinant of 3×3 matrices (3, 3, …), written out so that it compiles into the loop over the points."""
    return (
        F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
        + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
    )


SMALLEST_RATIO = 0.1
"""Volume ratio J below which J is replaced in ln J; no rubber bears that, and no such state is accepted."""


def log_ratio(J: Array) -> Array:
    """ln J; below δ = `SMALLEST_RATIO`, and for negative J, ln δ²/(2δ − J): it goes on with the same value and slope.

    A field that is interpolated from another mesh may turn elements inside out. With a finite energy there, a descent
    turns them back; with ln J it could not even begin.
    """
    low = J < SMALLEST_RATIO
    return jnp.where(
        low,
        2 * jnp.log(SMALLEST_RATIO) - jnp.log(jnp.where(low, 2 * SMALLEST_RATIO - J, 1.0)),
        jnp.log(jnp.where(low, 1.0, J)),
    )


def neo_hookean(F: Array, parameters: Array) -> Array:
    """Isochoric part of the generalised neo-Hookean energy, the paper's (41): μ/2 (J^(−2/3) tr FᵀF − 3).

    Parameters
    ----------
    F : (3, 3, …) deformation gradients.
    parameters : (2,) shear modulus μ and bulk modulus κ, MPa.
    """
    # exp and log run as vector instructions where a power does not.
    return 0.5 * parameters[0] * (jnp.sum(F * F, axis=(0, 1)) * jnp.exp(-2.0 / 3.0 * log_ratio(determinant(F))) - 3.0)


def rubber(shear_modulus: float, bulk_modulus: float, density: float) -> Rubber:
    """The neo-Hookean rubber of the given moduli (MPa) and density (t/mm³)."""
    return Rubber(neo_hookean, (shear_modulus, bulk_modulus), density)
