"""How much tubes in the ports of a body change its motion.

A tube that is pressed and glued into its port is much stiffer than the rubber. The elements of a port, whose nodes are
moved onto its surface, get the stiffness of a tube. The same mesh is solved with and without tubes: errors of the mesh
cancel in the difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.analysis.analyse import DESIGN_TOLERANCE, refuse_friction
from pneumorph.analysis.bodies import mesh_of
from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    Rubber,
    Tangent,
    configure,
    guided_of,
    loads_of,
    mirrors_of,
    model_of,
    neo_hookean_rubber,
    rubber_of,
    solve,
)
from pneumorph.mesh import TetMesh, scaled_jacobian
from pneumorph.mesh.tets import TET_EDGES
from pneumorph.objective import Features, measure_features
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting_in
from pneumorph.symmetry.operations import MIRRORS

STIFFER = 100.0
"""Stiffness of tubes relative to the rubber: soft ones of silicone have less, those of polyurethane about as much."""

_SPLITS = 6  # every edge of an element is divided into as many parts to see how much of it is in a port
_FLATTEST = 0.1  # least quality of elements whose nodes are moved, see `scaled_jacobian`
_HALVINGS = 8
"""How often the motion of a node is halved where an element would become too flat; the rest is a 256th of it."""


@dataclass(frozen=True, eq=False)
class Port:
    """A straight round port.

    Attributes
    ----------
    start, direction : (3,) array
        A point of its axis inside the chamber, mm, and the unit vector out of the body.
    radius : float
        In mm.
    """

    start: np.ndarray
    direction: np.ndarray
    radius: float


@doing("finding the effect of the ports")
def with_and_without(
    problem: Problem, body: Body, pressures: Mapping[str, Mapping[str, float]], ports: Sequence[Port]
) -> dict[str, tuple[Features, Features]]:
    """The motion of every task without and with tubes in the ports; see the module for what is computed.

    Parameters
    ----------
    pressures : {task: {chamber: MPa}}

    Raises
    ------
    MeshError
        If the body cannot be meshed.
    ComputationError
        If a task has no equilibrium.
    """
    planes = mirrors_of(problem, list(pressures.values()))
    mirrors = tuple(plane for plane in planes if _symmetric(ports, np.array(MIRRORS[plane])))
    return compared(problem, with_tubes(mesh_of(problem, body, mirrors).mesh, ports), pressures)


def tube_of(rubber: Rubber) -> Rubber:
    """The material of tubes in a rubber."""
    modulus = STIFFER * rubber.shear_modulus
    return neo_hookean_rubber(modulus, 10.0 * modulus, rubber.density)


def with_tubes(mesh: TetMesh, ports: Sequence[Port]) -> TetMesh:
    """The mesh with the elements that lie in ports as the region "tubes", and all others as "rubber".

    An element belongs to a port if more than half of it is inside. Nodes between both regions are then moved onto the
    ports' surfaces as far as elements stay well-shaped.
    """
    inside = np.zeros(len(mesh.tets), bool)
    points = mesh.points
    still = np.isin(np.arange(len(points)), np.unique([*mesh.faces["base"].ravel(), *mesh.faces["tip"].ravel()]))
    samples = np.einsum("pk,ekc->epc", _shares(_SPLITS), points[mesh.tets[:, :4]])
    for port in ports:
        away, along, _ = _polar(samples, port)
        share = ((away <= port.radius) & (along >= 0.0)).mean(axis=1)
        # In a coarse mesh no element may be half inside; in part of a body its image may be.
        own = (share > 0.5) | ((share > 0.0) & (share == share.max()))
        inside |= own
        between = np.intersect1d(mesh.tets[own, :4], mesh.tets[~own, :4])
        between = between[~still[between]]
        away, along, radial = _polar(points[between], port)
        between, shift = between[along > 0.0], ((port.radius - away)[:, None] * radial)[along > 0.0]
        points = _moved(mesh, points, between, shift)
    return replace(mesh, points=points, regions={"rubber": np.flatnonzero(~inside), "tubes": np.flatnonzero(inside)})


def _polar(points: np.ndarray, port: Port) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances of points (..., 3) from the axis of a port, positions along it, and unit vectors away from it."""
    gap = points - port.start
    along = gap @ port.direction
    radial = gap - along[..., None] * port.direction
    away = np.linalg.norm(radial, axis=-1)
    return away, along, radial / np.maximum(away, 1e-9)[..., None]


def _moved(mesh: TetMesh, points: np.ndarray, nodes: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """The points with `nodes` moved, by less where an element would become too flat; edges there become straight."""
    share = np.ones(len(nodes))
    for _ in range(_HALVINGS):
        moved = points.copy()
        moved[nodes] += share[:, None] * shift
        near = np.isin(mesh.tets[:, :4], nodes).any(axis=1)
        tets = mesh.tets[near]
        touched = np.isin(tets[:, TET_EDGES], nodes).any(axis=2)
        moved[tets[:, 4:][touched]] = moved[tets[:, TET_EDGES]].mean(axis=2)[touched]
        flat = tets[scaled_jacobian(moved, tets) < _FLATTEST]
        if not len(flat):
            return moved
        share[np.isin(nodes, flat[:, :4])] /= 2.0
    return points


def compared(
    problem: Problem, mesh: TetMesh, pressures: Mapping[str, Mapping[str, float]]
) -> dict[str, tuple[Features, Features]]:
    """The motion of every task twice: with the region "tubes" of a mesh made of the rubber, and made of tubes.

    Tasks with equal pressures are solved once.
    """
    refuse_friction(problem)
    rubber = rubber_of(problem.material)
    models = [model_of(problem, mesh, {"rubber": rubber, "tubes": tubes}) for tubes in (rubber, tube_of(rubber))]
    tangents = [Tangent(model) for model in models]
    poses, loads = {task.name: task.poses for task in problem.task}, acting_in(problem)
    known: dict[Any, tuple[Features, Features]] = {}
    results = {}
    for task, own in pressures.items():
        key = (*(own.get(chamber, 0.0) for chamber in models[0].chambers), *poses[task].items(), loads[task])
        if key not in known:
            state, measured = None, []
            for model, tangent in zip(models, tangents, strict=True):
                given = loads_of(problem, model, dict(own), poses[task], under=loads[task])
                at = configure(model, mesh.points, given, guided_of(problem, loads[task]))
                state = _solved(task, solve(at, tangent, state, DESIGN_TOLERANCE)).state
                measured.append(measure_features(model, mesh.points, state))
            known[key] = measured[0], measured[1]
        results[task] = known[key]
    return results


def _solved(task: str, answer: Equilibrium | NoEquilibrium) -> Equilibrium:
    if isinstance(answer, NoEquilibrium):
        raise ComputationError(f"the effect of the ports on task {task} is not known: {answer.reason}")
    return answer


def _symmetric(ports: Sequence[Port], mirror: np.ndarray) -> bool:
    """Whether the ports are each other's mirror images."""
    given = np.array([[port.start, port.direction] for port in ports])
    gaps = np.abs(given[:, None] - mirror * given).max(axis=(2, 3))
    return bool((gaps.min(axis=1) < 1e-3).all())


def _shares(splits: int) -> np.ndarray:
    """Barycentric coordinates (n, 4) of a regular grid of points in a tetrahedron."""
    grid = np.stack(np.meshgrid(*[np.arange(splits + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = grid[grid.sum(axis=1) <= splits]
    return np.column_stack([splits - inside.sum(axis=1), inside]) / splits
