"""Isochoric strain-energy densities ψ_iso(F, parameters): one function for each model, everything else its derivatives.

All take deformation gradients F (3, 3, …), whose trailing axes are points, and parameters that end with the bulk
modulus, which they do not use; the result (…) is in MPa. They depend on C̄ = J^(−2/3) FᵀF alone: by its invariants
Ī₁ = tr C̄ and Ī₂ = tr C̄⁻¹, and then are written as functions of the `Invariants` of F, or by its principal stretches λ̄.
None of them gives NaN for any finite F: see `log_ratio` for J near zero and below, and each model for stretches it
cannot bear. Derivatives are exact to the second order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from pneumorph.mechanics.material.spectral import Spectrum, spectrum, trace_of_power


@dataclass(frozen=True)
class Energy:
    """ψ(F, parameters) in MPa, or for elements ψ(F, π, parameters), where only mixed ones use π.

    Attributes
    ----------
    function : callable
        Takes deformation gradients F (3, 3, …), then the other arguments. Its derivatives are exact also where
        principal stretches are equal.
    of_invariants : callable, optional
        The same energy as a function of the `Invariants` of F in its place, where it depends on them alone: all its
        second derivatives by F then follow from nine by the invariants.
    of_stretches : callable, optional
        The same as a function of the principal `Stretches` of F in its place.
    """

    function: Callable[..., Array]
    of_invariants: Callable[..., Array] | None = None
    of_stretches: Callable[..., Array] | None = None

    def __call__(self, F: Array, *rest: Any) -> Array:
        return self.function(F, *rest)


def by_invariants(function: Callable[..., Array]) -> Energy:
    """The energy that is a function of `Invariants` and the arguments that follow F."""
    return Energy(lambda F, *rest: function(invariants(F), *rest), of_invariants=function)


@cache
def along_parameters(energy: Energy) -> Energy:
    """∂ψ/∂θ·δ of an energy ψ(F, …, θ) as a function of (F, …, [θ, δ]), with parameters (2, m)."""

    def along(function):
        def changed(at, *rest):
            *others, (own, change) = rest
            return jax.jvp(lambda own: function(at, *others, own), (own,), (change,))[1]

        return changed

    if (shape := energy.of_invariants) is not None:
        return by_invariants(along(shape))
    of_stretches = None if energy.of_stretches is None else along(energy.of_stretches)
    return Energy(along(energy.function), of_stretches=of_stretches)


def determinant(F: Array) -> Array:
    """Determinant of 3×3 matrices (3, 3, …), written out so that it compiles into the loop over the points."""
    return (
        F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
        + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
    )


SMALLEST_RATIO = 0.1
"""Volume ratio J below which ln J is continued by another function; no such state is accepted."""


def log_ratio(J: Array) -> Array:
    """ln J; below δ = `SMALLEST_RATIO` and for negative J, ln δ²/(2δ − J), which has the same value and slope at δ.

    A field interpolated from another mesh may turn elements inside out. With a finite energy there, a minimisation
    turns them back; with ln J it could not start.
    """
    low = J < SMALLEST_RATIO
    return jnp.where(
        low,
        2 * jnp.log(SMALLEST_RATIO) - jnp.log(jnp.where(low, 2 * SMALLEST_RATIO - J, 1.0)),
        jnp.log(jnp.where(low, 1.0, J)),
    )


class Invariants(NamedTuple):
    """I₁ = tr FᵀF, I₂ = |cof F|² and J = det F of deformation gradients, each (…)."""

    first: Array
    second: Array
    ratio: Array


class Stretches(NamedTuple):
    """The logarithms (3, …) of the principal stretches of deformation gradients, and J = det F (…)."""

    logs: Array
    ratio: Array


def invariants(F: Array) -> Invariants:
    """The invariants of deformation gradients F (3, 3, …)."""
    cofactor = jnp.stack([jnp.cross(F[:, i - 2], F[:, i - 1], axis=0) for i in range(3)])
    return Invariants(jnp.sum(F * F, axis=(0, 1)), jnp.sum(cofactor * cofactor, axis=(0, 1)), determinant(F))


def first_bar(of: Invariants) -> Array:
    """Ī₁ = J^(−2/3) I₁."""
    # exp and log run as vector instructions where a power does not.
    return of.first * jnp.exp(-2.0 / 3.0 * log_ratio(of.ratio))


def second_bar(of: Invariants) -> Array:
    """Ī₂ = J^(−4/3) I₂."""
    return of.second * jnp.exp(-4.0 / 3.0 * log_ratio(of.ratio))


@by_invariants
def neo_hookean(of: Invariants, parameters: Array) -> Array:
    """Isochoric part of the paper's (41): μ/2 (Ī₁ − 3). Parameters: μ, κ in MPa."""
    return 0.5 * parameters[0] * (first_bar(of) - 3.0)


@by_invariants
def mooney_rivlin(of: Invariants, parameters: Array) -> Array:
    """c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) (Mooney 1940, Rivlin 1948). Parameters: c₁₀, c₀₁, κ in MPa; μ = 2 (c₁₀ + c₀₁)."""
    return parameters[0] * (first_bar(of) - 3.0) + parameters[1] * (second_bar(of) - 3.0)


@by_invariants
def polynomial(of: Invariants, parameters: Array) -> Array:
    """Σ cᵢⱼ (Ī₁ − 3)ⁱ (Ī₂ − 3)ʲ up to i + j = 2 (Rivlin and Saunders 1951).

    Parameters: c₁₀, c₀₁, c₂₀, c₁₁, c₀₂, κ in MPa. It is the five-parameter Mooney-Rivlin model of finite-element
    programs; μ = 2 (c₁₀ + c₀₁).
    """
    one, two = first_bar(of) - 3.0, second_bar(of) - 3.0
    c10, c01, c20, c11, c02 = (parameters[i] for i in range(5))
    return one * (c10 + c20 * one + c11 * two) + two * (c01 + c02 * two)


@by_invariants
def yeoh(of: Invariants, parameters: Array) -> Array:
    """Σ cᵢ (Ī₁ − 3)ⁱ with any number of coefficients (Yeoh 1993). Parameters: c₁, c₂, …, κ in MPa; μ = 2 c₁."""
    excess = first_bar(of) - 3.0
    coefficients = [parameters[i] for i in reversed(range(len(parameters) - 1))]
    return reduce(lambda value, c: value * excess + c, coefficients, jnp.zeros_like(excess)) * excess


GENT_END = 0.99
"""Fraction of the limit J_m up to which Gent's logarithm is used."""


@by_invariants
def gent(of: Invariants, parameters: Array) -> Array:
    """−μ J_m/2 ln(1 − x), x = (Ī₁ − 3)/J_m (Gent 1996). Parameters: μ in MPa, the limit J_m, κ in MPa.

    Beyond x = `GENT_END` the logarithm goes on as its quadratic Taylor polynomial there: same value, stress and
    stiffness, finite everywhere and a hundred times stiffer than at rest, so that no solver meets the logarithm of a
    negative number. Such a state is beyond the model and reported as such (`Rubber.valid_stretch`).
    """
    shear, limit = parameters[0], parameters[1]
    used = (first_bar(of) - 3.0) / limit
    rest = 1.0 - jnp.minimum(used, GENT_END)
    beyond = jnp.maximum(used - GENT_END, 0.0) / (1.0 - GENT_END)
    return 0.5 * shear * limit * (-jnp.log(rest) + beyond + 0.5 * beyond**2)


ARRUDA_BOYCE = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)
"""Coefficients of the inverse Langevin function's series, integrated (Arruda and Boyce 1993, their (18))."""


@by_invariants
def arruda_boyce(of: Invariants, parameters: Array) -> Array:
    """μ Σ Cᵢ λ_m^(2 − 2i) (Ī₁ⁱ − 3ⁱ), i = 1…5 (Arruda and Boyce 1993). Parameters: μ in MPa, λ_m, κ in MPa.

    The series of the eight-chain model, as finite-element programs have it: a polynomial, finite and stiffening also
    beyond the locking stretch λ_m = √(Ī₁/3), where the model itself is not defined. μ is n k T of the chains; the
    initial shear modulus is larger by the factor 1 + 3/(5 λ_m²) + …
    """
    shear, locking = parameters[0], parameters[1]
    stretched, at_rest = first_bar(of) / locking**2, 3.0 / locking**2
    terms = [C * (stretched**i - at_rest**i) for i, C in enumerate(ARRUDA_BOYCE, start=1)]
    return shear * locking**2 * sum(terms[1:], start=terms[0])


def _ogden(F: Array, parameters: Array) -> Array:
    C = jnp.sum(F[:, :, None] * F[:, None, :], axis=0)
    at = spectrum(C)
    isochoric = log_ratio(determinant(F)) / 3.0
    # All terms at once, on an axis before the points: one after the other, each would be compiled for itself.
    modulus, exponent = _terms(parameters, isochoric.ndim)
    logs, Q = at
    powers = trace_of_power(C[:, :, None], 0.5 * exponent, Spectrum(logs[:, None], Q[:, :, None]))
    return jnp.sum(2.0 * modulus / exponent**2 * (powers * jnp.exp(-exponent * isochoric) - 3.0), axis=0)


def _ogden_of_stretches(of: Stretches, parameters: Array) -> Array:
    modulus, exponent = _terms(parameters, of.ratio.ndim)
    powers = jnp.exp(exponent * (of.logs - log_ratio(of.ratio) / 3.0)[:, None]).sum(axis=0)
    return jnp.sum(2.0 * modulus / exponent**2 * (powers - 3.0), axis=0)


def _terms(parameters: Array, dimensions: int) -> Array:
    """Moduli and exponents (2, terms, …) with so many axes for the points."""
    return parameters[:-1].reshape(-1, 2, *[1] * dimensions).swapaxes(0, 1)


ogden = Energy(_ogden, of_stretches=_ogden_of_stretches)
"""Σ 2 μᵢ/αᵢ² (λ̄₁^αᵢ + λ̄₂^αᵢ + λ̄₃^αᵢ − 3), any number of terms (Ogden 1972). Parameters: μ₁, α₁, μ₂, α₂, …, κ.

The moduli (MPa) add up to the initial shear modulus, μ = Σ μᵢ. Ogden's own are 2 μᵢ/αᵢ.
"""
