"""How far a state is from that on infinitely fine meshes: an estimate by a linear step on a refined mesh.

Every element is divided into eight, so a state u of the mesh is also one of the refined mesh, where its residual R is
not zero. The state there is u − K⁻¹R to first order. To that order a motion m changes by −zᵀR with its adjoint z,
K z = ∂m/∂u, the residual weighted by the dual solution (Becker and Rannacher 2001, Acta Numerica 10, 1–102). The step
is found by a few products with K (`mechanics/solve/refined.py`), for all motions, volumes and forces at once. Where
these do not lead near equilibrium, as where fibres become slack, the state on the refined mesh is searched for. What
further refinement adds is taken from the order with which errors fall.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.analysis.castings import TaskState
from pneumorph.analysis.collect import vector
from pneumorph.doing import doing
from pneumorph.errors import Hopeless
from pneumorph.mechanics import (
    Configuration,
    Model,
    NoEquilibrium,
    State,
    Tangent,
    model_of,
    rotation_vector,
    settled,
    solve,
)
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.mechanics.solve.refined import guess_on_refined, near_refined, search_refined
from pneumorph.mesh import TetMesh
from pneumorph.mesh.refine import Refined, refine
from pneumorph.objective import Features, Objective, Workspace
from pneumorph.problem import Problem
from pneumorph.results import FineResult, TaskResult
from pneumorph.sensitivity import objective_value

ORDER = 1.2
"""Order in the size of elements with which errors of motions are taken to fall. It is 4 for smooth solutions, but at
the clamped base and at inner edges of chambers displacements go like r^λ with λ of about 0.6, and errors of motions
fall with 2λ. If they fall with 4, the estimate is 1.7 times the error; if with 1, 0.9 times."""

BEYOND = 1.0 / (1.0 - 2.0**-ORDER)
"""The whole error over the part of it that one refinement removes."""

MOST = 80_000
"""Elements of refined meshes that are small enough for factorisations at the end of a run, in time and memory."""

MOST_FACTORISATIONS = 30
"""Of such a search."""

ROUGHLY = 1e-3
"""Relative residual at which it ends: an estimate needs two digits of the difference of both meshes."""

LEVER = 10.0
"""mm: the distance at which a rotation is compared with a translation, about the radius of a body."""


@dataclass(frozen=True)
class MeshError:
    """How far the result of a task is from that on infinitely fine meshes.

    Attributes
    ----------
    here : FineResult or TaskResult
        What is reported on the mesh.
    fine : FineResult
        What would be on infinitely fine meshes.
    """

    here: FineResult | TaskResult
    fine: FineResult

    @property
    def motion(self) -> np.ndarray:
        """Translation (mm) and rotation vector (rad) (6,) of the tip on the mesh."""
        return np.array([*self.here.translation, *self.here.rotation])

    @property
    def missing(self) -> np.ndarray:
        """What they would be more (6,) on infinitely fine meshes."""
        return self.corrected - self.motion

    @property
    def share(self) -> float:
        """The error over the motion, where rotations count as the motion of a point at the distance `LEVER`."""
        weights = np.repeat([1.0, LEVER], 3)
        return float(np.linalg.norm(weights * self.missing) / max(np.linalg.norm(weights * self.motion), 1e-9))

    @property
    def corrected(self) -> np.ndarray:
        """The estimate (6,) of the motions without the error of the mesh."""
        return np.array([*self.fine.translation, *self.fine.rotation])


@dataclass(frozen=True, eq=False)
class RefinedModel:
    """A refined mesh with its model."""

    fine: Refined
    model: Model

    def near(
        self, at: Configuration, tangent: Tangent, state: State, thorough: bool = True
    ) -> tuple[Configuration, State, bool] | None:
        """The state near one of the coarser mesh, and whether it had to be searched for; None if none is found.

        Parameters
        ----------
        at, state : of the coarser mesh.
        tangent : its linear solver.
        thorough : whether it is searched for where a few products do not give it.
        """
        there = replace(at, model=self.model, X=self.fine.mesh.points)
        near = near_refined(self.fine, at, tangent, state, there)
        if near is not None:
            return *near, False
        if not thorough:
            return None
        searched = search_refined(self.fine, at, tangent, state, there)
        if searched is not None:
            return there, searched, True
        start = guess_on_refined(self.fine, at, state)
        found = solve(there, Tangent(self.model), start, ROUGHLY, most=MOST_FACTORISATIONS)
        return None if isinstance(found, NoEquilibrium) else (settled(there, found), found.state, True)


def refined_model(problem: Problem, mesh: TetMesh) -> RefinedModel | None:
    """A mesh of a problem's body, refined; None where an obstacle touches its finer faces."""
    fine = refine(mesh)
    try:
        return RefinedModel(fine, model_of(problem, fine.mesh))
    except Hopeless:
        return None


def mesh_errors(
    problem: Problem, disc: Discretisation, analysis: Analysis, thorough: bool = True
) -> dict[str, MeshError]:
    """The error by the mesh in every task: mostly a few products with the tangent of the refined mesh for each.

    Tasks of which no state is found on the refined mesh are left out.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    thorough : whether the refined mesh may be factorised where it must be, to search for states and for objectives that
        are no functions of the state alone; without it those are as on the mesh.
    """
    states = {name: analysis.state(disc, name) for name in analysis.configurations}
    return errors_of(problem, disc.morph.mesh.at(analysis.X), disc.objectives, states, thorough)


def errors_of(
    problem: Problem,
    mesh: TetMesh,
    objectives: Mapping[str, Objective],
    states: Mapping[str, TaskState],
    thorough: bool = True,
) -> dict[str, MeshError]:
    """The same of the states of tasks on a mesh."""
    refined, errors = refined_model(problem, mesh), {}
    if refined is None:
        return errors
    for name, (at, tangent, equilibrium, value, _) in states.items():
        objective, state = objectives[name], equilibrium.state
        found = refined.near(at, tangent, state, thorough)
        if found is not None:
            there, near, searched = found
            here = objective.features(at.model, at.X, state)
            moved = extrapolated(here, objective.features(there.model, there.X, near))
            finer = value
            if objective.instead is None:
                pressures = dict(zip(at.model.chambers, np.asarray(at.loads.pressure), strict=True))
                finer = float(objective.value(moved)) + objective.of_pressures(pressures)
            elif thorough and not isinstance(objective.instead, Workspace):
                # That of a workspace is not estimated: it needs the states of all its tasks.
                finer = beyond(value, objective_value(there, Tangent(refined.model), near, objective))
            results = (_result(objective, *each, searched) for each in ((here, value), (moved, finer)))
            errors[name] = MeshError(*results)
    return errors


def beyond(here: float, fine: float) -> float:
    """A value on infinitely fine meshes, by those on a mesh and on that refined once."""
    return here + BEYOND * (fine - here)


def extrapolated(here: Features, fine: Features) -> Features:
    """Features on infinitely fine meshes, by those on a mesh and on that refined once."""
    found = jax.tree.map(lambda one, other: np.asarray(beyond(one, other)), here, fine)
    turns = [rotation_vector(to @ of.T) for of, to in zip(here.section_rotation, fine.section_rotation, strict=True)]
    whole = [rotation(BEYOND * turn) @ of for turn, of in zip(turns, here.section_rotation, strict=True)]
    return found._replace(section_rotation=np.array(whole).reshape(-1, 3, 3))


def _result(objective: Objective, moved: Features, value: float, searched: bool) -> FineResult:
    """What is reported of features, and the value of the objective."""
    return FineResult(
        objective=value,
        errors={name: float(error(moved)) for name, error in objective.errors.items()},
        translation=vector(moved.translation),
        rotation=vector(moved.rotation),
        volumes={name: float(volume) for name, volume in moved.volume.items()},
        contact={name: vector(on.force) for name, on in moved.contact.items()},
        contact_normal={name: float(on.normal) for name, on in moved.contact.items()},
        contact_area={name: float(on.area) for name, on in moved.contact.items()},
        searched=searched,
    )


@doing("the error of the mesh")
def quick_errors(problem: Problem, disc: Discretisation, analysis: Analysis) -> dict[str, MeshError]:
    """The error by the mesh in every task, see `mesh_errors`; thorough only where the refined mesh is not too large.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    """
    return mesh_errors(problem, disc, analysis, thorough=8 * disc.model.elements <= MOST)
