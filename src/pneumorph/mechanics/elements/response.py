"""Stress, moduli and what they change by at quadrature points: JAX differentiates ψ, Numba kernels do the rest.

In invariants there are nine second derivatives at a point instead of eighty-one, and in principal stretches and J ten.
Energies that are functions of neither, such as those of steps of rubbers that remember, are differentiated by F.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements import points, stretches
from pneumorph.mechanics.elements.stiffness import moduli_of_invariants
from pneumorph.mechanics.elements.terms import Values
from pneumorph.mechanics.material.energies import Energy, Invariants, Stretches, invariants


class Law(Protocol):
    """ψ(F, π, parameters), as a pytree: the energy is static."""

    @property
    def energy_density(self) -> Energy: ...

    @property
    def parameters(self) -> Any: ...


class StrainedPoints(NamedTuple):
    """The quadrature points of a chunk: F and A = ∂ξ/∂X (3, 3, 4, C), π and the volumes (4, C)."""

    F: np.ndarray
    A: np.ndarray
    hydrostatic: np.ndarray
    measure: np.ndarray


class Tangents(NamedTuple):
    """∂ψ/∂F (3, 3, 4, C), ∂ψ/∂π (4, C), ∂²ψ/∂F∂F (9, 9, 4, C) and ∂²ψ/∂F∂π (9, 4, C) at the points of a chunk."""

    stress: np.ndarray
    slope: np.ndarray
    moduli: np.ndarray
    coupling: np.ndarray


Along = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]


def stress_at(law: Law, here: StrainedPoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """ψ (4, C), ∂ψ/∂F (3, 3, 4, C) and ∂ψ/∂π (4, C)."""
    # Copies, here as elsewhere: JAX's arrays are read-only, for which Numba would compile its kernels once more.
    if law.energy_density.of_stretches is None:
        psi, stress, slope = map(np.array, _stress(law, here.F, here.hydrostatic))
        return psi, stress, slope
    logs, axes, ratio = _principal(here.F)
    psi, w = map(np.array, _slopes(law, logs, ratio, here.hydrostatic))
    return psi, _by_slopes(w, here.F, logs, axes), w[4]


def moduli_at(law: Law, here: StrainedPoints, excess: np.ndarray | None = None) -> np.ndarray:
    """∂²ψ/∂F∂F times the volumes of the points (9, 9, 4, C), where ∂ψ/∂J is larger by an excess (4, C)."""
    if law.energy_density.of_stretches is None:
        moduli = np.array(_moduli(law, here.F, here.hydrostatic))
        if excess is not None:
            moduli += excess * _second_of_ratio(here.F)
    else:
        logs, axes, ratio = _principal(here.F)
        w, second = map(np.array, _derivatives(law, logs, ratio, here.hydrostatic))
        if excess is not None:
            w[3] += excess
        moduli = np.empty((9, 9, *ratio.shape))
        stretches.moduli_by_stretches(w, second, logs, axes, here.F, moduli)
    moduli *= here.measure
    return moduli


def couplings_at(law: Law, here: StrainedPoints) -> tuple[np.ndarray, np.ndarray]:
    """∂²ψ/∂F∂π (9, 4, C) and ∂²ψ/∂π² (4, C) times the volumes of the points; what has π is of J and π alone."""
    mixed, among = _couplings(law, here.F, here.hydrostatic)
    return here.measure * mixed, here.measure * among


def along_at(law: Law, here: StrainedPoints, several: bool = False) -> Along:
    """A function of (δF, δπ): ∂ψ/∂F and ∂ψ/∂π, and how they change along these.

    Without invariants or stretches all second derivatives are the dearer way to one direction, and the cheaper one to
    several.
    """
    F, hydrostatic = here.F, here.hydrostatic
    if law.energy_density.of_invariants is not None:
        by_invariants, slope = map(np.array, invariant_derivatives(law, F, hydrostatic))

        def by_kernel(dF: np.ndarray, dhydrostatic: np.ndarray):
            stress, dstress, dslope = np.empty(dF.shape), np.empty(dF.shape), np.empty(dhydrostatic.shape)
            points.stress_along(by_invariants, F, dF, dhydrostatic, stress, dstress, dslope)
            return stress, slope, dstress, dslope

        return by_kernel
    if law.energy_density.of_stretches is None and not several:

        def by_jax(dF: np.ndarray, dhydrostatic: np.ndarray):
            stress, slope, dstress, dslope = map(np.array, _stress_along(law, F, hydrostatic, dF, dhydrostatic))
            return stress, slope, dstress, dslope

        return by_jax
    _, stress, slope = stress_at(law, here)
    of_volume = here._replace(measure=np.ones(hydrostatic.shape))
    moduli, (mixed, among) = moduli_at(law, of_volume), couplings_at(law, of_volume)

    def by_moduli(dF: np.ndarray, dhydrostatic: np.ndarray):
        flat = dF.reshape(9, *hydrostatic.shape)
        dstress = np.einsum("abqe,bqe->aqe", moduli, flat) + mixed * dhydrostatic
        return stress, slope, dstress.reshape(dF.shape), np.einsum("aqe,aqe->qe", mixed, flat) + among * dhydrostatic

    return by_moduli


def tangents_at(law: Law, here: StrainedPoints) -> Tangents:
    """First and second derivatives of ψ at the points."""
    F, count = here.F, here.hydrostatic.shape
    if law.energy_density.of_invariants is not None:
        by_invariants, slope = map(np.array, invariant_derivatives(law, F, here.hydrostatic))
        stress, coupling, moduli = np.empty(F.shape), np.empty(F.shape), np.empty((9, 9, *count))
        points.stress_along(by_invariants, F, np.zeros(F.shape), np.ones(count), stress, coupling, np.empty(count))
        moduli_of_invariants(by_invariants, F, moduli)
        return Tangents(stress, slope, moduli, coupling.reshape(9, *count))
    _, stress, slope = stress_at(law, here)
    of_volume = here._replace(measure=np.ones(count))
    return Tangents(stress, slope, moduli_at(law, of_volume), couplings_at(law, of_volume)[0])


def _principal(F: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Logarithms of stretches (3, 4, C), their axes (3, 3, 4, C) and J (4, C)."""
    logs, axes, ratio = np.empty(F.shape[1:]), np.empty(F.shape), np.empty(F.shape[2:])
    stretches.principal(F, logs, axes, ratio)
    return logs, axes, ratio


def _by_slopes(w: np.ndarray, F: np.ndarray, logs: np.ndarray, axes: np.ndarray) -> np.ndarray:
    stress = np.empty(F.shape)
    stretches.stress_by_stretches(w, logs, axes, F, stress)
    return stress


_PERMUTATION = np.array([[[(i - j) * (j - k) * (k - i) / 2.0 for k in range(3)] for j in range(3)] for i in range(3)])


def _second_of_ratio(F: np.ndarray) -> np.ndarray:
    """∂²J/∂F∂F (9, 9, 4, C)."""
    second = np.einsum("ikm,jln,mn...->ijkl...", _PERMUTATION, _PERMUTATION, F)
    return second.reshape(9, 9, *F.shape[2:])


@jax.jit
def _stress(law: Law, F: Values, hydrostatic: Values) -> tuple[Array, Array, Array]:
    """ψ (4, C), ∂ψ/∂F (3, 3, 4, C) and ∂ψ/∂π (4, C)."""
    value, back = jax.vjp(lambda F, hydrostatic: law.energy_density(F, hydrostatic, law.parameters), F, hydrostatic)
    return value, *back(jnp.ones_like(value))


@jax.jit
def _stress_along(law: Law, F: Values, hydrostatic: Values, dF: Values, dhydrostatic: Values):
    """∂ψ/∂F and ∂ψ/∂π, and how they change along (dF, dπ)."""

    def energy(F, hydrostatic):
        return jnp.sum(law.energy_density(F, hydrostatic, law.parameters))

    here, along = jax.jvp(jax.grad(energy, argnums=(0, 1)), (F, hydrostatic), (dF, dhydrostatic))
    return *here, *along


@jax.jit
def _moduli(law: Law, F: Values, hydrostatic: Values) -> Array:
    """∂²ψ/∂F∂F (9, 9, 4, C)."""
    stress = jax.grad(lambda F: jnp.sum(law.energy_density(F, hydrostatic, law.parameters)))
    units = jnp.broadcast_to(jnp.eye(9).reshape(9, 3, 3, 1, 1), (9, *F.shape))
    rows = jax.vmap(lambda unit: jax.jvp(stress, (F,), (unit,))[1])(units)
    return rows.reshape(9, 9, *F.shape[2:])


@jax.jit
def _couplings(law: Law, F: Values, hydrostatic: Values) -> tuple[Array, Array]:
    """∂²ψ/∂F∂π (9, 4, C) and ∂²ψ/∂π² (4, C)."""

    def dilation(F, hydrostatic):
        return jnp.sum(jax.grad(lambda q: jnp.sum(law.energy_density(F, q, law.parameters)))(hydrostatic))

    by_F, by_hydrostatic = jax.grad(dilation, argnums=(0, 1))(F, hydrostatic)
    return by_F.reshape(9, *F.shape[2:]), by_hydrostatic


@jax.jit
def invariant_derivatives(law: Law, F: Values, hydrostatic: Values) -> tuple[Array, Array]:
    """Derivatives (13, 4, C) of ψ by the invariants of F and by π, as `points.stress_along` has them; and ∂ψ/∂π."""
    psi = law.energy_density.of_invariants
    assert psi is not None
    first, second = _all_derivatives(
        lambda *at: psi(Invariants(*at[:3]), at[3], law.parameters), (*invariants(F), hydrostatic)
    )
    by_invariants = [second[i][j] for i in range(3) for j in range(i, 3)]
    return jnp.stack([*first[:3], *by_invariants, *second[3]]), first[3]


@jax.jit
def _slopes(law: Law, logs: Values, ratio: Values, hydrostatic: Values) -> tuple[Array, Array]:
    """ψ (4, C) and its derivatives (5, 4, C) by the logarithms of stretches, J and π."""
    value, back = jax.vjp(lambda *at: _of_stretches(law, *at), *logs, ratio, hydrostatic)
    return value, jnp.stack(back(jnp.ones_like(value)))


@jax.jit
def _derivatives(law: Law, logs: Values, ratio: Values, hydrostatic: Values) -> tuple[Array, Array]:
    """The first (5, 4, C) and second derivatives (5, 5, 4, C) of ψ by the logarithms of stretches, J and π."""
    first, second = _all_derivatives(lambda *at: _of_stretches(law, *at), (*logs, ratio, hydrostatic))
    return jnp.stack(first), jnp.stack([jnp.stack(row) for row in second])


def _of_stretches(law: Law, *at: Array) -> Array:
    psi = law.energy_density.of_stretches
    assert psi is not None
    *logs, ratio, hydrostatic = at
    return psi(Stretches(jnp.stack(logs), ratio), hydrostatic, law.parameters)


def _all_derivatives(
    function: Callable[..., Array], at: tuple[Array, ...]
) -> tuple[tuple[Array, ...], list[tuple[Array, ...]]]:
    """First and second derivatives (…) at points of a function of several numbers (…) there."""
    count = len(at)

    def slopes(*at: Array) -> tuple[Array, ...]:
        return jax.grad(lambda *at: jnp.sum(function(*at)), tuple(range(count)))(*at)

    units = [tuple(jnp.full_like(at[-1], float(i == k)) for i in range(count)) for k in range(count)]
    rows = [jax.jvp(slopes, at, unit) for unit in units]
    return rows[0][0], [along for _, along in rows]
