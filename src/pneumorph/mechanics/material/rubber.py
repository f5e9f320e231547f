"""A rubber: an isochoric energy, a bulk modulus, a mass density, and the stretch up to which they are valid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import ArrayLike

from pneumorph.mechanics.material.energies import Energy, by_invariants, determinant, neo_hookean
from pneumorph.mechanics.material.homogeneous import shear_modulus
from pneumorph.mechanics.material.memory import Memory


@dataclass(frozen=True)
class Rubber:
    """A hyperelastic solid, ψ(F) = ψ_iso(F) + U(J) with U = κ/2 (J − 1)².

    Parameters
    ----------
    isochoric : callable
        ψ_iso(F, parameters) in MPa, independent of the volume ratio, for F (3, 3, …) whose trailing axes are points.
        One of `energies`.
    parameters : tuple of float
        Parameters of ψ, in MPa or dimensionless; the last is the bulk modulus κ.
    density : float
        Mass density of the undeformed rubber, t/mm³.
    valid_stretch : float, optional
        Largest principal stretch for which the parameters are valid; None if unknown.
    memory : Memory, optional
        What it remembers along histories of loads, which ψ leaves out.
    """

    isochoric: Energy
    parameters: tuple[float, ...]
    density: float
    valid_stretch: float | None = None
    memory: Memory | None = None

    @property
    def energy(self) -> Energy:
        """ψ(F, parameters), MPa: the same function object for all rubbers of a kind, so that it is compiled once."""
        return complete(self.isochoric)

    @property
    def bulk_modulus(self) -> float:
        """κ, MPa."""
        return self.parameters[-1]

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus μ in MPa, from the second derivative of ψ at rest."""
        return _initial_shear_modulus(self.isochoric, self.parameters)

    def beyond(self, stretch: float) -> bool:
        """Whether a principal stretch is beyond the valid range of the parameters."""
        return self.valid_stretch is not None and stretch > self.valid_stretch


@cache
def complete(isochoric: Energy) -> Energy:
    """ψ(F, …, parameters) = ψ_iso + κ/2 (J − 1)² of an isochoric energy; κ is the last of the parameters."""
    return with_volume(isochoric, lambda J, *rest: 0.5 * rest[-1][-1] * (J - 1.0) ** 2)


def with_volume(isochoric: Energy, volumetric: Callable[..., Array]) -> Energy:
    """The energy ψ_iso(F, parameters) + U(J, …, parameters) as a function of (F, …, parameters).

    It is a function of invariants, or of stretches, if ψ_iso is one.
    """

    def whole(shape: Callable[..., Array]) -> Callable[..., Array]:
        return lambda of, *rest: shape(of, rest[-1]) + volumetric(of.ratio, *rest)

    if isochoric.of_invariants is not None:
        return by_invariants(whole(isochoric.of_invariants))
    of_stretches = None if isochoric.of_stretches is None else whole(isochoric.of_stretches)
    return Energy(
        lambda F, *rest: isochoric(F, rest[-1]) + volumetric(determinant(F), *rest), of_stretches=of_stretches
    )


def nominal_stress(energy: Energy, F: np.ndarray, *rest: ArrayLike) -> np.ndarray:
    """∂ψ/∂F (3, 3, …) in MPa of an energy ψ(F, …, parameters) at deformation gradients F (3, 3, …)."""
    return np.asarray(_slope(energy, F, *rest))


@partial(jax.jit, static_argnums=0)
def _slope(energy: Energy, F: Array, *rest: Array) -> Array:
    return jax.grad(lambda F: jnp.sum(energy(F, *rest)))(F)


@cache
def _initial_shear_modulus(isochoric: Energy, parameters: tuple[float, ...]) -> float:
    return shear_modulus(isochoric, np.array(parameters[:-1]))


def neo_hookean_rubber(shear_modulus: float, bulk_modulus: float, density: float) -> Rubber:
    """The neo-Hookean rubber of the given moduli (MPa) and density (t/mm³)."""
    return Rubber(neo_hookean, (shear_modulus, bulk_modulus), density)
