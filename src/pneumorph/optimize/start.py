"""How a run begins: from the starting design, a design of another run, or its own checkpoint."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, analyse, analyse_start, checkpoint
from pneumorph.doing import doing
from pneumorph.errors import Hopeless, MeshError
from pneumorph.limits.report import LimitReading, LimitReport
from pneumorph.limits.table import BY_NAME
from pneumorph.mechanics import NoEquilibrium
from pneumorph.optimize.buckling import judge, recall
from pneumorph.optimize.castings import begun_robust, carried
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import BegunBeyond, BegunLower, BroughtWithin, Event
from pneumorph.optimize.finer import with_finer_mesh
from pneumorph.optimize.iterate import AnalysedDesign, Iterate, Learnt, evaluate, unpack_learnt, with_errors
from pneumorph.optimize.model import no_curvature
from pneumorph.optimize.prospects import shortfalls, words
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.way import Place, states_on
from pneumorph.optimize.within import Within
from pneumorph.problem import Limits, Problem
from pneumorph.problem.designed import starting_at

LOWER = (0.75, 0.5, 0.25, 0.0)
"""Shares of the designed pressures above their lower bounds with which a start begins that has no state at them."""


AT_BOUND = 0.01
"""A limit that is satisfied by less than this part of its bound is in the way."""


def start(setup: Setup, clock: Clock) -> Generator[Event, None, Iterate]:
    """The starting design, brought within its limits, with its derivatives.

    Raises
    ------
    Hopeless
        If no design near it satisfies the limits, its states are too far beyond theirs, it cannot be meshed, it has no
        equilibrium, or it does not touch what it is to press on.
    """
    problem = setup.problem
    with clock.phase("geometry"):
        feasible, moved = begin_within(setup)
        if moved is not None:
            yield moved
        disc = _meshed(setup, feasible.phi)
    analysis = yield from _solved(setup, disc, feasible.phi, clock)
    _require_contact(problem, disc, analysis)
    with clock.phase("equilibrium"):
        disc, analysis = begun_robust(setup, disc, analysis)
        lateral = judge(disc, analysis, {})
    return (yield from _begun(setup, AnalysedDesign(analysis, disc, feasible.report, lateral), clock))


def _meshed(setup: Setup, phi: np.ndarray) -> Discretisation:
    try:
        return setup.discretise(setup.space.body(phi), 0.0)
    except MeshError as error:
        raise Hopeless(str(error)) from None


def _solved(setup: Setup, disc: Discretisation, phi: np.ndarray, clock: Clock) -> Generator[Event, None, Analysis]:
    """The states of a start Φ (n,) on its mesh, at lower pressures where it has none."""
    with clock.phase("equilibrium"):
        try:
            return analyse_start(setup.problem, setup.space, disc, phi)
        except Hopeless:
            lower = _at_lower_pressures(setup, disc, phi)
            if lower is None:
                raise
    yield BegunLower(lower.pressures)
    return lower


@doing("restoring the design to begin with")
def begun_from(setup: Setup, state: Mapping[str, Any], clock: Clock) -> Generator[Event, None, Iterate]:
    """The design of another run of the same body, as the start of this one: of steps before it nothing is known.

    Raises
    ------
    ProblemError
        If the checkpoint does not fit the problem, or its equilibria are not found again.
    """
    with clock.phase("equilibrium"):
        design = restored(setup, state)
    if state.get("on_new_mesh"):
        design = yield from _restored_on_new_mesh(setup, design, clock)
    _require_contact(setup.problem, design.disc, design.analysis)
    return (yield from _begun(setup, design, clock))


def on_new_mesh(
    setup: Setup, design: AnalysedDesign, most: int, clock: Clock
) -> tuple[Discretisation, Analysis | NoEquilibrium]:
    """A design analysed on another mesh of the size that is asked for, by the states that it has.

    Parameters
    ----------
    setup, design : of the run, and the design on the mesh that it has.
    most : factorisations for a task.
    clock : counts the time.

    Raises
    ------
    Hopeless
        If it cannot be meshed.
    """
    phi = design.analysis.phi
    with clock.phase("geometry"):
        disc = _meshed(setup, phi)
        disc = carried(disc, disc.morph.positions(design.analysis.points), design.disc.castings)
    with clock.phase("equilibrium"):
        starts = states_on(Place(design.disc, design.analysis), disc)
        return disc, analyse(setup.problem, setup.space, disc, phi, starts, most=most)


def _restored_on_new_mesh(setup: Setup, design: AnalysedDesign, clock: Clock) -> Generator[Event, None, AnalysedDesign]:
    """A design on a mesh of the size that is asked for, where it was restored on another one."""
    phi = design.analysis.phi
    disc, analysis = on_new_mesh(setup, design, setup.settings.trial.most_on_new_mesh, clock)
    if not isinstance(analysis, Analysis):
        analysis = yield from _solved(setup, disc, phi, clock)
    with clock.phase("equilibrium"):
        return replace(design, analysis=analysis, disc=disc, lateral=judge(disc, analysis, {}))


def _begun(setup: Setup, design: AnalysedDesign, clock: Clock) -> Generator[Event, None, Iterate]:
    """The first iterate, on a mesh as fine as is asked for, with a word on states that are beyond their limits."""
    learnt = Learnt(setup.stepper, no_curvature(setup.space.n), 1.0, ())
    begun = with_errors(setup, evaluate(setup, 0, design, learnt, clock))
    begun = yield from with_finer_mesh(setup, begun, clock)
    if found := shortfalls(setup, begun.disc, begun.analysis, begun.states):
        yield BegunBeyond(tuple(words(setup, each) for each in found))
    return begun


def begun_lower(setup: Setup) -> Problem | None:
    """A problem whose start has no state at its pressures, at the lower ones with which a run begins; None without."""
    phi = setup.space.start
    lower = _at_lower_pressures(setup, _meshed(setup, phi), phi)
    return None if lower is None else starting_at(setup.problem, lower.pressures)


def _at_lower_pressures(setup: Setup, disc: Discretisation, phi: np.ndarray) -> Analysis | None:
    """The design Φ (n,) at the highest of some lower pressures at which it has a state, of those that are designed."""
    space = setup.space
    own = slice(space.n_shape, space.n_shape + len(space.free_pressures))
    least = np.minimum(np.maximum(space.lower[own], 0.0), phi[own])
    for share in LOWER if np.any(phi[own] > least) else ():
        lowered = phi.copy()
        lowered[own] = least + share * (phi[own] - least)
        analysis = analyse(setup.problem, space, disc, lowered, most=setup.settings.trial.most_in_contact)
        if isinstance(analysis, Analysis):
            return analysis
    return None


def _require_contact(problem: Problem, disc: Discretisation, analysis: Analysis) -> None:
    """Refuse a start that does not touch what it is to press on or to move: nothing would say which way to go."""
    for task in problem.task:
        if (name := task.objective.touched) is None:
            continue
        state = analysis.equilibria[task.name].state
        if float(disc.objectives[task.name].features(disc.model, analysis.X, state).contact[name].normal) == 0.0:
            raise Hopeless(
                f'task {task.name}: the start does not touch obstacle "{name}"; move it nearer or raise the pressure'
            )


@doing("bringing the start within its limits")
def begin_within(setup: Setup) -> tuple[Within, BroughtWithin | None]:
    """The starting design, moved to satisfy the limits if it violates any.

    Raises
    ------
    Hopeless
        If no design near it satisfies them.
    """
    asked = setup.space.start
    before = setup.certify(asked)
    if before.satisfied():
        return Within(asked, before), None
    feasible = setup.within(asked)
    if not isinstance(feasible, Within):
        raise Hopeless(_conflict(feasible))
    moved = float(np.abs(feasible.phi - asked).max())
    return feasible, BroughtWithin(tuple(map(str, before.violated())), moved)


def _conflict(report: LimitReport) -> str:
    """Which limits the nearest design that was found violates, by how much, and which ones are in the way."""
    violated = report.violated()
    beyond = "; ".join(f"{_key(each)} by {_percent(each)}, {each}" for each in violated)
    keys = {_key(each) for each in violated}
    near = dict.fromkeys(_key(each) for each in report.readings if each.excess() > -AT_BOUND)
    stopped = [key for key in near if key not in keys]
    also = f"; at the bound of {' and '.join(stopped)}, which stops it" if stopped else ""
    return (
        "no design near the start satisfies its limits together; the nearest that was found violates "
        f"{beyond}{also}; relax one of them, or begin with a body that is nearer to them"
    )


def _key(reading: LimitReading) -> str:
    """The key of a limit, or its word where it follows from others."""
    word = BY_NAME[reading.limit].word
    return f"limits.{word}" if word in Limits.model_fields else word


def _percent(reading: LimitReading) -> str:
    """How far a limit is violated."""
    return f"{100 * reading.excess():.2g} %" if reading.bound else f"{reading.excess():.2g} mm"


@doing("restoring the last design")
def resumed(setup: Setup, state: Mapping[str, Any]) -> Iterate:
    """The iterate whose checkpoint was stored when it was accepted.

    Raises
    ------
    ProblemError
        If the checkpoint does not fit the problem, or its equilibria are not found again.
    """
    design = restored(setup, state)
    return evaluate(setup, int(state["iteration"]), design, unpack_learnt(setup, state), Clock())


def restored(setup: Setup, state: Mapping[str, Any]) -> AnalysedDesign:
    """The design of a checkpoint with its states; see `resumed`."""
    disc, analysis = checkpoint.unpack(setup.problem, setup.space, dict(state), setup.mesher.heights)
    return AnalysedDesign(analysis, disc, setup.certify(analysis.phi), recall(disc, analysis, state))
