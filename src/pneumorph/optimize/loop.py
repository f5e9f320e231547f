"""The design loop (the paper's Algorithm 1).

Derivatives, sub-problem, new shape within its limits, equilibrium, trust region, until nothing more can be gained.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    Slopes,
    analyse,
    check_stability,
    checkpoint,
    collect_fields,
    compute_inflation,
    compute_sag,
    design_slopes,
    discretise,
)
from pneumorph.constraint import LimitReport, build_limit_functions, certify
from pneumorph.constraint.sampled import LimitSamples, sample_limits
from pneumorph.errors import ComputationError
from pneumorph.geometry.body import starting_body
from pneumorph.geometry.design_space import DesignSpace, build_design_space
from pneumorph.mechanics import NoEquilibrium
from pneumorph.optimize.buckling import (
    LateralStability,
    Stiffnesses,
    buckles,
    judge,
    judge_closely,
    lateral_excess,
    unpack_at_rest,
)
from pneumorph.optimize.curvature import Curvature, no_curvature, unpack_curvature
from pneumorph.optimize.dfp import FIRST_ITERATIONS, PaperStepper
from pneumorph.optimize.events import (
    BroughtWithin,
    DesignAccepted,
    DesignRejected,
    Event,
    Finished,
    Started,
)
from pneumorph.optimize.history import Clock, StepRecord, history_entry
from pneumorph.optimize.optimality import optimality
from pneumorph.optimize.proxy import Proxy
from pneumorph.optimize.smoothing import Smoothing, build_smoothing
from pneumorph.optimize.states import TOLERANCE, StateLimits, linear_states, worst_state
from pneumorph.optimize.step import Step, Stepper
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.trial import SHORTEST, analyse_trial
from pneumorph.optimize.within import Within, within
from pneumorph.problem import ContactArea, Press, Problem, TargetPose
from pneumorph.problem.symmetry import operations

GROW, SHRINK = 2.0, 0.5
GOOD, FAIR, POOR = 0.7, 0.4, 0.05
"""Ratios of actual to predicted gain: above the first the trust region grows, below the second it shrinks, below the
third a step is taken back. A region in which a step was just taken back does not grow before the next design: there it
would be too large again, and where no equilibrium is found a trial costs as much as several designs."""

KEPT, LOST = 0.5, 0.25
"""Shares of a step's promised gain that are left when it has been brought within the limits: the trust region grows
only above the first, and below the second it shrinks, for the limits are then too far from linear."""

INSIDE = 0.3
"""Of the trust region: where a step is shorter than this, the linearised limits end it. In a smaller region they are
closer to the true ones, and the step may be thirty times longer."""

LARGEST, SMALLEST = 3.0, 1 / 32
"""Bounds of the trust region, in reference steps."""

AFRESH = 0.5
"""Smallest trust region, in reference steps, that limits which could not be kept leave for the next design: there they
may not matter. What the analysis of a trial design has made smaller grows back to this from design to design, for the
next is mostly like it."""

OPTIMAL = 0.02
"""The loop stops when the limits leave no more than this fraction of the gradient."""

PATIENCE, PROGRESS = 5, 0.005
"""The loop also stops when this many designs together improve the objective by less than this fraction, or when the
next one promises less than its share of that."""

NEGLIGIBLE = 1e-3
"""Of the first objective: below that the fraction is one of this. A target that is met has nothing left to improve."""


@dataclass(frozen=True, eq=False)
class _Standing:
    """State of the loop after an accepted design.

    `values` are the objectives so far, of designs whose states keep their limits; `bend` is the curvature of the limits
    on states along the last step, 1/mm².
    """

    iteration: int
    analysis: Analysis
    slopes: Slopes
    states: StateLimits
    lateral: LateralStability
    optimality: float
    report: LimitReport
    disc: Discretisation
    stepper: Stepper
    memory: Curvature
    radius: float
    values: tuple[float, ...]
    bend: float


class _Loop:
    """What stays the same during a run."""

    def __init__(self, problem: Problem):
        body = starting_body(problem.body)
        self.problem = problem
        self.space: DesignSpace = build_design_space(problem, body)
        self.smooth: Smoothing = build_smoothing(self.space)
        self.limits: LimitSamples = sample_limits(body, problem.limits, operations(problem.body.symmetry))
        self.stepper: Stepper = build_sequential_quadratic(self.space, self.smooth, self.limits)
        if problem.optimizer.method == "dfp":
            reference = problem.optimizer.step
            all_samples = build_limit_functions(body, problem.limits, reach=2.5 * LARGEST * reference)
            self.stepper = PaperStepper(self.space, all_samples, reference, FIRST_ITERATIONS, np.zeros(0))

    def within(self, phi: np.ndarray, reach: float = np.inf) -> Within | LimitReport:
        # Steps are smooth, so bounds of the shape may be passed by them.
        return within(self.space, self.smooth, self.limits, np.clip(phi, self.space.lower, self.space.upper), reach)

    def optimality(self, phi: np.ndarray, slope: np.ndarray, states: StateLimits) -> float:
        return optimality(self.space, self.smooth, self.limits, phi, slope, states)


def design(problem: Problem, state: dict[str, Any] | None = None) -> Iterator[Event]:
    """Design a body for a problem; yields events, among them every accepted design.

    Every accepted design keeps every limit and is better than the one before. Only where the state of the start breaks
    a limit, which no motion of surfaces alone can mend, designs first come nearer to it, each than the one before.

    Parameters
    ----------
    state : of a `DesignAccepted`, to resume from there.

    Raises
    ------
    ComputationError
        When the starting design cannot be brought within its limits, cannot be meshed or has no equilibrium.
    """
    loop = _Loop(problem)
    clock = Clock()
    now = (yield from _first(loop, clock)) if state is None else _resumed(loop, state)
    model = now.disc.model
    iterations = problem.optimizer.iterations
    yield Started(now.iteration, iterations, loop.space.n, model.elements, model.element, model.size, model.part)
    if state is None:
        yield _accepted(loop, now, clock, StepRecord(now.disc.factorisations, False))
    reason = "the number of designs that was asked for is reached"
    while now.iteration < iterations:
        if now.optimality <= OPTIMAL and not now.states.broken:
            reason = f"the design is optimal: its limits leave {100 * now.optimality:.1f} % of the objective's gradient"
            break
        if _stalled(now):
            reason = f"{PATIENCE} designs together improved the objective by less than {100 * PROGRESS:g} %"
            break
        following = yield from _next(loop, now)
        if isinstance(following, str):
            reason = following
            break
        now = following
    if now.optimality > OPTIMAL:
        reason += f"; the limits leave {100 * now.optimality:.0f} % of the objective's gradient"
    if now.states.broken:
        worst = int(now.states.value.argmax())
        reason += f"; it is {100 * now.states.worst():.1f} % beyond limits.{now.states.limits[worst].name}"
    is_stable = check_stability(now.disc, now.analysis)
    for name, equilibrium in now.analysis.equilibria.items():
        if equilibrium.stable and not is_stable[name]:
            reason += f"; the state of task {name} is stable only against symmetric motions: the body buckles to a side"
    # For the report: how the last design sags and inflates.
    sag, inflation = compute_sag(problem, now.disc, now.analysis), compute_inflation(now.disc, now.analysis)
    fields = collect_fields(now.disc, now.analysis, sag, inflation)
    yield Finished(now.iteration, reason, now.report.satisfied() and not now.states.broken, is_stable, fields)


def _first(loop: _Loop, clock: Clock) -> Generator[Event, None, _Standing]:
    problem, space = loop.problem, loop.space
    with clock.phase("geometry"):
        start, moved = _start(loop)
        if moved is not None:
            yield moved
        disc = discretise(problem, space.body(start.phi))
    with clock.phase("equilibrium"):
        analysis = analyse(problem, space, disc, start.phi, explain=True)
    if isinstance(analysis, NoEquilibrium):
        raise ComputationError(f"the starting design cannot be analysed: {analysis.reason}")
    _touches(problem, disc, analysis)
    return _standing(loop, 0, analysis, disc, start.report, clock, loop.stepper, no_curvature(space.n), 1.0, ())


def _touches(problem: Problem, disc: Discretisation, analysis: Analysis) -> None:
    """Refuse a start that does not touch what it is to press on or to move: nothing would say which way to go."""
    for task in problem.task:
        if not isinstance(task.objective, Press | ContactArea | TargetPose):
            continue
        state, name = analysis.equilibria[task.name].state, task.objective.obstacle
        if float(disc.objectives[task.name].features(disc.model, analysis.X, state).contact[name].normal) == 0.0:
            raise ComputationError(
                f'task {task.name}: the start does not touch obstacle "{name}"; put that nearer or raise the pressure'
            )


def _start(loop: _Loop) -> tuple[Within, BroughtWithin | None]:
    """The starting design, moved to keep the limits if it breaks any."""
    asked = loop.space.start
    before = certify(loop.space.body(asked), loop.problem.limits, own=loop.limits.own_spans)
    if before.satisfied():
        return Within(asked, before), None
    start = loop.within(asked)
    if not isinstance(start, Within):
        broken = "; ".join(map(str, start.violated()))
        raise ComputationError(
            f"the start breaks limits that no design near it keeps together: {broken}; widen one of them, or change "
            "the body"
        )
    moved = float(np.abs(start.phi - asked).max())
    return start, BroughtWithin(tuple(map(str, before.violated())), moved)


def _resumed(loop: _Loop, state: dict[str, Any]) -> _Standing:
    disc, analysis = checkpoint.unpack(loop.problem, loop.space, state)
    values = tuple(map(float, state["values"]))
    return _standing(
        loop,
        int(state["iteration"]),
        analysis,
        disc,
        certify(loop.space.body(analysis.phi), loop.problem.limits, own=loop.limits.own_spans),
        Clock(),
        loop.stepper.unpack(state),
        unpack_curvature(state) if "curvature_phi" in state else no_curvature(loop.space.n),
        float(state["radius"]),
        values[:-1],
        at_rest=unpack_at_rest(disc, state),
    )


def _standing(
    loop: _Loop,
    iteration: int,
    analysis: Analysis,
    disc: Discretisation,
    kept: LimitReport,
    clock: Clock,
    stepper: Stepper,
    memory: Curvature,
    radius: float,
    values: tuple[float, ...],
    bend: float = 0.0,
    lateral: LateralStability | None = None,
    at_rest: Stiffnesses = MappingProxyType({}),
) -> _Standing:
    """Evaluate the derivatives of an accepted design."""
    with clock.phase("equilibrium"):
        lateral = lateral or judge(disc, analysis, at_rest)
    with clock.phase("gradient"):
        slopes = design_slopes(loop.problem, loop.space, disc, analysis)
        states = linear_states(loop.problem, loop.space, disc, analysis, lateral)
    with clock.phase("subproblem"):
        left = loop.optimality(analysis.phi, slopes.total, states)
    # Designs are compared by their objective from the first one on that keeps the limits on states.
    values = () if states.broken else (*values, analysis.value)
    return _Standing(
        iteration, analysis, slopes, states, lateral, left, kept, disc, stepper, memory, radius, values, bend
    )


def _next(loop: _Loop, now: _Standing) -> Generator[Event, None, _Standing | str]:
    """The next accepted design, or the reason why there is none."""
    reference = loop.problem.optimizer.step
    clock, radius, spent = Clock(), now.radius, 0
    longest = LARGEST
    memory = now.memory.seen(now.analysis.phi, now.slopes.rest)
    mending, bend = now.states.broken, now.bend
    gained = False
    while radius >= SMALLEST:
        states = now.states.bent(bend, radius * reference)
        proxy = Proxy(now.slopes.total, np.concatenate([now.slopes.factors, memory.factors()]))
        asked = radius
        with clock.phase("subproblem"):
            step, candidate, radius = _proposal(loop, now, proxy, states, radius)
        if not isinstance(candidate, Within):
            longest = radius = SHRINK * radius
            broken = "; ".join(map(str, candidate.violated()))
            yield DesignRejected(now.iteration + 1, f"limits could not be kept: {broken}", radius * reference)
            continue
        change = candidate.phi - now.analysis.phi
        expected = _promise(now, proxy, change)
        if not expected > 0:
            longest = radius = SHRINK * radius
            continue
        share = expected / max(_scale(now), 1e-300)
        if radius >= AFRESH and share < PROGRESS / PATIENCE and not mending:
            if asked == radius < longest:
                # The objective may be far from where it changes much: a longer step may promise enough.
                radius = min(GROW * radius, longest)
                continue
            if abs(now.analysis.value) < _scale(now):
                return f"the objective has fallen to {now.analysis.value / now.values[0]:.1g} of what it was at first"
            return f"a step of {radius * reference:.2g} mm promises no more than {100 * share:.1g} % of the objective"
        kept = expected / max(_promise(now, proxy, step.change), expected)
        filled = step.length >= 2.0 * INSIDE * radius * reference
        retried, gained, longest = gained, True, 0.0
        trial = yield from analyse_trial(
            loop.problem,
            loop.space,
            now.iteration + 1,
            now.disc,
            now.analysis,
            candidate.phi,
            clock,
            now.lateral.at_rest,
        )
        spent += trial.factorisations
        if trial.analysis is None or trial.lateral is None:
            # Where not even the first part of the step had a state, a step as short as that would not have one either.
            radius *= min(SHRINK, trial.reached or SHRINK * SHORTEST)
            yield DesignRejected(now.iteration + 1, trial.reason, radius * reference)
            continue
        worst, name = worst_state(loop.problem, trial.disc, trial.analysis)
        if worst > TOLERANCE and not mending:
            radius *= SHRINK
            reason = f"it would be {100 * worst:.1f} % beyond limits.{name}"
            yield DesignRejected(now.iteration + 1, reason, radius * reference)
            bend = now.states.curvature(worst, change)
            continue
        if buckles(now.lateral, trial.lateral):
            radius *= SHRINK
            yield DesignRejected(now.iteration + 1, "it would buckle to a side", radius * reference)
            if not now.lateral.at_rest:
                now = _closely(loop, now, clock)
            bend = max(bend, now.states.curvature(lateral_excess(now.lateral, trial.lateral), change))
            continue
        gain = states.worst() - max(worst, 0.0) if mending else trial.before - trial.analysis.value
        ratio = gain / expected
        if ratio < POOR:
            radius *= SHRINK
            reason = f"the gain was {ratio:.2f} of the predicted one"
            yield DesignRejected(now.iteration + 1, reason, radius * reference)
            with clock.phase("gradient"):
                there = design_slopes(loop.problem, loop.space, trial.disc, trial.analysis)
            memory = memory.with_pair(change, there.rest - now.slopes.rest)
            continue
        if ratio < FAIR or kept < LOST:
            radius *= SHRINK
        elif ratio > GOOD and kept > KEPT and filled and not retried:
            radius *= GROW
        if ratio >= FAIR and not retried:
            # Limits do not keep a region small either that analyses once made so.
            radius = max(radius, min(GROW * now.radius, AFRESH))
        following = _standing(
            loop,
            now.iteration + 1,
            trial.analysis,
            trial.disc,
            candidate.report,
            clock,
            now.stepper.after(step),
            memory,
            min(max(radius, SMALLEST), LARGEST),
            now.values,
            now.states.curvature(worst, change),
            trial.lateral,
        )
        record = StepRecord(spent, trial.remeshed, float(np.abs(change).max()), ratio, step.evaluations)
        yield _accepted(loop, following, clock, record)
        return following
    if not gained:
        return "no step within the limits improves the design"
    return "the trust region has shrunk to nothing: no step that was tried improved the design"


def _closely(loop: _Loop, now: _Standing, clock: Clock) -> _Standing:
    """A design with what keeps the next one from buckling to a side."""
    with clock.phase("equilibrium"):
        lateral = judge_closely(now.disc, now.analysis)
    with clock.phase("gradient"):
        states = linear_states(loop.problem, loop.space, now.disc, now.analysis, lateral)
    return replace(now, lateral=lateral, states=states)


def _promise(now: _Standing, proxy: Proxy, step: np.ndarray) -> float:
    """The predicted gain of a step: of the objective, or of the limits on states while these are broken."""
    if now.states.broken:
        return now.states.worst() - max(now.states.worst(step), 0.0)
    return -proxy.change(step)[0]


def _proposal(
    loop: _Loop, now: _Standing, proxy: Proxy, states: StateLimits, radius: float
) -> tuple[Step, Within | LimitReport, float]:
    """The step within the limits that promises most, in trust regions from `radius` down to one that it fills.

    A region is also too large if the promise would end the run.
    """
    reference, phi = loop.problem.optimizer.step, now.analysis.phi
    worthwhile = 0.0 if now.states.broken else PROGRESS / PATIENCE * _scale(now)
    best, most = None, -np.inf
    while True:
        step = now.stepper.step(phi, proxy, radius * reference, states)
        # A longer way back would end in another kind of shape, of which the derivatives know nothing.
        candidate = loop.within(phi + step.change, radius * reference)
        promised = _promise(now, proxy, candidate.phi - phi) if isinstance(candidate, Within) else -np.inf
        if best is None or promised > most:
            best, most = (step, candidate, radius), promised
        fits = step.length >= INSIDE * radius * reference and not -np.inf < promised < worthwhile
        if fits or radius * SHRINK < AFRESH:
            return best
        radius *= SHRINK


def _stalled(now: _Standing) -> bool:
    if len(now.values) <= PATIENCE:
        return False
    return now.values[-1 - PATIENCE] - now.values[-1] < PROGRESS * _scale(now)


def _scale(now: _Standing) -> float:
    """What progress is measured by: the objective, or a small part of the first one."""
    return max(abs(now.analysis.value), NEGLIGIBLE * abs(now.values[0]) if now.values else 0.0)


def _accepted(loop: _Loop, now: _Standing, clock: Clock, record: StepRecord) -> DesignAccepted:
    entry = history_entry(now.iteration, now.analysis, now.disc, now.report, now.states, now.optimality, clock, record)
    # The sag under weight alone is shown for the first and the last design.
    sag = compute_sag(loop.problem, now.disc, now.analysis) if now.iteration == 0 else None
    state = {
        "iteration": now.iteration,
        "radius": now.radius,
        "values": np.array(now.values),
        **now.lateral.pack(),
        **now.stepper.pack(),
        **now.memory.pack(),
        **checkpoint.pack(now.analysis, now.disc),
    }
    body, fields = loop.space.body(now.analysis.phi), collect_fields(now.disc, now.analysis, sag)
    return DesignAccepted(now.iteration, entry, body, now.analysis.pressures, fields, state)
