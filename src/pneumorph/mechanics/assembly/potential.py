"""The total potential, written once.

    Π(X, u, π) = Σ∫ψ(F, π) − Σ p_c V_c(X + u) − ∫ρ₀ g·u + ½ Σ k_i d_i² − f·d, plate d = [c, θ]

ψ is the rubber's energy, or in mixed elements its perturbed Lagrangian with the pressure π (`element.py`). Residual,
load vectors and the mixed shape derivative are its derivatives by JAX; every function here is compiled once per padded
mesh size. Arrays over nodes are padded to `nodes` rows, elements and triangles by copies of weight zero, so that a
remesh seldom compiles anew. Of half a symmetric body it is half of Π: half the springs and plate loads are in `Loads`,
and half the volumes in `Topology`.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.element import (
    TET_CORNER_N,
    TET_WEIGHT,
    deformation_gradients,
    inverse,
    reference_gradients,
    tet_energies,
    triangle_integrals,
    triangle_volumes,
)
from pneumorph.mechanics.assembly.plate import rigid_displacement
from pneumorph.mechanics.material.energies import Invariants, OfInvariants, determinant, invariants
from pneumorph.mechanics.material.rubber import Energy


class Topology(NamedTuple):
    """Connectivity as JAX arrays of padded size."""

    tets: Array  # (M, 10)
    weight: Array  # (M,) 1, or 0 for padding
    tip: Array  # (T, 6) triangles of the tip face
    tip_weight: Array  # (T,)
    on_tip: Array  # (N, 1) 1 where a node is bonded to the plate, else 0
    chamber: Array  # (S, 6) triangles of all chambers, oriented into the cavity
    # (S, chambers) −1 in the column of its chamber (their normals point into the cavity), or −½ in those of a chamber
    # and of its image in the half that is not there; else 0
    chamber_weight: Array
    even: Array  # (3,) 1, but 0 for the component across a mirror plane, which cancels in means over the whole body


class State(NamedTuple):
    """Unknowns: nodal displacements u (N, 3) mm, the plate's (6,) [c mm, θ rad], in mixed elements π (N,) MPa.

    Rows of u on the tip and entries of π at mid-side nodes are not used; without mixed elements π is empty.
    """

    u: Array
    plate: Array
    pressure: Array | np.ndarray = np.zeros(0)


class Loads(NamedTuple):
    """What acts: chamber pressures (C,) MPa, body force ρ₀ g (3,) N/mm³, plate springs and dead loads (6,)."""

    pressure: Array
    body_force: Array
    spring: Array
    wrench: Array


def padded(count: int, first: int = 64, ratio: float = 1.5) -> int:
    """The next size in a geometric series, so that meshes of like size share one compiled program."""
    size = float(first)
    while size < count:
        size *= ratio
    return int(np.ceil(size / 64) * 64)


def tip_mean(top: Topology, X: Array, values: Array) -> Array:
    """Area mean over the undeformed tip face that is there of values (N, k); zero where the mesh names no tip."""
    if not len(top.tip):
        return jnp.zeros(values.shape[1])
    integral, area = triangle_integrals(X[top.tip], values[top.tip])
    return top.tip_weight @ integral / jnp.sum(top.tip_weight * area)


def tip_centre(top: Topology, X: Array, x: Array) -> Array:
    """Mean (3,) of vectors x (N, 3) over the undeformed tip face of the whole body; of X itself its centroid."""
    return top.even * tip_mean(top, X, x)


def displacement(top: Topology, X: Array, state: State) -> Array:
    """Displacements of all nodes (N, 3): the unknowns, with the tip face moved by the plate."""
    rigid = rigid_displacement(X, tip_centre(top, X, X), state.plate)
    return jnp.where(top.on_tip > 0, rigid, state.u)


def chamber_volumes(top: Topology, x: Array) -> Array:
    """Volumes (C,) in mm³ of the chambers of nodes at x (N, 3), by the divergence theorem; of half a body their halves.

    The mirror plane goes through the origin, so what closes a cut chamber there has x·n = 0.
    """
    return triangle_volumes(x[top.chamber]) @ top.chamber_weight


def corner_pressures(top: Topology, state: State) -> Array:
    """π at the corners of every tetrahedron (M, 4); zero without mixed elements, whose energy asks for none."""
    if not state.pressure.size:
        return jnp.zeros((top.tets.shape[0], 4))
    return jnp.asarray(state.pressure)[top.tets[:, :4]]


def potential(density: Energy, parameters: Array, top: Topology, X: Array, state: State, loads: Loads) -> Array:
    """Π in N·mm."""
    u = displacement(top, X, state)
    solid = tet_energies(X[top.tets], u[top.tets], corner_pressures(top, state), density, parameters, loads.body_force)
    plate = 0.5 * jnp.sum(loads.spring * state.plate**2) - jnp.sum(loads.wrench * state.plate)
    return jnp.sum(top.weight * solid) - jnp.sum(loads.pressure * chamber_volumes(top, X + u)) + plate


@partial(jax.jit, static_argnums=0)
def value_and_residual(density, parameters, top, X, state, loads) -> tuple[Array, State]:
    """Π and R = ∂Π/∂(u, plate, π)."""
    return jax.value_and_grad(potential, argnums=4)(density, parameters, top, X, state, loads)


@partial(jax.jit, static_argnums=0)
def tangent_product(density, parameters, top, X, state, loads, direction) -> State:
    """K·direction without a matrix: the residual's derivative along a change of state."""
    residual = jax.grad(potential, argnums=4)
    return jax.jvp(lambda s: residual(density, parameters, top, X, s, loads), (state,), (direction,))[1]


@partial(jax.jit, static_argnums=0)
def shape_product(density, parameters, top, X, state, loads, dX) -> State:
    """(∂R/∂X)·dX for a motion dX (N, 3) of the nodes."""
    residual = jax.grad(potential, argnums=4)
    return jax.jvp(lambda Y: residual(density, parameters, top, Y, state, loads), (X,), (dX,))[1]


@partial(jax.jit, static_argnums=0)
def shape_pullback(density, parameters, top, X, state, loads, w) -> tuple[Array, Array]:
    """∂(wᵀR)/∂X (N, 3) and ∂(wᵀR)/∂p (C,) for an adjoint state w."""

    def work(Y, pressure):
        applied = loads._replace(pressure=pressure)
        return jax.jvp(lambda s: potential(density, parameters, top, Y, s, applied), (state,), (w,))[1]

    return jax.grad(work, argnums=(0, 1))(X, loads.pressure)


@partial(jax.jit, static_argnums=0)
def pressure_product(density, parameters, top, X, state, loads, dp) -> State:
    """(∂R/∂p)·dp for a change of the chamber pressures (C,)."""
    residual = jax.grad(potential, argnums=4)
    return jax.jvp(
        lambda p: residual(density, parameters, top, X, state, loads._replace(pressure=p)), (loads.pressure,), (dp,)
    )[1]


def _points(top: Topology, X: Array, state: State) -> tuple[Array, Array, Array, Array]:
    """F, π, ∂ξ/∂X and quadrature weights at the quadrature points."""
    jacobian = reference_gradients(X[top.tets])
    inverse_jacobian = inverse(jacobian)
    F = deformation_gradients(displacement(top, X, state)[top.tets], inverse_jacobian)
    pressure = jnp.asarray(TET_CORNER_N) @ corner_pressures(top, state).T
    return F, pressure, inverse_jacobian, TET_WEIGHT * determinant(jacobian) * top.weight


@partial(jax.jit, static_argnums=0)
def moduli(density, parameters, top, X, state) -> tuple[Array, Array]:
    """∂²ψ/∂F∂F times the quadrature weight (9, 9, 4, M) and ∂ξ/∂X (3, 3, 4, M) at the quadrature points."""
    F, pressure, inverse_jacobian, measure = _points(top, X, state)
    stress = jax.grad(lambda F: jnp.sum(density(F, pressure, parameters)))
    units = jnp.broadcast_to(jnp.eye(9).reshape(9, 3, 3, 1, 1), (9, *F.shape))
    rows = jax.vmap(lambda unit: jax.jvp(stress, (F,), (unit,))[1])(units)
    return measure * rows.reshape(9, 9, *measure.shape), inverse_jacobian


@partial(jax.jit, static_argnums=0)
def invariant_derivatives(density: OfInvariants, parameters, top, X, state) -> tuple[Array, Array, Array]:
    """Derivatives of ψ by the invariants of F, times the quadrature weight, F (3, 3, 4, M) and ∂ξ/∂X likewise.

    The derivatives (9, 4, M) are w₁, w₂, w₃ by I₁, I₂, J, and w₁₁, w₁₂, w₁₃, w₂₂, w₂₃, w₃₃.
    """
    F, pressure, inverse_jacobian, measure = _points(top, X, state)
    at = invariants(F)
    slopes = jax.grad(lambda of: jnp.sum(density.function(of, pressure, parameters)))
    ones, zeros = jnp.ones_like(measure), jnp.zeros_like(measure)
    units = [Invariants(*(ones if i == k else zeros for i in range(3))) for k in range(3)]
    first, _ = by_first = jax.jvp(slopes, (at,), (units[0],))
    rows = [by_first[1], *(jax.jvp(slopes, (at,), (unit,))[1] for unit in units[1:])]
    second = [rows[i][j] for i in range(3) for j in range(i, 3)]
    return measure * jnp.stack([*first, *second]), F, inverse_jacobian


@partial(jax.jit, static_argnums=0)
def couplings(density, parameters, top, X, state) -> tuple[Array, Array]:
    """∂²ψ/∂F∂π (9, 4, M) and ∂²ψ/∂π² (4, M) times the quadrature weight."""
    F, pressure, _, measure = _points(top, X, state)

    def dilation(F, pressure):
        return jnp.sum(jax.grad(lambda q: jnp.sum(density(F, q, parameters)))(pressure))

    by_F, by_pressure = jax.grad(dilation, argnums=(0, 1))(F, pressure)
    return measure * by_F.reshape(9, *measure.shape), measure * by_pressure


@jax.jit
def volume_hessians(top: Topology, X: Array, state: State, pressure: Array) -> Array:
    """−p ∂²V/∂x∂x of every chamber triangle (S, 18, 18), its nodes' components in the order (node, component)."""
    x = (X + displacement(top, X, state))[top.chamber]
    slope = jax.grad(lambda x: jnp.sum(triangle_volumes(x)))
    units = jnp.broadcast_to(jnp.eye(18).reshape(18, 1, 6, 3), (18, *x.shape))
    rows = jax.vmap(lambda unit: jax.jvp(slope, (x,), (unit,))[1])(units)
    hessians = jnp.moveaxis(rows.reshape(18, -1, 18), 1, 0)
    return -(top.chamber_weight @ pressure)[:, None, None] * hessians


@partial(jax.jit, static_argnums=0)
def plate_columns(density, parameters, near_tip, X, state, loads) -> State:
    """∂R/∂plate: u (N, 3, 6), plate (6, 6), and in mixed elements π (N, 6).

    `near_tip` holds just the elements that touch the tip; no other depends on the plate.
    """
    residual = jax.grad(potential, argnums=4)
    return jax.jacfwd(lambda d: residual(density, parameters, near_tip, X, state._replace(plate=d), loads))(state.plate)


@jax.jit
def stretches(top: Topology, X: Array, state: State) -> Array:
    """Largest principal stretch (M,) over the quadrature points of each tetrahedron."""
    inverse_jacobian = inverse(reference_gradients(X[top.tets]))
    F = deformation_gradients(displacement(top, X, state)[top.tets], inverse_jacobian)
    return jnp.max(largest_stretch(F), axis=0)


@jax.jit
def least_ratio(top: Topology, X: Array, state: State) -> Array:
    """The smallest volume ratio det F at the quadrature points."""
    before = determinant(reference_gradients(X[top.tets]))
    after = determinant(reference_gradients((X + displacement(top, X, state))[top.tets]))
    return jnp.min(after / before)


def largest_stretch(F: Array) -> Array:
    """Largest singular value of 3×3 matrices (3, 3, …), from the characteristic cubic of FᵀF (Smith 1961)."""
    C = jnp.sum(F[:, :, None] * F[:, None, :], axis=0)
    mean = (C[0, 0] + C[1, 1] + C[2, 2]) / 3
    deviator = C - mean * jnp.eye(3).reshape(3, 3, *[1] * (F.ndim - 2))
    spread = jnp.sqrt(jnp.maximum(jnp.sum(deviator**2, axis=(0, 1)) / 6, 1e-30))
    cosine = jnp.clip(determinant(deviator / spread) / 2, -1.0, 1.0)
    return jnp.sqrt(mean + 2 * spread * jnp.cos(jnp.arccos(cosine) / 3))
