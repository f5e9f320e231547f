"""Displacements, stretches and stresses of a design: pictures and exports use them and solve nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.mechanics import Equilibrium, Rubber, Tangent, configure, guided_of, loads_of, solve
from pneumorph.mesh import TetMesh, unfolded
from pneumorph.mesh.tets import TET_EDGES, TET_RULE, tet_gradient
from pneumorph.problem import Problem


@dataclass(frozen=True, eq=False)
class Fields:
    """The mesh of a design, with the displacements and stretches of every task.

    Attributes
    ----------
    mesh : TetMesh
        The body at rest; half of it where only that was analysed, see `whole`.
    u : {task: (N, 3) mm}
        Displacements of the nodes.
    stretch : {task: (N,)}
        Largest principal stretch at the nodes.
    sag : (N, 3) mm or None
        Displacements under weight and plate loads alone, without pressure; None where there are none of these loads or
        this equilibrium was not computed.
    """

    mesh: TetMesh
    u: Mapping[str, np.ndarray]
    stretch: Mapping[str, np.ndarray]
    sag: np.ndarray | None = None

    def whole(self) -> Fields:
        """The same fields on the whole body."""
        image = unfolded(self.mesh)
        return Fields(
            image.mesh,
            {name: image.vectors(u) for name, u in self.u.items()},
            {name: stretch[image.source] for name, stretch in self.stretch.items()},
            None if self.sag is None else image.vectors(self.sag),
        )

    def pack(self) -> dict[str, np.ndarray]:
        """Arrays from which `unpack_fields` restores these fields."""
        arrays = {"points": self.mesh.points, "tets": self.mesh.tets}
        arrays |= {f"face {name}": triangles for name, triangles in self.mesh.faces.items()}
        arrays |= {f"u {name}": u for name, u in self.u.items()}
        arrays |= {f"stretch {name}": stretch for name, stretch in self.stretch.items()}
        return arrays if self.sag is None else arrays | {"sag": self.sag}


def unpack_fields(arrays: Mapping[str, np.ndarray]) -> Fields:
    """Restore fields from the arrays of `Fields.pack`; KeyError if some are missing."""

    def named(kind: str) -> dict[str, np.ndarray]:
        return {key.removeprefix(f"{kind} "): each for key, each in arrays.items() if key.startswith(f"{kind} ")}

    mesh = TetMesh(arrays["points"], arrays["tets"], named("face"))
    return Fields(mesh, named("u"), named("stretch"), arrays.get("sag"))


def fields_of(disc: Discretisation, analysis: Analysis, sag: np.ndarray | None = None) -> Fields:
    """Collect the fields of an analysed design."""
    mesh = disc.morph.mesh.at(analysis.X)
    u = {name: found.u for name, found in analysis.equilibria.items()}
    return Fields(mesh, u, {name: nodal_stretch(mesh, moved) for name, moved in u.items()}, sag)


def sag_of(problem: Problem, disc: Discretisation, analysis: Analysis) -> np.ndarray | None:
    """Displacements (N, 3) in mm without pressures; None without weight and plate loads, or without an equilibrium."""
    effector = problem.end_effector
    if problem.gravity is None and not any((*effector.force, *effector.moment)):
        return None
    at = configure(disc.model, analysis.X, loads_of(problem, disc.model, {}), guided_of(problem))
    # With another solver: those of the tasks keep the factorisations from which the next design starts.
    found = solve(at, Tangent(disc.model))
    return found.u if isinstance(found, Equilibrium) else None


def nodal_stretch(mesh: TetMesh, u: np.ndarray) -> np.ndarray:
    """Largest principal stretch at the nodes (N,), from displacements u (N, 3) in mm."""
    F = _deformation_gradients(mesh, u)
    squares = np.linalg.eigvalsh(np.swapaxes(F, -1, -2) @ F)
    return _at_nodes(mesh, np.sqrt(squares[..., -1]))


def nodal_stress(mesh: TetMesh, u: np.ndarray, rubber: Rubber) -> np.ndarray:
    """Von Mises stress at the nodes (N,) in MPa, of the Cauchy stress; hydrostatic stress does not contribute."""
    F = _deformation_gradients(mesh, u)
    parameters = jnp.asarray(rubber.parameters, dtype=float)
    # Energies take the points as trailing axes.
    nominal = jax.grad(lambda at: jnp.sum(rubber.isochoric(at, parameters)))(jnp.moveaxis(F, (-2, -1), (0, 1)))
    stress = np.moveaxis(np.asarray(nominal), (0, 1), (-2, -1)) @ np.swapaxes(F, -1, -2)
    stress /= np.linalg.det(F)[..., None, None]
    deviator = stress - np.trace(stress, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) / 3
    return _at_nodes(mesh, np.sqrt(1.5 * (deviator**2).sum((-2, -1))))


def _deformation_gradients(mesh: TetMesh, u: np.ndarray) -> np.ndarray:
    """F (M, 4, 3, 3) at the quadrature points."""
    gradients = tet_gradient(TET_RULE)
    jacobian = np.einsum("eai,gaj->egij", mesh.points[mesh.tets], gradients)
    moved = np.einsum("eai,gaj->egij", (mesh.points + u)[mesh.tets], gradients)
    return moved @ np.linalg.inv(jacobian)


def _at_nodes(mesh: TetMesh, values: np.ndarray) -> np.ndarray:
    """A field (N,) from values (M, 4) at the quadrature points, averaged over the elements at every corner node.

    Mid-side nodes get the mean of the ends of their edge: too few elements share them for an average of their own.
    """
    # Linear extrapolation from the four points of the rule to the corners.
    barycentric = np.column_stack([1.0 - TET_RULE.sum(axis=1), TET_RULE])
    at_corners, corners = values @ np.linalg.inv(barycentric).T, mesh.tets[:, :4].ravel()
    count = np.bincount(corners, minlength=len(mesh.points))
    field = np.bincount(corners, at_corners.ravel(), minlength=len(mesh.points)) / np.maximum(count, 1)
    field[mesh.tets[:, 4:]] = field[mesh.tets[:, TET_EDGES]].mean(axis=2)
    return field
