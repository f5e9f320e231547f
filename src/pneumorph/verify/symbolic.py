"""Equilibria by NGSolve: its own symbolic forms, derivatives and assembly, on the same curved elements.

A straight mesh of the corners gets a quadratic deformation that makes it identical to the isoparametric ten-node
elements. The basis of NGSolve's quadratic space is not nodal; a constant matrix converts nodal values to its
coefficients. Pressure is a follower traction on the wall of the chamber, where the package uses its volume.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pneumorph.errors import ComputationError
from pneumorph.mechanics.assembly.linear import build_factorisation
from pneumorph.mechanics.assembly.pattern import Pattern
from pneumorph.mechanics.elements.plate import rigid_displacement
from pneumorph.mesh.tets import TET_EDGES, TET_RULE, TRIANGLE_RULE, TetMesh, area_vectors
from pneumorph.verify.verdict import Unavailable

BUBBLE = -1 / 8
"""Value of NGSolve's quadratic edge function at the middle of the edge."""

MOST_STEPS = 25
"""Of Newton's method, from our solution."""


def ngsolve() -> Any:
    """The library; raises Unavailable if it is not installed."""
    try:
        return import_module("ngsolve")
    except ImportError:
        raise Unavailable("NGSolve is not installed; pip install ngsolve") from None


@dataclass(frozen=True)
class NGSolveMesh:
    """A mesh in NGSolve.

    Attributes
    ----------
    mesh, space : the mesh of curved elements, and its quadratic vector space.
    to_coefficients : (n, 3N) sparse
        Matrix from nodal values, ordered by node and then component, to NGSolve's coefficients.
    """

    mesh: Any
    space: Any
    to_coefficients: sparse.csr_array


def ngsolve_mesh(mesh: TetMesh) -> NGSolveMesh:
    """Convert a mesh to NGSolve; its faces keep their names."""
    ng = ngsolve()
    netgen: Any = import_module("netgen.meshing")

    corners, tets = np.unique(mesh.tets[:, :4], return_inverse=True)
    number = np.full(len(mesh.points), -1)
    number[corners] = np.arange(len(corners))
    straight = netgen.Mesh(dim=3)
    points = [straight.Add(netgen.MeshPoint(netgen.Pnt(*place))) for place in mesh.points[corners]]
    region = np.ones(len(mesh.tets), int)
    for index, elements in enumerate(mesh.regions.values(), 1):
        region[elements] = index
    for index, tet in zip(region.tolist(), tets.reshape(-1, 4), strict=True):
        straight.Add(netgen.Element3D(index, [points[node] for node in tet]))
    for index in range(1, region.max() + 1):
        straight.SetMaterial(index, f"region{index}")
    for side, (name, triangles) in enumerate(mesh.faces.items()):
        straight.Add(netgen.FaceDescriptor(surfnr=side + 1, domin=1, domout=0, bc=side + 1))
        straight.SetBCName(side, name)
        for triangle in number[triangles[:, :3]]:
            straight.Add(netgen.Element2D(side + 1, [points[node] for node in triangle]))
    bent = ng.Mesh(straight)
    space = ng.VectorH1(bent, order=2)
    to_coefficients = _to_coefficients(mesh, bent, corners, number)
    bend = ng.GridFunction(space)
    away = mesh.points.copy()
    ends = _edge_ends(mesh)
    away[ends[:, 2]] -= mesh.points[ends[:, :2]].mean(axis=1)
    away[corners] = 0.0
    bend.vec.FV().NumPy()[:] = to_coefficients @ away.ravel()
    bent.SetDeformation(bend)
    return NGSolveMesh(bent, space, to_coefficients)


def nodal(body: NGSolveMesh, coefficients: np.ndarray) -> np.ndarray:
    """Nodal values (N, 3) from NGSolve's coefficients (n,)."""
    return splu(body.to_coefficients.tocsc()).solve(coefficients).reshape(-1, 3)


def _edge_ends(mesh: TetMesh) -> np.ndarray:
    """The end nodes, ascending, and the mid-side node of every edge (E, 3)."""
    rows = np.concatenate([mesh.tets[:, [*pair, 4 + k]] for k, pair in enumerate(TET_EDGES)])
    rows[:, :2].sort(axis=1)
    return np.unique(rows, axis=0)


def _to_coefficients(mesh: TetMesh, bent: Any, corners: np.ndarray, number: np.ndarray) -> sparse.csr_array:
    """Vertex coefficients are nodal values; edge coefficients are (middle − mean of the ends) / `BUBBLE`."""
    ends = _edge_ends(mesh)
    middle = {(number[a], number[b]): node for a, b, node in ends}
    edges = np.array([sorted(vertex.nr for vertex in edge.vertices) for edge in bent.edges])
    nodes = np.array([middle[tuple(pair)] for pair in edges])
    count, rows = len(corners), len(corners) + np.arange(len(edges))
    scalar = sparse.coo_array(
        (
            np.concatenate([np.ones(count), np.repeat([1 / BUBBLE, -0.5 / BUBBLE, -0.5 / BUBBLE], len(edges))]),
            (
                np.concatenate([np.arange(count), np.tile(rows, 3)]),
                np.concatenate([corners, nodes, corners[edges[:, 0]], corners[edges[:, 1]]]),
            ),
        ),
        shape=(count + len(edges), len(mesh.points)),
    )
    return sparse.csr_array(sparse.vstack([sparse.kron(scalar, np.eye(3)[i : i + 1]) for i in range(3)]))


def neo_hookean(F: Any, shear: float, bulk: float) -> Any:
    """The neo-Hookean energy, (41) of the paper, in NGSolve's symbols."""
    ng = ngsolve()
    J = ng.Det(F)
    return shear / 2 * (J ** (-2 / 3) * ng.InnerProduct(F, F) - 3) + bulk / 2 * (J - 1) ** 2


def forms(body: NGSolveMesh, energies: Sequence[Callable[[Any], Any]], pressures: dict[str, float]) -> Any:
    """Virtual work of the rubbers, region by region, and of follower pressures (MPa), with our quadrature points."""
    ng = ngsolve()
    u, v = body.space.TnT()
    in_tets = {ng.TET: ng.IntegrationRule([tuple(map(float, point)) for point in TET_RULE], [1 / 24] * 4)}
    places, weights = TRIANGLE_RULE
    on_walls = {ng.TRIG: ng.IntegrationRule([tuple(map(float, point)) for point in places], list(map(float, weights)))}
    work = ng.BilinearForm(body.space)
    for index, energy in enumerate(energies, 1):
        where = ng.dx(definedon=body.mesh.Materials(f"region{index}"), intrules=in_tets)
        work += ng.Variation(energy(ng.Id(3) + ng.Grad(u)) * where)
    normal = ng.specialcf.normal(3)
    for name, pressure in pressures.items():
        # On a surface only the tangential part of the gradient is known; the area vector needs no more.
        area = ng.Cof(ng.Id(3) + ng.Grad(u).Trace()) * normal
        work += pressure * area * v.Trace() * ng.ds(f"chamber {name}", intrules=on_walls)
    return work


def equilibrium(
    mesh: TetMesh,
    energies: Sequence[Callable[[Any], Any]],
    pressures: dict[str, float],
    u: np.ndarray,
    plate: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (N, 3) and plate motion (6,) at which NGSolve's residual vanishes, by Newton's method.

    The base is clamped, the
    tip is bonded to a rigid plate. Residual and tangent are NGSolve's.

    Parameters
    ----------
    mesh : TetMesh
    energies : sequence of callable
        Of the rubbers of the mesh's regions.
    pressures : {chamber: MPa}
    u : (N, 3) array
        Displacements from which it starts, mm.
    plate : (6,) array
        Motion of the plate from which it starts, mm and rad.

    Raises
    ------
    ComputationError
        If Newton's method does not converge.
    """
    body = ngsolve_mesh(mesh)
    work = forms(body, energies, pressures)
    base, tip = np.unique(mesh.faces["base"]), np.unique(mesh.faces["tip"])
    free = np.setdiff1d(np.arange(len(u)), np.union1d(base, tip))
    state = ngsolve().GridFunction(body.space)
    residual = state.vec.CreateVector()
    u = u.copy()
    for _ in range(MOST_STEPS):
        u[base], u[tip] = 0.0, _tip(mesh, tip, plate)
        state.vec.FV().NumPy()[:] = body.to_coefficients @ u.ravel()
        work.Apply(state.vec, residual)
        forces = body.to_coefficients.T @ residual.FV().NumPy()
        spread = _spread(len(u), free, tip, np.asarray(jax.jacobian(lambda d: _tip(mesh, tip, d))(jnp.asarray(plate))))
        unbalanced = spread.T @ forces
        if np.linalg.norm(unbalanced) <= 1e-10 * np.linalg.norm(forces):
            return u, plate
        work.AssembleLinearization(state.vec)
        values, columns, starts = work.mat.CSR()
        tangent = sparse.csr_array((values.NumPy(), columns, starts), shape=(work.mat.height,) * 2)
        step = _solve(spread.T @ (body.to_coefficients.T @ tangent @ body.to_coefficients) @ spread, unbalanced)
        u[free] -= step[:-6].reshape(-1, 3)
        plate = plate - step[-6:]
    raise ComputationError(f"Newton's method on NGSolve's forms did not converge in {MOST_STEPS} steps")


def _tip(mesh: TetMesh, tip: np.ndarray, plate: np.ndarray | jnp.ndarray) -> jnp.ndarray:
    """Displacements of the tip nodes for the plate motion `plate` (6,) about the centroid of the tip face."""
    places, normals = area_vectors(mesh.points, mesh.faces["tip"])
    area = np.linalg.norm(normals, axis=-1)
    centre = np.einsum("fg,fgd->d", area, places) / area.sum()
    return rigid_displacement(jnp.asarray(mesh.points[tip]), jnp.asarray(centre), jnp.asarray(plate))


def _spread(count: int, free: np.ndarray, tip: np.ndarray, motion: np.ndarray) -> sparse.csr_array:
    """∂u/∂(u_free, plate), shape (3N, 3·free + 6), with ∂u_tip/∂plate = `motion` (tip, 3, 6)."""
    kept = (3 * free[:, None] + np.arange(3)).ravel()
    moved = (3 * tip[:, None] + np.arange(3)).ravel()
    rows = np.concatenate([kept, np.repeat(moved, 6)])
    columns = np.concatenate([np.arange(len(kept)), len(kept) + np.tile(np.arange(6), len(moved))])
    values = np.concatenate([np.ones(len(kept)), motion.reshape(-1)])
    return sparse.csr_array((values, (rows, columns)), shape=(3 * count, len(kept) + 6))


def _solve(matrix: sparse.csr_array, rhs: np.ndarray) -> np.ndarray:
    upper = sparse.csr_array(sparse.triu(matrix))
    upper.sort_indices()
    factor = build_factorisation(Pattern(upper.indptr.astype(np.int32), upper.indices.astype(np.int32)))
    factor.refactorise(upper.data)
    return factor.solve(rhs)
