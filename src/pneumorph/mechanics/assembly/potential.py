"""The total potential and its derivatives, made of the terms alone.

Whatever is a term is in Π, in the residual, in the products with second derivatives and, by `hessian.py`, in the
assembled tangent: nothing here knows which terms there are. Every function is compiled once per padded mesh size.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from pneumorph.mechanics.assembly.kinematics import State, Topology, displacement
from pneumorph.mechanics.assembly.terms import Connectivity, ElementEnergy, Loads, Term


class Group(NamedTuple):
    """The energies of all terms over one connectivity: its elements are looked up once for them together."""

    connectivity: Connectivity
    energies: tuple[ElementEnergy, ...]


class Potential(NamedTuple):
    """Π of a model as JAX sees it."""

    groups: tuple[Group, ...]
    top: Topology


def grouped(terms: Iterable[Term]) -> tuple[Group, ...]:
    """The terms, those over the same connectivity together."""
    found: dict[int, Group] = {}
    for connectivity, energy in terms:
        group = found.setdefault(id(connectivity), Group(connectivity, ()))
        found[id(connectivity)] = group._replace(energies=(*group.energies, energy))
    return tuple(found.values())


def total(potential: Potential, X: Array, state: State, loads: Loads) -> Array:
    """Π in N·mm for nodes X (N, 3), padded."""
    u = displacement(potential.top, X, state)
    value = jnp.zeros(())
    for connectivity, energies in potential.groups:
        local = connectivity.local(X, u, state)
        value += jnp.sum(connectivity.weight * sum(energy.energies(local, loads) for energy in energies))
    return value


residual = jax.grad(total, argnums=2)


@jax.jit
def value_and_residual(potential: Potential, X: Array, state: State, loads: Loads) -> tuple[Array, State]:
    """Π and R = ∂Π/∂(u, plate, π)."""
    return jax.value_and_grad(total, argnums=2)(potential, X, state, loads)


@jax.jit
def tangent_product(potential: Potential, X: Array, state: State, loads: Loads, direction: State) -> State:
    """K·direction without a matrix: the residual's derivative along a change of state."""
    return jax.jvp(lambda s: residual(potential, X, s, loads), (state,), (direction,))[1]


@jax.jit
def shape_product(potential: Potential, X: Array, state: State, loads: Loads, dX: Array) -> State:
    """(∂R/∂X)·dX for a motion dX (N, 3) of the nodes."""
    return jax.jvp(lambda Y: residual(potential, Y, state, loads), (X,), (dX,))[1]


@jax.jit
def load_product(potential: Potential, X: Array, state: State, loads: Loads, change: Loads) -> State:
    """(∂R/∂loads)·change for a change of the loads."""
    return jax.jvp(lambda acting: residual(potential, X, state, acting), (loads,), (change,))[1]


@jax.jit
def pullback(potential: Potential, X: Array, state: State, loads: Loads, w: State) -> tuple[Array, Loads]:
    """∂(wᵀR)/∂X (N, 3) and ∂(wᵀR)/∂loads for an adjoint state w."""

    def work(Y, acting):
        return jax.jvp(lambda s: total(potential, Y, s, acting), (state,), (w,))[1]

    return jax.grad(work, argnums=(0, 1))(X, loads)


@jax.jit
def plate_columns(near_tip: Potential, X: Array, state: State, loads: Loads) -> State:
    """∂R/∂plate: u (N, 3, 6), plate (6, 6), and in mixed elements π (…, 6).

    `near_tip` holds just the elements that see the plate or touch the tip; no other depends on the plate.
    """
    return jax.jacfwd(lambda d: residual(near_tip, X, state._replace(plate=d), loads))(state.plate)


@jax.jit
def element_hessians(
    connectivity: Connectivity, energy: ElementEnergy, top: Topology, X: Array, state: State, loads: Loads
) -> Array:
    """Second derivatives (E, 3a + c, 3a + c) of the elements' energies by their displacements and pressures."""
    local = connectivity.local(X, displacement(top, X, state), state)
    count, nodes = connectivity.nodes.shape

    def value(seen: Array) -> Array:
        u, pressure = seen[:, : 3 * nodes].reshape(count, nodes, 3), seen[:, 3 * nodes :]
        return jnp.sum(connectivity.weight * energy.energies(local._replace(u=u, pressure=pressure), loads))

    at = jnp.concatenate([local.u.reshape(count, -1), local.pressure], axis=1)
    units = jnp.eye(at.shape[1])[:, None, :]
    rows = jax.vmap(lambda unit: jax.jvp(jax.grad(value), (at,), (jnp.broadcast_to(unit, at.shape),))[1])(units)
    return jnp.moveaxis(rows, 1, 0)
