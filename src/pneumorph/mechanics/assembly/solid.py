"""The fast path of the solid's second derivatives: JAX differentiates ψ at the points, Numba does the rest.

By invariants there are nine derivatives at a point instead of eighty-one, and no element ever has its matrix by JAX:
more than twenty times as fast as `potential.element_hessians`, which a test holds it against (measured with 3,072
tetrahedra on one core).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.element import (
    TET_CORNER_N,
    TET_DN,
    TET_WEIGHT,
    deformation_gradients,
    inverse,
    reference_gradients,
)
from pneumorph.mechanics.assembly.kinematics import State, Topology, displacement
from pneumorph.mechanics.assembly.stiffness import coupling_blocks, element_blocks, invariant_blocks
from pneumorph.mechanics.assembly.terms import Connectivity, Solid, corner_pressures
from pneumorph.mechanics.material.energies import Invariants, OfInvariants, determinant, invariants


def solid_blocks(
    connectivity: Connectivity, solid: Solid, top: Topology, X: Array, state: State
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks of pairs of nodes (M, 55, 9), of nodes with pressures (M, 10, c, 3), of pressures (M, c, c)."""
    arguments = (connectivity, solid, top, X, state)
    count = connectivity.count
    blocks = np.empty((count, 55, 9))
    if isinstance(solid.density, OfInvariants):
        # Nine derivatives instead of eighty-one: half the time of the whole assembly.
        derivatives, F, inverse_jacobian = map(np.asarray, invariant_derivatives(*arguments))
        invariant_blocks(derivatives, F, inverse_jacobian, TET_DN, blocks)
    else:
        moduli_there, inverse_jacobian = map(np.asarray, moduli(*arguments))
        element_blocks(moduli_there, inverse_jacobian, TET_DN, blocks)
    if not connectivity.pressures.shape[1]:
        return blocks, np.zeros((count, 10, 0, 3)), np.zeros((count, 0, 0))
    slopes, compressions = couplings(*arguments)
    coupling = np.empty((count, 10, 4, 3))
    coupling_blocks(np.asarray(slopes), inverse_jacobian, TET_DN, TET_CORNER_N, coupling)
    among = np.asarray(compressions)[:, :count]
    return blocks, coupling, np.einsum("qe,qc,qd->ecd", among, TET_CORNER_N, TET_CORNER_N, optimize=True)


def _points(connectivity: Connectivity, top: Topology, X: Array, state: State) -> tuple[Array, Array, Array, Array]:
    """F, π, ∂ξ/∂X and quadrature weights at the quadrature points."""
    local = connectivity.local(X, displacement(top, X, state), state)
    jacobian = reference_gradients(local.X)
    inverse_jacobian = inverse(jacobian)
    F = deformation_gradients(local.u, inverse_jacobian)
    pressure = jnp.asarray(TET_CORNER_N) @ corner_pressures(local).T
    return F, pressure, inverse_jacobian, TET_WEIGHT * determinant(jacobian) * connectivity.weight


@jax.jit
def moduli(connectivity: Connectivity, solid: Solid, top: Topology, X: Array, state: State) -> tuple[Array, Array]:
    """∂²ψ/∂F∂F times the quadrature weight (9, 9, 4, M) and ∂ξ/∂X (3, 3, 4, M) at the quadrature points."""
    F, pressure, inverse_jacobian, measure = _points(connectivity, top, X, state)
    stress = jax.grad(lambda F: jnp.sum(solid.density(F, pressure, solid.parameters)))
    units = jnp.broadcast_to(jnp.eye(9).reshape(9, 3, 3, 1, 1), (9, *F.shape))
    rows = jax.vmap(lambda unit: jax.jvp(stress, (F,), (unit,))[1])(units)
    return measure * rows.reshape(9, 9, *measure.shape), inverse_jacobian


@jax.jit
def invariant_derivatives(
    connectivity: Connectivity, solid: Solid, top: Topology, X: Array, state: State
) -> tuple[Array, Array, Array]:
    """Derivatives of ψ by the invariants of F, times the quadrature weight, F (3, 3, 4, M) and ∂ξ/∂X likewise.

    The derivatives (9, 4, M) are w₁, w₂, w₃ by I₁, I₂, J, and w₁₁, w₁₂, w₁₃, w₂₂, w₂₃, w₃₃.
    """
    assert isinstance(solid.density, OfInvariants)
    density = solid.density.function
    F, pressure, inverse_jacobian, measure = _points(connectivity, top, X, state)
    at = invariants(F)
    slopes = jax.grad(lambda of: jnp.sum(density(of, pressure, solid.parameters)))
    ones, zeros = jnp.ones_like(measure), jnp.zeros_like(measure)
    units = [Invariants(*(ones if i == k else zeros for i in range(3))) for k in range(3)]
    first, _ = by_first = jax.jvp(slopes, (at,), (units[0],))
    rows = [by_first[1], *(jax.jvp(slopes, (at,), (unit,))[1] for unit in units[1:])]
    second = [rows[i][j] for i in range(3) for j in range(i, 3)]
    return measure * jnp.stack([*first, *second]), F, inverse_jacobian


@jax.jit
def couplings(connectivity: Connectivity, solid: Solid, top: Topology, X: Array, state: State) -> tuple[Array, Array]:
    """∂²ψ/∂F∂π (9, 4, M) and ∂²ψ/∂π² (4, M) times the quadrature weight."""
    F, pressure, _, measure = _points(connectivity, top, X, state)

    def dilation(F, pressure):
        return jnp.sum(jax.grad(lambda q: jnp.sum(solid.density(F, q, solid.parameters)))(pressure))

    by_F, by_pressure = jax.grad(dilation, argnums=(0, 1))(F, pressure)
    return measure * by_F.reshape(9, *measure.shape), measure * by_pressure
