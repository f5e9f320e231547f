"""What is reported and stored of an analysed design: results task by task, and fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from pneumorph.analysis.analyse import DESIGN_TOLERANCE, Analysis, Discretisation
from pneumorph.analysis.castings import TaskState, casting_name
from pneumorph.doing import doing
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    State,
    Tangent,
    configure,
    enclosed_of,
    guided_of,
    loads_of,
    rotation_vector,
    settled,
    solve,
)
from pneumorph.mechanics.assembly.enclosed import amounts
from pneumorph.objective import Features
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.results import Fields, Inflation, TaskResult, nodal_stretch
from pneumorph.results.fields import skin_of
from pneumorph.results.records import Vector

MOST_FACTORISATIONS = 40
"""Most for the partly inflated states of a task: they are only shown, so a missing one does no harm."""

PARTS = tuple(part / 6 for part in range(1, 6))
"""Fractions of the pressures of a task at which the last design is stored, to show how it inflates."""


def collect_task_results(disc: Discretisation, analysis: Analysis) -> dict[str, TaskResult]:
    """Collect the result of every task of an analysed design, by the task's name."""
    return {
        name: replace(
            _result(disc, name, analysis.state(disc, name), analysis.pressures[name]),
            self_intersecting=analysis.self_intersecting[name],
        )
        for name in analysis.equilibria
    }


def collect_castings(disc: Discretisation, analysis: Analysis) -> dict[str, TaskResult]:
    """The same of perturbed castings, by the task's name with a number; whether they intersect is not known."""
    results = {}
    for name, castings in analysis.castings.items():
        for number, off in enumerate(castings):
            pressures = (np.asarray(off.at.loads.pressure) / off.softer).tolist()
            own = dict(zip(disc.model.chambers, pressures, strict=True))
            results[casting_name(name, number)] = _result(disc, name, off, own)
    return results


def _result(disc: Discretisation, name: str, state: TaskState, pressures: Mapping[str, float]) -> TaskResult:
    """The result of a state in a task at pressures in MPa."""
    objective, at, equilibrium = disc.objectives[name], state.at, state.equilibrium
    moved = objective.features(disc.model, at.X, equilibrium.state)
    translations, rotations = poses_of(disc.model, moved)
    return TaskResult(
        pressures=pressures,
        objective=state.value,
        errors={key: float(error(moved)) for key, error in objective.errors.items()},
        translation=vector(moved.translation),
        rotation=vector(moved.rotation),
        section_positions=tuple(map(vector, np.asarray(moved.section_position))),
        section_rotations=tuple(vector(rotation_vector(turn)) for turn in np.asarray(moved.section_rotation)),
        volumes=equilibrium.volumes,
        max_stretch=equilibrium.max_stretch,
        beyond_validity=disc.model.beyond_validity(equilibrium.stretches),
        stable=equilibrium.stable,
        region_stretches=by_region(equilibrium.stretches),
        contact={name: vector(on.force) for name, on in moved.contact.items()},
        contact_normal={name: float(on.normal) for name, on in moved.contact.items()},
        contact_area={name: float(on.area) for name, on in moved.contact.items()},
        pose_translations=translations,
        pose_rotations=rotations,
        gas=amounts(disc.model, at.X, at.enclosed),
    )


def poses_of(model: Model, moved: Features) -> tuple[dict[str, Vector], dict[str, Vector]]:
    """Displacements and rotation vectors of free obstacles."""
    free = [] if model.contact is None else list(model.contact.free)
    poses = {name: np.asarray(moved.pose[name]) for name in free}
    return {name: vector(pose[:3]) for name, pose in poses.items()}, {
        name: vector(pose[3:]) for name, pose in poses.items()
    }


def by_region(stretches: Mapping[str, float]) -> Mapping[str, float]:
    """The largest stretch of every region of a body that has several."""
    return stretches if len(stretches) > 1 else {}


def vector(components) -> Vector:
    """Three components as Python floats."""
    return cast(Vector, tuple(map(float, np.asarray(components))))


def collect_fields(
    disc: Discretisation,
    analysis: Analysis,
    sag: np.ndarray | None = None,
    inflation: Mapping[str, Inflation] | None = None,
    thickening: Mapping[str, Mapping[str, np.ndarray]] | None = None,
) -> Fields:
    """Collect the fields of an analysed design.

    Parameters
    ----------
    disc : its mesh.
    analysis : its states.
    sag : (N, 3) mm, of `compute_sag`, if it is stored.
    inflation : of `compute_inflation`, if it is stored.
    thickening : of `thickenings`, if it is stored.
    """
    mesh = disc.morph.mesh.at(analysis.X)
    u = {name: equilibrium.u for name, equilibrium in analysis.equilibria.items()}
    stretch = {name: nodal_stretch(mesh, moved) for name, moved in u.items()}
    return Fields(mesh, u, stretch, sag, inflation or {}, thickening or {})


@doing("finding how it sags without pressure")
def compute_sag(problem: Problem, disc: Discretisation, analysis: Analysis) -> np.ndarray | None:
    """Displacements (N, 3) in mm without pressures, under the first task's loads; None if it has none, or no state."""
    at = _without_pressures(problem, disc, analysis)
    if at is None:
        return None
    # With another solver: those of the tasks keep the factorisations from which the next design starts.
    equilibrium = solve(at, Tangent(disc.model), tolerance=DESIGN_TOLERANCE, most=MOST_FACTORISATIONS)
    return equilibrium.u if isinstance(equilibrium, Equilibrium) else None


def _without_pressures(problem: Problem, disc: Discretisation, analysis: Analysis) -> Configuration | None:
    """A design under the first task's loads alone, if it has any."""
    under = acting(problem, problem.task[0])
    if not under.moves or enclosed_of(problem, {}) is not None:
        return None
    reinforcement = next(iter(analysis.configurations.values())).loads.reinforcement
    loads = loads_of(problem, disc.model, {}, reinforcement=reinforcement, under=under)
    return configure(disc.model, analysis.X, loads, guided_of(problem, under))


def compute_inflation(
    problem: Problem, disc: Discretisation, analysis: Analysis
) -> tuple[np.ndarray | None, dict[str, Inflation]]:
    """How a design sags, as by `compute_sag`, and its surfaces at the fractions `PARTS` of every task's pressures.

    The pressures are lowered from the equilibrium under all of them, so that the path leads to the state that is
    reported, also where the body has several. Where the path is lost, or takes too long, the states found so far are
    kept. That of the first task goes on to where the body sags: it is near, while from rest it takes many steps.
    """
    mesh = disc.morph.mesh.at(analysis.X)
    skin = skin_of(mesh)
    # A solver of its own, as for the sag.
    tangent, inflation, sag = Tangent(disc.model), {}, None
    for task, pressures in analysis.pressures.items():
        if not any(pressures.values()):
            continue
        at, states = analysis.configurations[task], []
        on_the_way = [(part, _with_part(at, part)) for part in reversed(PARTS)]
        if task == problem.task[0].name and (empty := _without_pressures(problem, disc, analysis)) is not None:
            on_the_way.append((0.0, empty))
        with doing(f"inflating task {task} for its pictures"):
            for part, answer in _lowered(at, analysis.equilibria[task].state, on_the_way, tangent):
                if part:
                    states.append((part, answer.u[skin], nodal_stretch(mesh, answer.u)[skin]))
                elif answer.stable:
                    sag = answer.u
        if states:
            parts, u, stretch = (np.array(each) for each in zip(*reversed(states), strict=True))
            inflation[task] = Inflation(parts, u.astype(np.float32), stretch.astype(np.float32))
    return compute_sag(problem, disc, analysis) if sag is None else sag, inflation


def _with_part(at: Configuration, part: float) -> Configuration:
    """A configuration with a part of its pressures."""
    loads, filled = at.loads, at.enclosed
    return replace(at, loads=loads._replace(pressure=part * loads.pressure), enclosed=filled and filled.part(part))


def _lowered(
    at: Configuration, state: State, on_the_way: Sequence[tuple[float, Configuration]], tangent: Tangent
) -> Iterator[tuple[float, Equilibrium]]:
    """Equilibria at parts of the pressures, from the largest down, as far as they are found.

    Parameters
    ----------
    at, state : under all of the pressures.
    on_the_way : parts of them, falling, and the loads there.
    tangent : the solver.
    """
    here, passed, left = 1.0, [], MOST_FACTORISATIONS
    for part, to in on_the_way:
        earlier = [(one, (was - here) / (part - here)) for one, was in passed]
        answer = solve(to, tangent, None, DESIGN_TOLERANCE, (at, state), left, earlier=earlier)
        if isinstance(answer, NoEquilibrium):
            return
        passed.append((state, here))
        at, state, here, left = settled(to, answer), answer.state, part, left - answer.factorisations
        yield part, answer
