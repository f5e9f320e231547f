"""States of a body on a mesh of its own, sought near those that a run has stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.analyse import DESIGN_TOLERANCE, Analysis, Discretisation, analyse, build_discretisation
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.castings import TaskState
from pneumorph.analysis.explore import objects_of
from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.geometry.starting import space_of
from pneumorph.mechanics import (
    Guess,
    NoEquilibrium,
    Tangent,
    configure,
    deformation_gradients,
    enclosed_of,
    guided_of,
    loads_of,
    model_of,
    restored,
    settled,
    solve,
)
from pneumorph.mesh.transfer import at_places, between_points, locate, quadrature_points
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.results import Fields, TaskResult
from pneumorph.symmetry.part import Part

FEW = 10
"""Most factorisations with which a state is found again on the mesh that is stored with it."""


@dataclass(frozen=True, eq=False)
class Solved:
    """A body of a problem, or a part of it, with its mesh and the states of all tasks."""

    problem: Problem
    disc: Discretisation
    analysis: Analysis


def analyse_near(
    problem: Problem,
    body: Body,
    part: Part,
    stored: Fields | None = None,
    results: Mapping[str, TaskResult] | None = None,
) -> Solved:
    """Mesh a body, or a part of it, and find the states of all tasks.

    Parameters
    ----------
    problem : with the pressures of the body as those it starts from.
    body : one of its designs.
    part : what of it is meshed; () for the whole body.
    stored, results : displacements and results of the tasks, if they are known: the states are sought near them.

    Raises
    ------
    ComputationError
        If the body cannot be meshed, or a task has no equilibrium.
    """
    space = space_of(problem, body)
    with doing("the whole body" if part == () else "the body"):
        like = None if stored is None else stored.unfolded(part).mesh
        disc = build_discretisation(problem, mesh_of(problem, body, part, like=like), body.control_points())
        near = None if stored is None else _states_near(problem, disc, stored, results or {})
        analysis = analyse(problem, space, disc, space.start, near)
        if isinstance(analysis, NoEquilibrium):
            analysis = analyse(problem, space, disc, space.start, explain=True)
    if isinstance(analysis, NoEquilibrium):
        raise ComputationError(f"the body has no equilibrium: {analysis.reason}")
    return Solved(problem, disc, analysis)


def stored_states(problem: Problem, stored: Fields, results: Mapping[str, TaskResult]) -> dict[str, TaskState] | None:
    """The states of a design on the mesh that is stored with it; None if one of them is no equilibrium there.

    Parameters
    ----------
    problem : with the pressures of the design as those it starts from.
    stored, results : of the design.
    """
    mesh, model, states = stored.mesh, model_of(problem, stored.mesh), {}
    for task in problem.task:
        result, under = results[task.name], acting(problem, task)
        loads = loads_of(problem, model, dict(result.pressures), task.poses, under=under)
        at = configure(model, mesh.points, loads, guided_of(problem, under), enclosed_of(problem, task.volumes))
        plate = np.array([*result.translation, *result.rotation]) if model.plate else np.zeros(6)
        near = restored(model, mesh.points, stored.u[task.name], plate, objects_of(model, loads, result))
        tangent = Tangent(model)
        found = solve(at, tangent, near, DESIGN_TOLERANCE, most=FEW)
        if isinstance(found, NoEquilibrium):
            return None
        states[task.name] = TaskState(settled(at, found), tangent, found, result.objective)
    return states


def _states_near(
    problem: Problem, disc: Discretisation, stored: Fields, results: Mapping[str, TaskResult]
) -> dict[str, Guess]:
    """Stored states on another mesh of the same body."""
    whole, X, model = stored.whole(), disc.morph.mesh.points, disc.model
    nodes = locate(whole.mesh, X)
    points = locate(whole.mesh, quadrature_points(disc.morph.mesh.tets, X))
    guesses = {}
    for task in problem.task:
        result, u = results[task.name], whole.u[task.name]
        loads = loads_of(problem, model, dict(result.pressures), task.poses, under=acting(problem, task))
        plate = np.array([*result.translation, *result.rotation]) if model.plate else np.zeros(6)
        objects = objects_of(model, loads, result)
        state = restored(model, X, at_places(whole.mesh, u, nodes), plate, objects)
        F = deformation_gradients(whole.mesh.tets, whole.mesh.points, u)
        guesses[task.name] = Guess(state, between_points(F, points).reshape(3, 3, 4, -1))
    return guesses
