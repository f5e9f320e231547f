"""Simulate a body: equilibria at the tasks' pressures or along sweeps, free or with motions of its plate held."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import starmap
from typing import Any, cast

import numpy as np

from pneumorph.analysis.accuracy import beyond, extrapolated, refined_model
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.collect import vector
from pneumorph.analysis.cycles import Durations, cycles_of, timed_paths
from pneumorph.analysis.pressures import MOTIONS, PressurePath, pressure_paths
from pneumorph.analysis.steps import reaction_of, step_of
from pneumorph.analysis.stiffness import direction, stiffness_at
from pneumorph.analysis.tolerances import Tolerances, of_sources
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    COMPONENTS,
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Skin,
    State,
    Tangent,
    Whole,
    configure,
    enclosed_of,
    exerted_on_blocks,
    guided_of,
    loads_of,
    model_of,
    part_of,
    sealed,
    settled,
    sweep,
    sweep_with_friction,
    sweep_with_memory,
    whole_of,
)
from pneumorph.mesh import TetMesh
from pneumorph.objective import Objective, build_objectives, measure_features
from pneumorph.problem import Problem
from pneumorph.problem.acting import Acting, acting
from pneumorph.results import Fields
from pneumorph.results.records import Vector
from pneumorph.results.sweeps import Cycle, SweepStep
from pneumorph.sensitivity import by_moduli

MOST_FRICTION = 10.0
"""A larger coefficient is taken for a mistake: those of rubber are a few at most."""
QUICK = 16_000
"""Elements of refined meshes that are small enough for a search at the end of a sweep."""
Poses = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Curve:
    """The steps of one sweep.

    Attributes
    ----------
    task : the task that gives the pressures of all other chambers.
    swept : names of the swept chambers, and of motions of obstacles, such as "plate.z".
    steps : all that have been computed.
    per_cycle : steps there and back, after the first; 0 where the sweep goes one way alone.
    """

    task: str
    swept: tuple[str, ...]
    steps: list[SweepStep]
    per_cycle: int = 0

    @property
    def found(self) -> list[SweepStep]:
        """The steps that have an equilibrium."""
        return [step for step in self.steps if step.converged]

    @property
    def cycles(self) -> list[Cycle]:
        """The energy of its whole cycles; none where obstacles move, whose work is not known."""
        return [] if any("." in name for name in self.swept) else cycles_of(self.task, self.steps, self.per_cycle)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A meshed body, ready for its sweeps.

    Attributes
    ----------
    problem, mesh, model : the problem, the mesh and its mechanical model.
    pressures : {task: {chamber: MPa}}
        Pressures of the chambers that `paths` leave out.
    paths : the pressures of the sweeps, each computed for every task.
    targets : {task: Objective}
        Objectives of the tasks with a target, from which the steps have their distance.
    friction : coefficient of friction on obstacles.
    stiffness : whether the stiffness of the tip is found at every step.
    along : a direction in which the tip is blocked then.
    durations : of every step of the paths, s, where the rubber remembers what was before; else it is elastic.
    """

    problem: Problem
    mesh: TetMesh
    model: Model
    pressures: Mapping[str, Mapping[str, float]]
    paths: list[PressurePath]
    targets: Mapping[str, Objective] = field(default_factory=dict)
    friction: float = 0.0
    stiffness: bool = False
    along: Vector | None = None
    durations: Durations | None = None

    @property
    def count(self) -> int:
        """Number of steps of all sweeps."""
        return sum(map(len, self._alike)) * sum(len(path.steps) for path in self.paths)

    @property
    def left_out(self) -> dict[str, str]:
        """Tasks that are not simulated, since under these loads each is the same as another one: {task: that one}."""
        shown = {task for tasks in self._alike for task in tasks}
        return {task: self._first_like(task) for task in self.pressures if task not in shown}

    @property
    def _alike(self) -> list[list[str]]:
        """Tasks under equal loads, solved together: the first of them, and others with a target of their own."""
        groups: dict[str, list[str]] = {}
        for task in self.pressures:
            first = self._first_like(task)
            if task == first or task in self.targets:
                groups.setdefault(first, []).append(task)
        return list(groups.values())

    def _first_like(self, task: str) -> str:
        """The first task whose chambers have the same pressures, but for those that the paths give."""
        path = self.paths[0]

        def own(name: str) -> tuple[dict[str, float], Poses, Acting, dict[str, float]]:
            pressures = {
                chamber: part for chamber, part in self.pressures[name].items() if chamber not in path.steps[0]
            }
            volumes = _volumes(self.problem, name, path.steps[0], path.volumes[0])
            return pressures, self._poses(name, path.moves[0]), _loads(self.problem, name, path.holds[0]), volumes

        return next(name for name in self.pressures if own(name) == own(task))

    def _poses(self, task: str, given: Mapping[str, float]) -> Poses:
        """Displacements and rotation vectors (6,) of obstacles in a task, where some of their components are given."""
        own, still = next(each.poses for each in self.problem.task if each.name == task), (0.0,) * len(MOTIONS)
        names = [obstacle.name for obstacle in self.problem.obstacle]
        moves = {
            name: tuple(
                given.get(f"{name}.{motion}", part) for motion, part in zip(MOTIONS, own.get(name, still), strict=True)
            )
            for name in names
        }
        return {name: pose for name, pose in moves.items() if any(pose)}

    @property
    def blocked(self) -> np.ndarray:
        """The components (6,) bool of the plate that are held in some task or step."""
        names = {
            name
            for task in self.pressures
            for path in self.paths
            for given in path.holds
            for name in _loads(self.problem, task, given).hold.values
        }
        return np.isin(COMPONENTS, list(names))

    def run(self, curves: list[Curve]) -> Iterator[SweepStep]:
        """Compute and yield step after step; every sweep appends a curve to `curves` and its steps to that curve."""
        tangent = Tangent(self.model)
        whole = whole_of(self.model, self.mesh) if self.model.part else None
        skin = Skin(self.mesh)
        whole_skin = Skin(whole.image.mesh) if whole else skin
        for tasks in self._alike:
            own = self.pressures[tasks[0]]
            for path, taken in zip(self.paths, self.durations or [None] * len(self.paths), strict=True):
                new = [Curve(task, path.swept, [], path.per_cycle) for task in tasks]
                times = None if taken is None or not any(taken[1:]) else np.cumsum([0.0, *taken[1:]])
                curves += new
                along = [{**own, **given} for given in path.steps]
                poses = [self._poses(tasks[0], given) for given in path.moves]
                under = [_loads(self.problem, tasks[0], given) for given in path.holds]
                filled = [
                    _volumes(self.problem, tasks[0], *each) for each in zip(path.steps, path.volumes, strict=True)
                ]
                configurations = list(starmap(self._configured, zip(along, poses, under, filled, strict=True)))
                found = enumerate(self._sweep(configurations, taken, tangent, whole), start=1)
                for pressures, posed, (number, (at, answer)) in zip(along, poses, found, strict=True):
                    moves, turns = (_parts(posed, part) for part in (slice(0, 3), slice(3, 6)))
                    own_skin = whole_skin if whole and at.model is whole.model else skin
                    step = step_of(tasks[0], pressures, at, answer, own_skin)
                    time = None if times is None else float(times[number - 1])
                    step = replace(step, moves=moves, turns=turns, time=time)
                    own_tangent = whole.tangent if whole and at.model is whole.model else tangent
                    if self.stiffness and isinstance(answer, Equilibrium):
                        stiff = stiffness_at(settled(at, answer), own_tangent, answer, whole, self.along)
                        step = replace(step, stiffness=stiff)
                    if isinstance(answer, Equilibrium) and answer.stable:
                        step = self._with_rubber(step, at, own_tangent, answer)
                    if number == len(configurations) and isinstance(answer, Equilibrium):
                        step = self._with_error(step, at, own_tangent, answer, whole)
                    for curve in new:
                        curve.steps.append(replace(step, task=curve.task, errors=self._errors(curve.task, at, answer)))
                        yield curve.steps[-1]

    def _configured(
        self, pressures: dict[str, float], poses: Poses, under: Acting, volumes: dict[str, float]
    ) -> Configuration:
        loads, guided = (
            loads_of(self.problem, self.model, pressures, poses, under=under),
            guided_of(self.problem, under),
        )
        return configure(self.model, self.mesh.points, loads, guided, enclosed_of(self.problem, volumes))

    def _sweep(
        self, path: list[Configuration], durations: list[float] | None, tangent: Tangent, whole: Whole | None
    ) -> Iterable[tuple[Configuration, Equilibrium | NoEquilibrium]]:
        if durations is not None:
            return sweep_with_memory(path, durations, tangent)
        if self.friction:
            return sweep_with_friction(path, tangent, self.friction)
        if whole is not None:
            return _sweep_of_part(path, tangent, whole)
        return zip(path, sweep(path, tangent), strict=True)

    def _with_rubber(self, step: SweepStep, at: Configuration, tangent: Tangent, answer: Equilibrium) -> SweepStep:
        """A step with what is known of the moduli of the rubbers, each of which scatters by itself."""
        known = of_sources(Tolerances(), self.problem).rubbers
        if self.friction or self.durations is not None or not known:
            return step
        found = by_moduli(settled(at, answer), tangent, answer.state)
        off = [(part, found[name]) for name, part in known.items()]
        moved = np.array([part * each.motion for part, each in off])
        forces = np.array([part * each.exerted for part, each in off])
        spring = at.model.copies * np.asarray(at.loads.spring) * (moved if at.model.plate else 0.0)
        exerted = np.linalg.norm(forces + spring, axis=0)
        return replace(
            step,
            rubber_translation=vector(np.linalg.norm(moved[:, :3], axis=0)),
            rubber_rotation=vector(np.linalg.norm(moved[:, 3:], axis=0)),
            rubber_reaction={name: float(exerted[COMPONENTS.index(name)]) for name in step.reaction},
            rubber_volumes={
                name: float(np.linalg.norm([part * each.volumes[name] for part, each in off])) for name in step.volumes
            },
        )

    def _with_error(
        self, step: SweepStep, at: Configuration, tangent: Tangent, answer: Equilibrium, whole: Whole | None
    ) -> SweepStep:
        """A step with estimates of its values without the error of the mesh, if they are found in little time."""
        if self.friction or self.durations is not None:
            return step
        mesh = whole.image.mesh if whole and at.model is whole.model else self.mesh
        here = settled(at, answer)
        refined = refined_model(self.problem, mesh.at(at.X))
        found = refined and refined.near(here, tangent, answer.state, thorough=8 * at.model.elements <= QUICK)
        if found is None:
            return step
        there, state, _ = found
        moved = extrapolated(
            *(
                measure_features(each.model, each.X, own, shift=np.asarray(at.loads.shift))
                for each, own in ((here, answer.state), (there, state))
            )
        )
        forces = reaction_of(there, exerted_on_blocks(there, state), np.asarray(state.plate))
        return replace(
            step,
            fine_translation=vector(moved.translation),
            fine_rotation=vector(moved.rotation),
            fine_reaction={name: beyond(value, forces[name]) for name, value in step.reaction.items()},
            fine_volumes={name: float(volume) for name, volume in moved.volume.items()},
        )

    def _errors(self, task: str, at: Configuration, answer: Equilibrium | NoEquilibrium) -> dict[str, float]:
        """Distances of an equilibrium from the target of a task, if it has one."""
        objective = self.targets.get(task)
        if objective is None or isinstance(answer, NoEquilibrium):
            return {}
        moved = replace(objective, shift=np.asarray(at.loads.shift)).features(at.model, at.X, answer.state)
        return {name: float(error(moved)) for name, error in objective.errors.items()}


def _sweep_of_part(
    path: list[Configuration], tangent: Tangent, whole: Whole
) -> Iterator[tuple[Configuration, Equilibrium | NoEquilibrium]]:
    """A sweep of a part of a body; from where the whole body loses its stability on, the whole body is swept.

    The part has symmetric motions alone: at every state on the way, the whole body is looked at for all others.
    """
    before: tuple[Configuration, State] | None = None
    for number, (at, answer) in enumerate(zip(path, sweep(path, tangent), strict=True)):
        passed = list(answer.way)
        if isinstance(answer, Equilibrium):
            at = settled(at, answer)
            passed += [(at, answer.state)] if answer.stable else []
        lost = bool(answer.buckled)
        for there, state in passed:
            if before is not None and state is before[1]:
                continue
            if whole.negative_pivots(there, state) > 0:
                lost = True
                break
            before = there, state
        if lost:
            begin = before and (whole.configuration(before[0]), whole.state(before[1]))
            rest = [whole.configuration(each) for each in path[number:]]
            yield from zip(rest, sweep(rest, whole.tangent, begin), strict=True)
            return
        if isinstance(answer, Equilibrium):
            before = at, answer.state
        yield at, answer


def _parts(poses: Poses, part: slice) -> dict[str, Vector]:
    """The displacements or the rotation vectors in poses, of the obstacles that have one."""
    return {name: cast(Vector, pose[part]) for name, pose in poses.items() if any(pose[part])}


def prepare_simulation(
    problem: Problem,
    body: Body,
    pressures: Mapping[str, Mapping[str, float]],
    given: Mapping[str, Any],
    block: Iterable[str] = (),
    one_by_one: bool = False,
    moves: Mapping[str, Any] | None = None,
    friction: float | None = None,
    volumes: Mapping[str, Any] | None = None,
    stiffness: bool = False,
    along: str | None = None,
    rate: Any = None,
    cycles: int | None = None,
    hold: Any = None,
    *,
    stored: Fields | None = None,
) -> Simulation:
    """Mesh a body, or a part of it where symmetry allows that, for sweeps.

    Parameters
    ----------
    problem, body : the body is one of the problem's.
    pressures : {task: {chamber: MPa}}
        Pressures of the chambers that are not in `given`.
    given : {chamber: "60 kPa" or "0:60:5 kPa"}, see `pressure_paths`.
    block : motions of the plate to hold, keys of `BLOCKS` alone or with a value, as "axial=2 mm" or "axial=0:4:1 mm".
    one_by_one : sweep one chamber after another.
    moves : {"plate.z": "-3 mm" or "0:-3:-0.5 mm"}, displacements of obstacles in place of those of the tasks, and
        {"plate.turn_z": "30 deg" or "0:90:5 deg"}, their turns.
    friction : coefficient of friction on obstacles, by default that of the problem.
    volumes : {chamber: "12 ml" or "0:12:1 ml"}, liquid that is filled in, in place of a pressure.
    stiffness : find the stiffness of the tip at every step.
    along : a direction, "x", "-z" or "1,0,1", in which the tip is blocked at every step too, and its force found.
    rate : "2 kPa/s" or a pint quantity, of the first that is swept.
    cycles : how often sweeps go there and back.
    hold : "10 s" or a pint quantity, how long loads stay at the end of a sweep, or at both ends of every cycle.
    stored : fields of the body in a run, where elements of its mesh may have been divided.

    Raises
    ------
    ProblemError
        If a pressure, chamber or motion is not a valid one.
    MeshError
        If the body cannot be meshed.
    """
    chambers, obstacles = ([part.name for part in parts] for parts in (problem.body.chamber, problem.obstacle))
    block = list(block)
    if block and problem.end_effector.kind == "free":
        raise ProblemError('block: a free tip has no plate to hold; set kind = "plate" in [end_effector]')
    one_way = pressure_paths(given, tuple(chambers), one_by_one, moves, obstacles, block, volumes)
    paths, durations = timed_paths(problem, one_way, rate, cycles, hold)
    unknown = {*(volumes or {}), *sealed(problem), *(name for task in problem.task for name in task.volumes)}
    for name in sealed(problem):
        if name in given or name in (volumes or {}):
            raise ProblemError(f'chamber "{name}" is sealed with gas: its pressure follows; leave it out')
    for chamber in problem.body.chamber:
        if chamber.name in (volumes or {}) and getattr(chamber, "seal", None) is not None:
            raise ProblemError(f"volume {chamber.name}: is closed by an obstacle; give a pressure")
    under = [_loads(problem, name, each) for name in pressures for path in paths for each in path.holds]
    nothing = dict.fromkeys(unknown, math.nan)
    applied = [{**own, **each, **nothing} for own in pressures.values() for path in paths for each in path.steps]
    given_friction = 0.0 if problem.contact is None else problem.contact.friction
    coefficient = _friction(problem, given_friction if friction is None else friction)
    if unknown and coefficient:
        raise ProblemError(
            f"friction {coefficient:g}: is not possible with chambers that are sealed or filled to a volume; give "
            "pressures, or no friction"
        )
    stiffness = stiffness or along is not None
    if stiffness and coefficient:
        raise ProblemError("stiffness: is not known with friction, which resists both ways; set the friction to 0")
    towards = None if along is None else direction(along)
    if along is not None and problem.end_effector.kind == "free":
        raise ProblemError('blocked-along: a free tip has no plate to press with; set kind = "plate" in [end_effector]')
    if durations is not None and (coefficient or stiffness):
        key = f"friction {coefficient:g}" if coefficient else "stiffness"
        raise ProblemError(f"{key}: is not possible where rubber relaxes or softens; leave the rate and the cycles out")
    targets = {name: target for name, target in _targets(problem).items() if name in pressures}
    # What a part has been through would have to be carried over where the whole body loses its symmetry.
    part = () if durations is not None else part_of(problem, applied, under)
    mesh = mesh_of(problem, body, part, like=None if stored is None else stored.unfolded(part).mesh).mesh
    model = model_of(problem, mesh)
    return Simulation(problem, mesh, model, pressures, paths, targets, coefficient, stiffness, towards, durations)


def _friction(problem: Problem, coefficient: float) -> float:
    """A coefficient of friction.

    Raises
    ------
    ProblemError
        If it is none, or nothing can be touched.
    """
    if not 0.0 <= coefficient <= MOST_FRICTION:
        raise ProblemError(f"friction {coefficient:g}: is not between 0 and {MOST_FRICTION:g}; use e.g. 0.4")
    if coefficient and not problem.obstacle:
        raise ProblemError(f"friction {coefficient:g}: there is no obstacle; add a table [[obstacle]] to the problem")
    return coefficient


def _targets(problem: Problem) -> dict[str, Objective]:
    """The objectives that have a distance from a target; functions of users are not called."""
    return build_objectives(problem, aimed=True)


def _volumes(
    problem: Problem, task: str, pressures: Mapping[str, float], given: Mapping[str, float]
) -> dict[str, float]:
    """The volumes in mm³ that are filled into chambers: those of a task, but for what is given in their place."""
    own = next(each for each in problem.task if each.name == task).volumes
    return {name: value for name, value in (own | dict(given)).items() if name not in pressures}


def _loads(problem: Problem, task: str, given: Mapping[str, float]) -> Acting:
    """The loads of a task, where more motions of the plate are held than by its own guide, or elsewhere."""
    own = acting(problem, next(each for each in problem.task if each.name == task))
    return replace(own, hold=own.hold.model_copy(update=dict(given)))
