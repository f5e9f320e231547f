"""Rubbers that remember: softening by earlier stretches (Mullins' effect), and relaxation (a Prony series).

Softening is that of Ogden and Roxburgh (Proceedings of the Royal Society A 455 (1999) 2861): the stress is η ∂ψ/∂F with

    η = 1 − erf((W − ψ)/(m + β W))/r,

where W is the largest ψ so far. While W stays, η ∂ψ/∂F is the derivative of N(ψ; W), ∂N/∂ψ = η.

Relaxation is a Prony series of moduli, quasi-linear (Simo, Computer Methods in Applied Mechanics and Engineering 60
(1987) 153): each part of the moduli, a share g that relaxes in the time τ, has the second Piola-Kirchhoff stress

    Q(t) = g ∫ exp(−(t − s)/τ) dS(s).

S is the elastic stress, of which a hydrostatic part is free. Here it is S = 2 ∂N/∂C of ψ as a function of all symmetric
positive C, with p ln det C such that C = I is free of stress: for neo-Hookean rubber S = μ (I − C⁻¹). Where that
function of C is convex, with N* its conjugate, the energy of a part is g (N(C) + N*(Q₁) − Q₁ : C/2) ≥ 0, Q₁ = S − Q/g,
and what it dissipates is g (C − C(Q₁)) : (S − Q₁)/2τ ≥ 0: no cycle gains energy. For neo-Hookean rubber the parts are
transient networks (Green and Tobolsky, Journal of Chemical Physics 14 (1946) 80).

In a step of the duration Δt, in which S changes linearly, Q′ = e Q + g c (S′ − S) with e = exp(−Δt/τ) and
c = (1 − e) τ/Δt. So the step has a potential,

    a N(ψ(F); W) + ½ H : J^(−2/3) FᵀF,   a = 1 − Σ g + Σ g c,   H = Σ (e Q − g c S).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erf

from pneumorph.mechanics.material.energies import Energy, by_invariants, determinant, log_ratio
from pneumorph.mechanics.material.homogeneous import principal_energy

COMPONENTS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
"""Of symmetric tensors (6, …)."""


class Softening(NamedTuple):
    """Ogden and Roxburgh's 1/r, m in MPa and β; 1/r = 0 for none."""

    most: float = 0.0
    energy: float = 1.0
    slope: float = 0.0


NO_SOFTENING = Softening()


@dataclass(frozen=True)
class Memory:
    """What a rubber remembers.

    Attributes
    ----------
    isochoric : Energy
        ψ_iso of the first pull, infinitely fast.
    parameters : tuple of float
        Of it, with κ at the end.
    shares, times : tuple of float
        Parts of the moduli that relax, and their relaxation times, s.
    softening : Softening
    worst : float
        W before the first step, MPa.
    """

    isochoric: Energy
    parameters: tuple[float, ...]
    shares: tuple[float, ...] = ()
    times: tuple[float, ...] = ()
    softening: Softening = NO_SOFTENING
    worst: float = 0.0


class Past(NamedTuple):
    """The past of points (…): W (…), S (6, …) at the last step, and Q (parts, 6, …), MPa."""

    worst: np.ndarray
    stress: np.ndarray
    parts: np.ndarray


class PointParameters(NamedTuple):
    """Parameters of the potential of a step at points: H (6, …) and W (…); a, 1/r, m, β; and ψ's own.

    The last is κ, as of other parameters.
    """

    held: Any
    worst: Any
    share: Any
    softening: Any
    own: Any
    bulk: Any


def softened(psi: Array, worst: Any, softening: Any) -> Array:
    """N(ψ; W): ψ less what is not got back below W, ∂N/∂ψ = η; `softening` are 1/r, m and β."""
    most, energy, slope = softening
    size = energy + slope * worst
    left = jnp.maximum(worst - psi, 0.0)
    return psi - most * size * (_integral_of_erf(worst / size) - _integral_of_erf(left / size))


def _integral_of_erf(x: Any) -> Array:
    """∫₀ˣ erf = x erf x + (exp(−x²) − 1)/√π."""
    return x * erf(x) + jnp.expm1(-x * x) / np.sqrt(np.pi)


@cache
def after_pulls(isochoric: Energy) -> Energy:
    """N(ψ; W) of an isochoric energy ψ. Parameters: 1/r, m, β, W, then those of ψ."""

    def wrapped(psi: Any) -> Any:
        return lambda at, parameters: softened(psi(at, parameters[4:]), parameters[3], parameters[:3])

    if isochoric.of_invariants is not None:
        return by_invariants(wrapped(isochoric.of_invariants))
    of_stretches = None if isochoric.of_stretches is None else wrapped(isochoric.of_stretches)
    return Energy(wrapped(isochoric.function), of_stretches=of_stretches)


@cache
def in_step(isochoric: Energy) -> Energy:
    """The isochoric potential of a step of a rubber with the energy ψ; its parameters are `PointParameters`."""

    def potential(F: Array, parameters: PointParameters) -> Array:
        elastic = softened(isochoric(F, parameters.own), parameters.worst, parameters.softening)
        right = jnp.stack([jnp.sum(F[:, i] * F[:, j], axis=0) * (1.0 if i == j else 2.0) for i, j in COMPONENTS])
        of_past = 0.5 * jnp.sum(parameters.held * right, axis=0)
        return parameters.share * elastic + jnp.exp(-2.0 / 3.0 * log_ratio(determinant(F))) * of_past

    return Energy(potential)


def at_rest(memory: Memory, shape: tuple[int, ...]) -> Past:
    """The past of points that have rested for long, but for their softening."""
    return Past(np.full(shape, memory.worst), np.zeros((6, *shape)), np.zeros((len(memory.shares), 6, *shape)))


def step_of(memory: Memory, past: Past, duration: float) -> tuple[float, np.ndarray]:
    """a and H (6, …) of a step that takes a duration in s, which may be infinite."""
    kept, ramped = _factors(memory, duration)
    shares = np.array(memory.shares)
    share = 1.0 - float(np.sum(shares * (1.0 - ramped)))
    return share, np.tensordot(kept, past.parts, 1) - float(shares @ ramped) * past.stress


def after(memory: Memory, past: Past, F: np.ndarray, duration: float) -> Past:
    """The past of points after a step that ends at deformation gradients F (3, 3, …).

    Parameters
    ----------
    memory : Memory
    past : Past
        Before it.
    F : (3, 3, …) array
    duration : float
        Of the step, s.
    """
    kept, ramped = _factors(memory, duration)
    psi, stress = energy_and_stress(memory, past.worst, F)
    by_change = np.multiply.outer(np.array(memory.shares) * ramped, stress - past.stress)
    parts = kept.reshape(-1, *[1] * stress.ndim) * past.parts + by_change
    return Past(np.maximum(past.worst, psi), stress, parts)


def _factors(memory: Memory, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """e and c of every part."""
    ratio = duration / np.array(memory.times)
    with np.errstate(invalid="ignore"):
        ramped = np.where(ratio > 0.0, -np.expm1(-ratio) / ratio, 1.0)
    return np.exp(-ratio), ramped


def energy_and_stress(memory: Memory, worst: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ψ (…) and S (6, …) in MPa at deformation gradients F (3, 3, …), where W was the largest ψ before.

    Parameters
    ----------
    memory : Memory
    worst : (…) array
        W before, MPa.
    F : (3, 3, …) array
    """
    shape = F.shape[2:]
    flat = F.reshape(3, 3, -1)
    ratio = np.asarray(determinant(jnp.asarray(flat)))
    C = np.einsum("kin,kjn->nij", flat, flat) / np.cbrt(ratio**2)[:, None, None]
    squares, axes = np.linalg.eigh(C)
    logs, parameters = 0.5 * np.log(squares.T), np.array(memory.parameters)
    psi, slope = _by_logs(memory.isochoric, parameters, logs)
    _, at_rest = _by_logs(memory.isochoric, parameters, np.zeros((3, 1)))
    psi = np.array(psi)
    eta = _eta(psi, np.maximum(worst.ravel(), psi), memory.softening)
    principal = eta * np.asarray(slope - at_rest) / squares.T
    stress = np.einsum("nia,an,nja->ijn", axes, principal, axes)
    return psi.reshape(shape), np.stack([stress[pair] for pair in COMPONENTS]).reshape(6, *shape)


def _eta(psi: np.ndarray, worst: np.ndarray, softening: Softening) -> np.ndarray:
    most, energy, slope = softening
    return 1.0 - most * np.asarray(erf((worst - psi) / (energy + slope * worst)))


@partial(jax.jit, static_argnums=0)
def _by_logs(energy: Energy, parameters: Array, logs: Array) -> tuple[Array, Array]:
    """ψ (n,) and its derivatives (3, n) by the logarithms of principal stretches."""
    value, back = jax.vjp(lambda logs: principal_energy(energy, parameters, logs), logs)
    return value, back(jnp.ones_like(value))[0]
