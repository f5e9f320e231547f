"""The design loop (the paper's Algorithm 1).

Gradient, sub-problem, new shape, equilibrium, trust region, until no more is to be gained.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.constraint import LimitReport, limits_of, report
from pneumorph.errors import ComputationError, MeshError
from pneumorph.geometry.body import starting_body
from pneumorph.geometry.design_space import DesignSpace, design_space
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import needs_remesh
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize import checkpoint
from pneumorph.optimize.analysis import (
    Analysis,
    Discretisation,
    analyse,
    carried_over,
    design_gradient,
    discretise,
    predicted,
    stable,
)
from pneumorph.optimize.augmented import AugmentedLagrangian, augmented_lagrangian
from pneumorph.optimize.dfp import FIRST_ITERATIONS, PaperStepper
from pneumorph.optimize.events import DesignAccepted, DesignRejected, Event, Finished, Remeshed, Started
from pneumorph.optimize.history import Clock, history_line
from pneumorph.optimize.smoothing import smoothing
from pneumorph.optimize.step import Step, Stepper
from pneumorph.problem import Problem

GROW, SHRINK = 1.3, 0.5
GOOD, FAIR, POOR = 0.7, 0.4, 0.05
"""Ratios of actual to predicted gain: above the first the trust region grows, below the second it shrinks, below the
third a step is taken back."""

LARGEST, SMALLEST = 2.0, 1 / 32
"""Bounds of the trust region, in reference steps."""

PATIENCE, PROGRESS = 5, 0.005
"""The loop stops when this many designs together improve the objective by less than this fraction of it."""

MOST_RESTORATIONS = 8

BEARABLE = 0.002
"""A mesh whose worst element is better goes on where no new one can be made."""


@dataclass(frozen=True, eq=False)
class _Standing:
    """Where the loop stands after an accepted design; `values` are the objectives so far."""

    iteration: int
    analysis: Analysis
    disc: Discretisation
    stepper: Stepper
    radius: float
    values: tuple[float, ...]


class _Loop:
    """What stays fixed through a run."""

    def __init__(self, problem: Problem):
        body = starting_body(problem.body)
        self.problem = problem
        self.space: DesignSpace = design_space(problem, body)
        reference = problem.optimizer.step
        limits = limits_of(body, problem.limits, reach=2.5 * LARGEST * reference)
        self.augmented: AugmentedLagrangian = augmented_lagrangian(self.space, smoothing(self.space), limits, reference)
        self.stepper: Stepper = self.augmented
        if problem.optimizer.method == "dfp":
            self.stepper = PaperStepper(self.space, limits, reference, FIRST_ITERATIONS, np.zeros(0))

    def report(self, analysis: Analysis) -> LimitReport:
        return report(self.space.body(analysis.phi), self.problem.limits)


def design(problem: Problem, state: dict[str, Any] | None = None) -> Iterator[Event]:
    """Design a body for a problem: yields what happens, every accepted design with all that is known of it.

    Parameters
    ----------
    state : of the last `DesignAccepted`, to go on from there.

    Raises
    ------
    ComputationError
        When the starting design cannot be meshed or has no equilibrium.
    """
    loop = _Loop(problem)
    clock = Clock()
    now = _first(loop, clock) if state is None else _resumed(loop, state)
    model = now.disc.model
    iterations = problem.optimizer.iterations
    yield Started(now.iteration, iterations, loop.space.n, model.elements, model.element, model.size, model.mirror)
    if state is None:
        yield _accepted(loop, now, clock, now.disc.factorisations, False)
    reason = "the number of designs that was asked for is reached"
    while now.iteration < problem.optimizer.iterations:
        following = yield from _next(loop, now)
        if following is None:
            reason = "no step improves the design any more: the trust region has shrunk to nothing"
            break
        now = following
        if _settled(now.values):
            reason = f"{PATIENCE} designs together improved the objective by less than {100 * PROGRESS:g} %"
            break
    now = yield from _restore(loop, now)
    found = loop.report(now.analysis)
    if not found.held():
        reason += "; not every limit is held: " + "; ".join(map(str, found.violated()))
    is_stable = stable(now.disc, now.analysis)
    for name, equilibrium in now.analysis.equilibria.items():
        if equilibrium.stable and not is_stable[name]:
            reason += f"; the state of task {name} is stable only within its mirror plane, the body buckles out of it"
    yield Finished(now.iteration, reason, found.held(), is_stable)


def _first(loop: _Loop, clock: Clock) -> _Standing:
    problem, space = loop.problem, loop.space
    with clock.phase("geometry"):
        disc = discretise(problem, space.body(space.start))
    with clock.phase("equilibrium"):
        analysis = analyse(problem, space, disc, space.start, explain=True)
    if isinstance(analysis, NoEquilibrium):
        raise ComputationError(f"the starting design cannot be analysed: {analysis.reason}")
    return _Standing(0, analysis, disc, loop.stepper, problem.optimizer.step, (analysis.value,))


def _resumed(loop: _Loop, state: dict[str, Any]) -> _Standing:
    disc, analysis = checkpoint.unpack(loop.problem, loop.space, state)
    values = tuple(map(float, state["values"]))
    return _Standing(
        int(state["iteration"]), analysis, disc, loop.stepper.unpack(state), float(state["radius"]), values
    )


def _next(loop: _Loop, now: _Standing) -> Generator[Event, None, _Standing | None]:
    """The next accepted design, or None when the trust region has shrunk to nothing."""
    clock, radius, spent, stepper = Clock(), now.radius, 0, now.stepper
    with clock.phase("gradient"):
        slope = design_gradient(loop.problem, loop.space, now.disc, now.analysis)
    while radius >= SMALLEST * loop.problem.optimizer.step:
        with clock.phase("subproblem"):
            step = stepper.step(now.analysis.phi, slope, radius)
        if not step.gain > 0:
            return None
        trial = yield from _try(loop, now, step.change, clock)
        spent += trial.factorisations
        if trial.analysis is None:
            radius *= SHRINK
            yield DesignRejected(now.iteration + 1, trial.reason, radius)
            continue
        ratio = step.ratio(now.analysis.value, trial.analysis.value)
        if ratio < POOR and not trial.remeshed:
            radius *= SHRINK
            yield DesignRejected(now.iteration + 1, f"the gain was {ratio:.2f} of the predicted one", radius)
            with clock.phase("gradient"):
                there = design_gradient(loop.problem, loop.space, trial.disc, trial.analysis)
            stepper = stepper.taught(step, slope, there)
            continue
        if ratio > GOOD:
            radius *= GROW
        elif ratio < FAIR:
            radius *= SHRINK
        radius = min(radius, LARGEST * loop.problem.optimizer.step)
        values = (*now.values, trial.analysis.value)
        following = _Standing(now.iteration + 1, trial.analysis, trial.disc, stepper.after(step), radius, values)
        yield _accepted(loop, following, clock, spent, trial.remeshed, step, ratio)
        return following
    return None


@dataclass(frozen=True, eq=False)
class _Trial:
    """A tried design; without an analysis, the reason why there is none."""

    disc: Discretisation
    analysis: Analysis | None
    reason: str
    remeshed: bool
    factorisations: int


def _try(loop: _Loop, now: _Standing, change: np.ndarray, clock: Clock) -> Generator[Event, None, _Trial]:
    """Analyse the design after a step, on a new mesh if the old one has become poor."""
    problem, space, disc = loop.problem, loop.space, now.disc
    phi, before = now.analysis.phi + change, now.disc.factorisations
    points = space.control_points(phi)
    with clock.phase("equilibrium"):
        starts = predicted(space, disc, now.analysis, phi)
    with clock.phase("geometry"):
        poor = needs_remesh(disc.morph, points)
        if poor is not None:
            try:
                new = discretise(problem, space.body(phi))
            except MeshError as error:
                if _quality(disc, points) < BEARABLE:
                    return _Trial(disc, None, str(error), True, 0)
                poor = None
            else:
                starts = carried_over(disc, disc.morph.positions(points), starts, new)
                disc, before = new, 0
    if poor is not None:
        yield Remeshed(now.iteration + 1, poor, disc.model.elements, _quality(disc, points))
    with clock.phase("equilibrium"):
        analysis = analyse(problem, space, disc, phi, starts)
    spent = disc.factorisations - before
    if isinstance(analysis, NoEquilibrium):
        return _Trial(disc, None, analysis.reason, poor is not None, spent)
    return _Trial(disc, analysis, "", poor is not None, spent)


def _quality(disc: Discretisation, points: np.ndarray) -> float:
    """Of the worst element, where the mesh follows the control points."""
    return float(scaled_jacobian(disc.morph.positions(points), disc.morph.mesh.tets).min())


def _restore(loop: _Loop, now: _Standing) -> Generator[Event, None, _Standing]:
    """Bring a last design that breaks a limit back within all of them.

    What the finer report still finds broken gets a wider margin in the next attempt.
    """
    wider: dict[str, float] = {}
    for attempt in range(MOST_RESTORATIONS):
        found = loop.report(now.analysis)
        if found.held():
            break
        if attempt:
            for reading in found.violated():
                wider[reading.limit] = wider.get(reading.limit, 0.0) + reading.excess()
        clock = Clock()
        with clock.phase("subproblem"):
            step = loop.augmented.restoring(now.analysis.phi, loop.problem.optimizer.step, wider)
        if not np.any(np.abs(step.change) > 1e-6):
            continue
        trial = yield from _try(loop, now, step.change, clock)
        if trial.analysis is None:
            yield DesignRejected(now.iteration + 1, trial.reason, 0.0)
            break
        values = (*now.values, trial.analysis.value)
        now = _Standing(now.iteration + 1, trial.analysis, trial.disc, now.stepper, now.radius, values)
        yield _accepted(loop, now, clock, trial.factorisations, trial.remeshed, step)
    return now


def _settled(values: tuple[float, ...]) -> bool:
    if len(values) <= PATIENCE:
        return False
    return values[-1 - PATIENCE] - values[-1] < PROGRESS * abs(values[-1])


def _accepted(
    loop: _Loop,
    now: _Standing,
    clock: Clock,
    factorisations: int,
    remeshed: bool,
    step: Step | None = None,
    ratio: float | None = None,
) -> DesignAccepted:
    limits = loop.report(now.analysis)
    line = history_line(
        loop.problem, now.iteration, now.analysis, now.disc, limits, clock, factorisations, remeshed, step, ratio
    )
    state = {
        "iteration": now.iteration,
        "radius": now.radius,
        "values": np.array(now.values),
        **now.stepper.pack(),
        **checkpoint.pack(now.analysis, now.disc),
    }
    return DesignAccepted(now.iteration, line, loop.space.body(now.analysis.phi), now.analysis.pressures, state)
