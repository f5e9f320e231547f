"""Quadratic tetrahedra and triangles as JAX functions of their nodes.

Sums over nodes are one large matrix product. The 3×3 algebra is written out over arrays whose trailing axes are the
quadrature points, so that it compiles to long vector loops: about twenty times faster than small matrix products
element by element.
"""

from __future__ import annotations

from functools import cache

import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.material.energies import Energy, determinant
from pneumorph.mechanics.material.rubber import with_volume
from pneumorph.mesh.tets import TET_RULE, TRIANGLE_RULE, tet_gradient, tet_shape, triangle_gradient, triangle_shape

TET_N, TET_DN = tet_shape(TET_RULE), tet_gradient(TET_RULE)
TET_WEIGHT = 1 / 24  # of each of the four points, a quarter of the volume
# The linear shape functions of the four corners, for π of mixed elements.
TET_CORNER_N = np.column_stack([1 - TET_RULE.sum(axis=1), TET_RULE])

# Degree 4: x·(x_ξ × x_η) on a quadratic triangle has that degree, so volumes are exact.
TRIANGLE_N, TRIANGLE_DN = triangle_shape(TRIANGLE_RULE[0]), triangle_gradient(TRIANGLE_RULE[0])
TRIANGLE_WEIGHTS = TRIANGLE_RULE[1]


def _volume_weights() -> np.ndarray:
    """A (6, 6, 6), antisymmetric, with ⅓ ∫ x·n dA = Σ A_abc det(x_a, x_b, x_c) over the nodes of a triangle."""
    weights = np.einsum("q,qa,qb,qc->abc", TRIANGLE_WEIGHTS / 3, TRIANGLE_N, TRIANGLE_DN[..., 0], TRIANGLE_DN[..., 1])
    turned = weights + weights.transpose(1, 2, 0) + weights.transpose(2, 0, 1)
    return (turned - turned.transpose(0, 2, 1)) / 6


TRIANGLE_VOLUME = _volume_weights()


@cache
def mixed(isochoric: Energy) -> Energy:
    """The perturbed Lagrangian ψ_iso(F) + π (J − 1) − π²/2κ of the mixed element; the last parameter is κ.

    It is stationary in π at π = κ (J − 1), where it equals ψ_iso + κ/2 (J − 1)². With a linear, continuous π this is
    the Taylor–Hood element, which does not lock as κ/μ grows. π is positive in tension.
    """
    return with_volume(
        isochoric,
        lambda J, hydrostatic, parameters: hydrostatic * (J - 1.0) - 0.5 * hydrostatic * hydrostatic / parameters[-1],
    )


def inverse(F: Array) -> Array:
    """Inverse of 3×3 matrices (3, 3, …) by cofactors."""
    cofactors = [
        [
            F[(j + 1) % 3, (i + 1) % 3] * F[(j + 2) % 3, (i + 2) % 3]
            - F[(j + 1) % 3, (i + 2) % 3] * F[(j + 2) % 3, (i + 1) % 3]
            for j in range(3)
        ]
        for i in range(3)
    ]
    return jnp.stack([jnp.stack(row) for row in cofactors]) / determinant(F)


def reference_gradients(nodal: Array) -> Array:
    """Σ_a v_a ⊗ ∂N_a/∂ξ (3, 3, 4, M) at the quadrature points, of nodal vectors v (M, 10, 3); one matrix product."""
    derivative = jnp.asarray(TET_DN).transpose(1, 2, 0).reshape(10, 12)
    return jnp.einsum("eai,ak->eik", nodal, derivative).reshape(-1, 3, 3, 4).transpose(1, 2, 3, 0)


def matrix_product(A: Array, B: Array) -> Array:
    """Product of 3×3 matrices (3, 3, …), written out so that it compiles into the loop over the points."""
    rows = [[sum(A[i, k] * B[k, j] for k in range(3)) for j in range(3)] for i in range(3)]
    return jnp.stack([jnp.stack(row) for row in rows])


def deformation_gradients(u: Array, inverse_jacobian: Array) -> Array:
    """F = I + ∂u/∂ξ ∂ξ/∂X, (3, 3, 4, M), for nodal displacements u (M, 10, 3)."""
    return jnp.eye(3)[:, :, None, None] + matrix_product(reference_gradients(u), inverse_jacobian)


def tet_energies(X: Array, u: Array, hydrostatic: Array, energy_density: Energy, parameters: Array) -> Array:
    """∫ ψ(F, π) over each tetrahedron, (M,) in N·mm.

    Nodes X (M, 10, 3) in mm, displacements u of the same shape, π (M, 4) at the corners in MPa.

    Parameters
    ----------
    X, u : (M, 10, 3) array
        Nodes and their displacements, mm.
    hydrostatic : (M, 4) array
        π at the corners, MPa.
    energy_density : Energy
        ψ(F, π, parameters), MPa.
    parameters : (m,) array
        Of the energy.
    """
    jacobian = reference_gradients(X)
    F = deformation_gradients(u, inverse(jacobian))
    value = energy_density(F, jnp.asarray(TET_CORNER_N) @ hydrostatic.T, parameters)
    return TET_WEIGHT * jnp.sum(determinant(jacobian) * value, axis=0)


def tet_works(X: Array, u: Array, body_force: Array) -> Array:
    """∫ ρ₀ g·u over each tetrahedron, (M,) in N·mm, for a body force ρ₀ g (3,) in N/mm³."""
    work = jnp.einsum("ea,qa->qe", u @ body_force, jnp.asarray(TET_N))
    return TET_WEIGHT * jnp.sum(determinant(reference_gradients(X)) * work, axis=0)


def triangle_points(x: Array) -> tuple[Array, Array]:
    """Places (3, 6, S) and area vectors x_ξ × x_η (3, 6, S) at the quadrature points of triangles x (S, 6, 3)."""
    place = jnp.einsum("sai,qa->iqs", x, jnp.asarray(TRIANGLE_N))
    along, across = jnp.einsum("sai,qak->kiqs", x, jnp.asarray(TRIANGLE_DN))
    return place, jnp.cross(along, across, axis=0)


def cap_triangles(x: Array) -> Array:
    """Six-node triangles (S, 6, 3) of the parts x (S, 4, 3) of caps, see `TetMesh.caps`."""
    apex, first, second, middle = jnp.moveaxis(x, 1, 0)
    return jnp.stack([apex, first, second, (apex + first) / 2, middle, (second + apex) / 2], axis=1)


def triangle_volumes(x: Array) -> Array:
    """⅓ ∫ x·n dA over triangles x (S, 6, 3): summed over a closed surface the volume it bounds, mm³."""
    place, normal = triangle_points(x)
    return jnp.asarray(TRIANGLE_WEIGHTS) / 3 @ jnp.sum(place * normal, axis=0)
