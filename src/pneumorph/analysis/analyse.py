"""Analyse a design: mesh it, find the equilibrium of every task, and evaluate the objective."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.castings import Casting, TaskState, casting_name, solve_castings
from pneumorph.analysis.tolerances import as_cast
from pneumorph.analysis.unfound import explained
from pneumorph.analysis.workspace import axes_of, workspace_size
from pneumorph.doing import doing
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Guess,
    Model,
    NoEquilibrium,
    Skin,
    Softest,
    State,
    Tangent,
    along_path,
    buckling_load,
    configure,
    deformation_gradients,
    diagnose,
    displacement,
    enclosed_of,
    gradients_after,
    guided_of,
    lateral_models,
    loads_of,
    model_of,
    negative_motions,
    part_of,
    predict,
    predict_change,
    rest,
    settled,
    softest_of_kinds,
    solve,
    stable_against_kinds,
    whole_of,
)
from pneumorph.mechanics.solve.balance import unloaded
from pneumorph.mesh import Morph, Unfolded, unfold
from pneumorph.mesh.transfer import at_places, between_points, linear, locate, quadrature_points, transfer
from pneumorph.objective import Objective, build_objectives
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.sensitivity import Margin, objective_value

Starts = Mapping[str, State] | Mapping[str, Guess]

DESIGN_TOLERANCE = 1e-6
"""Relative residual of the equilibria in the design loop: J then has about five correct digits."""

DESIGN_ACCURACY = 1e-6
"""Relative accuracy of its adjoints, and so of the gradient."""


@dataclass(frozen=True, eq=False)
class Discretisation:
    """A mesh that follows the control points, its mechanical model, and a linear solver and an objective for each task.

    `built_at` (n_points, 3) are the control points, in mm, for which it was meshed. `skin` is the surface of the whole
    body, which is the same wherever the nodes are. In parts, `lateral` are the models of lateral motions, each with the
    linear solver that they share. `castings` that are off, by task, are solved beside the design where it is to be
    robust.
    """

    morph: Morph
    built_at: np.ndarray
    model: Model
    tangents: dict[str, Tangent]
    objectives: dict[str, Objective]
    skin: Skin
    lateral: tuple[tuple[Model, Tangent], ...] = ()
    castings: Mapping[str, tuple[Casting, ...]] = field(default_factory=dict)

    @property
    def factorisations(self) -> int:
        """Number of factorisations made so far, for all tasks."""
        others = [tangent for _, tangent in self.lateral[:1]]
        others += [casting.tangent for castings in self.castings.values() for casting in castings]
        return sum(tangent.factorisations for tangent in (*self.tangents.values(), *others))


@dataclass(frozen=True, eq=False)
class Analysis:
    """A design with the equilibria of all its tasks.

    Attributes
    ----------
    phi : (n,) design variables.
    points : (n_points, 3) control points, mm.
    X : (N, 3) mesh nodes, mm.
    pressures : by task and chamber, MPa.
    reinforcements : what is designed of sheets and fibres, by name and key, N/mm and rad.
    configurations, equilibria : by task.
    values : the tasks' objectives.
    value : J, their weighted sum; of tasks with castings the mean of theirs counts.
    self_intersecting : whether the deformed body intersects itself, by task.
    limit_points : the limit points ahead of the states by task, once they have been looked for (`limit_points`).
    castings : the states of perturbed castings, by task.
    nearby : limit points of a design nearby on the same mesh, near which those ahead are looked for (`ballooning.py`).
    """

    phi: np.ndarray
    points: np.ndarray
    X: np.ndarray
    pressures: dict[str, dict[str, float]]
    reinforcements: dict[str, dict[str, float]]
    configurations: dict[str, Configuration]
    equilibria: dict[str, Equilibrium]
    values: dict[str, float]
    value: float
    self_intersecting: dict[str, bool]
    limit_points: dict[str, Margin] = field(default_factory=dict)
    castings: dict[str, tuple[TaskState, ...]] = field(default_factory=dict)
    nearby: dict[str, Margin] = field(default_factory=dict)

    def state(self, disc: Discretisation, task: str) -> TaskState:
        """The state of the design itself in a task."""
        return TaskState(self.configurations[task], disc.tangents[task], self.equilibria[task], self.values[task])

    def states(self, disc: Discretisation, task: str) -> tuple[TaskState, ...]:
        """The states whose mean objective is that of a task: those of its castings, else the design's own."""
        return self.castings.get(task) or (self.state(disc, task),)


@dataclass(frozen=True, kw_only=True)
class SelfIntersecting(NoEquilibrium):
    """There is an equilibrium, the `last`, but the body would intersect itself: in a task, with nodes at X (N, 3)."""

    task: str
    X: np.ndarray


def discretise(problem: Problem, body: Body) -> Discretisation:
    """Mesh a body, or a part of it where symmetry allows that, and build its model for analysis."""
    return build_discretisation(problem, mesh_of(problem, body, part_of(problem)), body.control_points())


@doing("building the model")
def build_discretisation(problem: Problem, morph: Morph, built_at: np.ndarray) -> Discretisation:
    """Build the model of a mesh, which was made for the control points `built_at` (n_points, 3) mm.

    Raises
    ------
    ProblemError
        If there is friction, see `refuse_friction`.
    """
    refuse_friction(problem)
    model = model_of(problem, morph.mesh)
    tangents = {task.name: Tangent(model) for task in problem.task}
    kinds = lateral_models(model, morph.mesh)
    lateral = tuple(zip(kinds, [Tangent(model)] * len(kinds), strict=True)) if kinds else ()
    return Discretisation(morph, built_at, model, tangents, build_objectives(problem), Skin(morph.mesh), lateral)


def refuse_friction(problem: Problem) -> None:
    """Refuse a problem with friction where states are not found step by step along a sweep.

    Raises
    ------
    ProblemError
        If there is friction: a state then depends on the way to it, and has no derivative by the shape alone.
    """
    if problem.contact is not None and problem.contact.friction:
        raise ProblemError("contact.friction: is for simulate alone; leave it out here, and use simulate --friction")


def analyse(
    problem: Problem,
    space: DesignSpace,
    disc: Discretisation,
    phi: np.ndarray,
    starts: Starts | None = None,
    *,
    near: Analysis | None = None,
    apart: Analysis | None = None,
    tolerance: float = DESIGN_TOLERANCE,
    most: float = math.inf,
    roughest: float = math.inf,
    explain: bool = False,
) -> Analysis | NoEquilibrium:
    """Find the equilibrium of every task on the mesh moved to the design, from the given states or from rest.

    Tasks are solved one after another, each with all cores: solving them in parallel threads took 0.9 to 1.3 times as
    long (two cores, two and three tasks).

    Parameters
    ----------
    problem, space : with its tasks and variables.
    disc : a mesh of its body.
    phi : (n,) the design.
    starts : states or guesses by task, from which the searches begin; from rest where there is none.
    near : an analysed design on the same mesh. With contact, where a start leads nowhere, the search goes on in steps
        from there: nodes move to the new design, and what touches stays apart on the way.
    apart : an analysed design. The search ends at a task in which the body intersects itself and does not there.
    tolerance : relative residual of the equilibria.
    most : factorisations after which the search for the state of a task ends.
    roughest : a start with a larger residual is not tried, see `solve`.
    explain : whether the reason for a missing equilibrium includes the limit pressure; the path following that finds it
        takes much longer; and the key at fault with a remedy.

    Raises
    ------
    ComputationError
        If the objective of a task is not a finite number for this design.
    """
    points = space.control_points(phi)
    X, pressures, reinforcement = disc.morph.positions(points), space.pressures(phi), space.reinforcement(phi)
    configurations, equilibria, values, crossing = {}, {}, {}, {}
    touches_itself = disc.model.contact is not None and disc.model.contact.own is not None
    for number, task in enumerate(problem.task):
        under = acting(problem, task)
        loads = loads_of(problem, disc.model, pressures[task.name], task.poses, reinforcement, under)
        at = configure(disc.model, X, loads, guided_of(problem, under), enclosed_of(problem, task.volumes))
        start = starts.get(task.name) if starts else None
        since = None
        if near is not None and disc.model.contact is not None:
            since = near.configurations[task.name], near.equilibria[task.name].state
        with doing(f"task {task.name}"):
            equilibrium = solve(at, disc.tangents[task.name], start, tolerance, since, most, roughest)
            if explain and at.enclosed is None and isinstance(equilibrium, NoEquilibrium):
                equilibrium = diagnose(at, disc.tangents[task.name], equilibrium)
        if isinstance(equilibrium, NoEquilibrium):
            return explained(problem, number, equilibrium) if explain else equilibrium
        at = settled(at, equilibrium)
        configurations[task.name], equilibria[task.name] = at, equilibrium
        pressures[task.name] = {**pressures[task.name], **equilibrium.enclosed}
        solver, objective = disc.tangents[task.name], disc.objectives[task.name]
        values[task.name] = objective_value(at, solver, equilibrium.state, objective)
        if not np.isfinite(values[task.name]):
            raise ComputationError(f"the objective of task {task.name} is {values[task.name]} here; fix its function")
        crossing[task.name] = not touches_itself and disc.skin.intersects_itself(X + equilibrium.u)
        if apart is not None and crossing[task.name] and not apart.self_intersecting[task.name]:
            return SelfIntersecting("the body would self-intersect", 1.0, equilibrium, task=task.name, X=X)
    if spanning := axes_of(disc.objectives):
        values |= dict.fromkeys(spanning, -workspace_size(disc.objectives, configurations, equilibria))
    value = sum(task.weight * values[task.name] for task in problem.task)
    data = space.data(phi)
    found = Analysis(phi, points, X, pressures, data, configurations, equilibria, values, value, crossing)
    return with_castings(problem, disc, found, starts, tolerance=tolerance, most=most) if disc.castings else found


def with_castings(
    problem: Problem,
    disc: Discretisation,
    analysis: Analysis,
    starts: Starts | None = None,
    *,
    tolerance: float = DESIGN_TOLERANCE,
    most: float = math.inf,
) -> Analysis | NoEquilibrium:
    """An analysed design with the states of its perturbed castings, whose mean objective is that of a task.

    Parameters
    ----------
    problem : with its tasks.
    disc : the mesh, with castings.
    analysis : of the design itself; those of its castings and their limit points are found anew.
    starts : states or guesses by task and casting: the search for a casting begins as far from the task's state as its
        start is from the task's start.
    tolerance, most : see `analyse`.
    """
    begins = {name: each.state if isinstance(each, Guess) else each for name, each in (starts or {}).items()}
    castings, value = {}, 0.0
    for task in problem.task:
        at, tangent, equilibrium, known, _ = analysis.state(disc, task.name)
        asked, apart = disc.castings.get(task.name, ()), []
        for number in range(len(asked)):
            start = begins.get(casting_name(task.name, number))
            vector = disc.model.vector
            apart.append(None if start is None else vector(start) - vector(begins[task.name]))
        with doing(f"perturbed castings of task {task.name}"):
            objective = disc.objectives[task.name]
            off = solve_castings(asked, at, tangent, equilibrium.state, objective, apart, tolerance, most)
        if isinstance(off, NoEquilibrium):
            return replace(off, reason=f"a perturbed casting has no state: {off.reason}")
        castings[task.name] = off
        value += task.weight * (sum(each.value for each in off) / len(off) if off else known)
    points = {name: analysis.limit_points[name] for name in analysis.equilibria if name in analysis.limit_points}
    return replace(analysis, castings=castings, value=value, limit_points=points)


@doing("testing whether the states are stable")
def check_stability(disc: Discretisation, analysis: Analysis) -> dict[str, bool]:
    """Whether the state of each task is stable, by a factorisation at that very state (see `Tangent.pivots_at`).

    Of part of a body, against all motions of the whole.
    """
    stable = {}
    for name, equilibrium in analysis.equilibria.items():
        tangent = disc.tangents[name]
        tangent.move_to(analysis.configurations[name], equilibrium.state)
        stable[name] = negative_motions(analysis.configurations[name], tangent, equilibrium.state) == 0
    if not disc.model.part:
        return stable
    if disc.lateral:
        lateral = lateral_stability(disc, analysis)
        return {name: stable[name] and all(lateral[name]) for name in stable}
    whole = whole_of(disc.model, disc.morph.mesh)
    return {
        name: stable[name] and whole.negative_pivots(at, analysis.equilibria[name].state) == 0
        for name, at in analysis.configurations.items()
    }


@doing("looking for lateral buckling")
def lateral_stability(disc: Discretisation, analysis: Analysis) -> dict[str, list[bool]]:
    """Whether every task is stable against each kind of lateral motion; there are none but between mirror planes."""
    return {
        name: stable_against_kinds(at, analysis.equilibria[name].state, disc.lateral)
        for name, at in analysis.configurations.items()
    }


@doing("looking for lateral buckling")
def lateral_stiffness(disc: Discretisation, analysis: Analysis, at_rest: bool = False) -> dict[str, list[Softest]]:
    """The softest lateral motions of every task, one of each kind, at its state or at rest without its loads."""
    motions: dict[str, list[Softest]] = {}
    for name, at in analysis.configurations.items():
        state = rest(at.model) if at_rest else analysis.equilibria[name].state
        motions[name] = softest_of_kinds(unloaded(at) if at_rest else at, state, disc.lateral)
    return motions


def buckling_loads(
    disc: Discretisation, analysis: Analysis, motions: Mapping[str, Sequence[Softest]]
) -> dict[str, float]:
    """The factors of the loads at which the softest lateral motions would buckle, see `mechanics.solve.lateral`.

    1 where a chamber is filled or sealed, for which that is not known.
    """
    return {
        name: buckling_load(at, analysis.equilibria[name].state, disc.tangents[name], motions[name])
        if at.enclosed is None
        else 1.0
        for name, at in analysis.configurations.items()
    }


def predict_states(
    space: DesignSpace,
    disc: Discretisation,
    analysis: Analysis,
    phi: np.ndarray,
    before: tuple[Analysis, float] | None = None,
) -> dict[str, Guess]:
    """Predict the states of all tasks and castings, for a design near an analysed one on the same mesh.

    To first order; those of plain elements to second order, where the states of another design are known.

    Parameters
    ----------
    space : of the designs.
    disc : their mesh, whose nodes inside may have been shifted since.
    analysis : of the design that is known.
    phi : (n,) the other.
    before : an analysed design on the straight way behind, and how far back it is (negative), over the way ahead.

    Returns
    -------
    {name: Guess}
    """
    dX = disc.morph.positions(space.control_points(phi)) - analysis.X
    pressures, reinforcement = space.pressures(phi), space.reinforcement(phi)
    guesses = {}
    for name, at in analysis.configurations.items():
        # Those that are unknown are found from the predicted state.
        own = {**pressures[name], **analysis.equilibria[name].enclosed}
        pressure = np.array([own[chamber] for chamber in disc.model.chambers])
        loads = at.loads._replace(pressure=pressure, reinforcement=reinforcement)
        state = analysis.equilibria[name].state
        further = None
        if before is not None and at.model.plain and at.enclosed is None:
            there = replace(at, X=at.X + dX, loads=loads)
            ahead = predict_change(at, disc.tangents[name], state, there)
            further = along_path(there, state, ahead, [(before[0].equilibria[name].state, before[1])], 1.0)
        guess = predict(at, disc.tangents[name], state, dX, loads) if further is None else Guess(further)
        guesses[name] = guess
        off = zip(disc.castings.get(name, ()), analysis.castings.get(name, ()), strict=True)
        for number, (casting, known) in enumerate(off):
            there = as_cast(replace(at, loads=loads), casting.motion, casting.changes)
            casting.tangent.borrow(disc.tangents[name], known.at)
            guess = predict(known.at, known.tangent, known.equilibrium.state, dX, there.loads)
            guesses[casting_name(name, number)] = guess
    return guesses


@doing("carrying states over to the new mesh")
def carry_over(
    old: Discretisation,
    X_old: np.ndarray,
    states: Mapping[str, State],
    new: Discretisation,
    X_new: np.ndarray,
    ahead: tuple[np.ndarray, Mapping[str, Guess]] | None = None,
) -> dict[str, Guess]:
    """Interpolate states from one mesh, with nodes at X_old (N, 3) mm, to another mesh of the same body, at X_new.

    The cuts of sectors are not in the same places on both, so the state of all sectors is interpolated.

    Parameters
    ----------
    ahead : what is carried over instead: the places (N, 3) of the old nodes in another design, where their mesh may be
        folded, and the states that were predicted there from the given ones.
    """
    model, mesh, carried = new.model, old.morph.mesh.at(X_old), {}
    image = unfold(mesh, keep=new.morph.mesh.mirrors)
    nodes = locate(image.mesh, X_new)
    points = locate(image.mesh, quadrature_points(new.morph.mesh.tets, X_new))
    for name, state in states.items():
        u = image.vectors(displacement(old.model.tip, X_old, state))
        if ahead is None:
            F = deformation_gradients(image.mesh.tets, image.mesh.points, u)
        else:
            there, state = ahead[0], ahead[1][name].state
            before, u = u, image.vectors(displacement(old.model.tip, there, state))
            F = gradients_after(image.mesh.tets, image.mesh.points, before, image.vectors(there - X_old), u - before)
        # The nodes of the tip move with the plate: their rows in the state are unused.
        moved = State(at_places(image.mesh, u, nodes), state.plate, objects=state.objects)
        if model.mixed:
            moved = moved._replace(hydrostatic=_hydrostatic(old.model, image, state, new, X_new))
        carried[name] = Guess(moved, between_points(F, points).reshape(3, 3, 4, -1))
    return carried


def _hydrostatic(old: Model, image: Unfolded, state: State, new: Discretisation, X_new: np.ndarray) -> np.ndarray:
    """π on a new mesh: it jumps between regions, so that of each is carried over within it."""
    pi = np.zeros((len(new.model.rubbers), new.model.nodes))
    values = np.asarray(state.hydrostatic).reshape(len(old.rubbers), -1)[:, old.source[image.source]]
    mesh = image.mesh
    for number, region in enumerate(old.regions):
        own = mesh.regions.get(region, np.arange(len(mesh.tets)))
        within = replace(mesh, tets=mesh.tets[own], regions={})
        nodes = np.unique(new.morph.mesh.tets[new.model.regions[region]])
        pi[number, nodes] = transfer(within, linear(within, values[number])[:, None], X_new[nodes])[:, 0]
    return pi.ravel()
