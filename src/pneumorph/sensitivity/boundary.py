"""The paper's boundary formula (16)–(22): the continuum limit of the exact gradient, as an integral over the surfaces.

dJ/dX_a = −∫ N_a m [P : ∇w + p ∇·(J F⁻¹ w) − ρ₀ g·w] dΓ, with p the pressure on chambers and zero on the exterior. With
the sign of the adjoint used here, K w = ∂J/∂u, the paper's w is −w. Unlike in (71)–(74) of the paper, the divergence
needs no second derivatives of the shape functions: ∇·(J F⁻¹) = 0 (Piola identity), so it is J F⁻ᵀ : ∇w. The gravity
term has ρ₀ without a factor J, since mass is conserved.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics import Configuration, Equilibrium
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.elements.element import mixed
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.rubber import nominal_stress
from pneumorph.mesh.tets import (
    TRIANGLE_RULE,
    TetMesh,
    area_vectors,
    chambers_of,
    is_cut,
    tet_gradient,
    tet_shape,
    triangle_shape,
)


def boundary_gradient(at: Configuration, mesh: TetMesh, equilibrium: Equilibrium, adjoint: State) -> np.ndarray:
    """dJ/dX (N, 3) on the surface nodes by the boundary formula; zero inside.

    Parameters
    ----------
    at : Configuration
        The configuration that was solved; its nodes are those of `mesh`.
    mesh : TetMesh
    equilibrium : Equilibrium
    adjoint : State
        w, as computed by `gradient`.
    """
    model = at.model
    # On the tip, the adjoint field is the plate's first-order motion.
    w = Displacement(model.tip, at.X, equilibrium.state).along(adjoint)
    pressures = dict(zip(model.chambers, np.asarray(at.loads.pressure), strict=True))
    answer = np.zeros((model.nodes, 3))
    shape = triangle_shape(TRIANGLE_RULE[0])
    for name, triangles in mesh.faces.items():
        if is_cut(name):
            continue
        # The images of a chamber have the same pressure.
        pressure = next((pressures[chamber] for chamber in chambers_of(name)), 0.0)
        integrand = _integrand(at, mesh, equilibrium, w, triangles, float(pressure))
        _, normals = area_vectors(mesh.points, triangles)
        np.add.at(answer, triangles, -np.einsum("qa,fqi,fq->fai", shape, normals, integrand))
    return answer


def _integrand(at: Configuration, mesh: TetMesh, equilibrium: Equilibrium, w, triangles, pressure: float) -> np.ndarray:
    """P : ∇w + p J F⁻ᵀ : ∇w − ρ₀ g·w at the quadrature points (f, 6) of boundary triangles, from their elements."""
    owner, corners = _owners(mesh.tets, triangles)
    bary = np.column_stack([1 - TRIANGLE_RULE[0].sum(axis=1), TRIANGLE_RULE[0]])
    vertices = np.vstack([np.zeros(3), np.eye(3)])
    xi = np.einsum("qk,fki->fqi", bary, vertices[corners])
    derivative, tets = tet_gradient(xi), mesh.tets[owner]
    jacobian = np.einsum("fai,fqaj->fqij", mesh.points[tets], derivative)
    gradients = derivative @ np.linalg.inv(jacobian)
    F = np.eye(3) + np.einsum("fai,fqaj->fqij", equilibrium.u[tets], gradients)
    slope = np.einsum("fai,fqaj->fqij", w[tets], gradients)
    linear = np.concatenate([1 - xi.sum(axis=-1, keepdims=True), xi], axis=-1)
    stress, density = np.empty_like(F), np.empty(len(owner))
    for number, (region, rubber) in enumerate(at.model.rubbers.items()):
        own = np.isin(owner, at.model.regions[region])
        energy, hydrostatic = rubber.energy, np.zeros(linear[own].shape[:2])
        if at.model.mixed:
            energy = mixed(rubber.isochoric)
            at_nodes = np.asarray(equilibrium.state.hydrostatic).reshape(len(at.model.rubbers), -1)[number]
            hydrostatic = np.einsum("fqc,fc->fq", linear[own], at_nodes[tets[own][:, :4]])
        # Energies take the points as trailing axes.
        nominal = nominal_stress(energy, np.moveaxis(F[own], (2, 3), (0, 1)), hydrostatic, np.array(rubber.parameters))
        stress[own], density[own] = np.moveaxis(nominal, (0, 1), (2, 3)), rubber.density
    cofactor = np.linalg.det(F)[..., None, None] * np.swapaxes(np.linalg.inv(F), -1, -2)
    total = stress + pressure * cofactor
    weight = density[:, None] * np.einsum("fqa,fai,i->fq", tet_shape(xi), w[tets], np.asarray(at.loads.acceleration))
    return np.einsum("fqij,fqij->fq", total, slope) - weight


def _owners(tets: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The tetrahedron (f,) of each boundary triangle, and which of its corners are the triangle's (f, 3)."""
    sides = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]])
    keys = np.sort(tets[:, sides], axis=2).reshape(-1, 3)
    order = np.lexsort(keys.T[::-1])
    wanted = np.sort(triangles[:, :3], axis=1)
    size = int(tets.max()) + 1
    flat = (keys[order].astype(np.int64) @ [size**2, size, 1]).astype(np.int64)
    places = np.searchsorted(flat, wanted.astype(np.int64) @ [size**2, size, 1])
    owner = order[places] // 4
    corners = np.argmax(tets[owner][:, None, :4] == triangles[:, :3, None], axis=2)
    return owner, corners
