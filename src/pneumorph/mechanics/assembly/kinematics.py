"""The unknowns, the connectivity of a mesh, and what follows from both: displacements, volumes, stretches.

Arrays over nodes are padded to `nodes` rows, elements and triangles by copies of weight zero, so that a remesh seldom
compiles anew. Of half a symmetric body half the volumes are in `Topology`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.element import (
    deformation_gradients,
    inverse,
    reference_gradients,
    triangle_integrals,
    triangle_volumes,
)
from pneumorph.mechanics.assembly.plate import rigid_displacement
from pneumorph.mechanics.material.energies import determinant


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
    """Unknowns: nodal displacements u (N, 3) mm, the plate's (6,) [c mm, θ rad], in mixed elements π (regions·N,) MPa.

    π jumps where two rubbers meet, so every region has N entries of its own, region after region. Rows of u on the tip
    and entries of π where a region has no corner are not used; without mixed elements π is empty.
    """

    u: Array
    plate: Array
    pressure: Array | np.ndarray = np.zeros(0)


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
