"""The design loop (the paper's Algorithm 1).

Derivatives, sub-problem, new shape within its limits, equilibrium, trust region, until nothing more can be gained.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.analysis import (
    check_stability,
    checkpoint,
    collect_fields,
    compute_inflation,
    compute_sag,
    design_slopes,
)
from pneumorph.limits.certify import LimitReport
from pneumorph.optimize.buckling import (
    buckles,
    judge_closely,
    lateral_excess,
)
from pneumorph.optimize.events import (
    DesignAccepted,
    DesignRejected,
    Event,
    Finished,
    Started,
)
from pneumorph.optimize.history import Clock, StepRecord, history_entry
from pneumorph.optimize.proxy import Proxy
from pneumorph.optimize.standing import LARGEST, Setting, Standing, first_standing, resumed, standing
from pneumorph.optimize.states import TOLERANCE, StateLimits, linear_states, worst_state
from pneumorph.optimize.step import Step
from pneumorph.optimize.trial import SHORTEST, analyse_trial
from pneumorph.optimize.within import Within
from pneumorph.problem import Problem

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

SMALLEST = 1 / 32
"""Of the trust region, in reference steps."""

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
    setting = Setting(problem)
    clock = Clock()
    now = (yield from first_standing(setting, clock)) if state is None else resumed(setting, state)
    model = now.disc.model
    iterations = problem.optimizer.iterations
    yield Started(now.iteration, iterations, setting.space.n, model.elements, model.element, model.size, model.part)
    if state is None:
        yield _accepted(setting, now, clock, StepRecord(now.disc.factorisations, False))
    reason = "the number of designs that was asked for is reached"
    while now.iteration < iterations:
        if now.optimality <= OPTIMAL and not now.states.broken:
            reason = f"the design is optimal: its limits leave {100 * now.optimality:.1f} % of the objective's gradient"
            break
        if _stalled(now):
            reason = f"{PATIENCE} designs together improved the objective by less than {100 * PROGRESS:g} %"
            break
        following = yield from _next(setting, now)
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


def _next(setting: Setting, now: Standing) -> Generator[Event, None, Standing | str]:
    """The next accepted design, or the reason why there is none."""
    reference = setting.problem.optimizer.step
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
            step, candidate, radius = _proposal(setting, now, proxy, states, radius)
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
            setting.problem,
            setting.space,
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
        worst, name = worst_state(setting.problem, trial.disc, trial.analysis)
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
                now = _closely(setting, now, clock)
            bend = max(bend, now.states.curvature(lateral_excess(now.lateral, trial.lateral), change))
            continue
        before, after = now.analysis.self_intersecting, trial.analysis.self_intersecting
        if any(after[name] and not before[name] for name in after):
            if radius < AFRESH:
                return (
                    f"a step of {radius * reference:.2g} mm would make the body go through itself; with a table "
                    "[contact] its surfaces press on each other instead"
                )
            radius *= SHRINK
            yield DesignRejected(now.iteration + 1, "the body would go through itself", radius * reference)
            continue
        gain = states.worst() - max(worst, 0.0) if mending else trial.before - trial.analysis.value
        ratio = gain / expected
        if ratio < POOR:
            radius *= SHRINK
            reason = f"the gain was {ratio:.2f} of the predicted one"
            yield DesignRejected(now.iteration + 1, reason, radius * reference)
            with clock.phase("gradient"):
                there = design_slopes(setting.problem, setting.space, trial.disc, trial.analysis)
            memory = memory.with_pair(change, there.rest - now.slopes.rest)
            continue
        if ratio < FAIR or kept < LOST:
            radius *= SHRINK
        elif ratio > GOOD and kept > KEPT and filled and not retried:
            radius *= GROW
        if ratio >= FAIR and not retried:
            # Limits do not keep a region small either that analyses once made so.
            radius = max(radius, min(GROW * now.radius, AFRESH))
        following = standing(
            setting,
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
        yield _accepted(setting, following, clock, record)
        return following
    if not gained:
        return "no step within the limits improves the design"
    return "the trust region has shrunk to nothing: no step that was tried improved the design"


def _closely(setting: Setting, now: Standing, clock: Clock) -> Standing:
    """A design with what keeps the next one from buckling to a side."""
    with clock.phase("equilibrium"):
        lateral = judge_closely(now.disc, now.analysis)
    with clock.phase("gradient"):
        states = linear_states(setting.problem, setting.space, now.disc, now.analysis, lateral)
    return replace(now, lateral=lateral, states=states)


def _promise(now: Standing, proxy: Proxy, step: np.ndarray) -> float:
    """The predicted gain of a step: of the objective, or of the limits on states while these are broken."""
    if now.states.broken:
        return now.states.worst() - max(now.states.worst(step), 0.0)
    return -proxy.change(step)[0]


def _proposal(
    setting: Setting, now: Standing, proxy: Proxy, states: StateLimits, radius: float
) -> tuple[Step, Within | LimitReport, float]:
    """The step within the limits that promises most, in trust regions from `radius` down to one that it fills.

    A region is also too large if the promise would end the run.
    """
    reference, phi = setting.problem.optimizer.step, now.analysis.phi
    worthwhile = 0.0 if now.states.broken else PROGRESS / PATIENCE * _scale(now)
    best, most = None, -np.inf
    while True:
        step = now.stepper.step(phi, proxy, radius * reference, states)
        # A longer way back would end in another kind of shape, of which the derivatives know nothing.
        candidate = setting.within(phi + step.change, radius * reference)
        promised = _promise(now, proxy, candidate.phi - phi) if isinstance(candidate, Within) else -np.inf
        if best is None or promised > most:
            best, most = (step, candidate, radius), promised
        fits = step.length >= INSIDE * radius * reference and not -np.inf < promised < worthwhile
        if fits or radius * SHRINK < AFRESH:
            return best
        radius *= SHRINK


def _stalled(now: Standing) -> bool:
    if len(now.values) <= PATIENCE:
        return False
    return now.values[-1 - PATIENCE] - now.values[-1] < PROGRESS * _scale(now)


def _scale(now: Standing) -> float:
    """What progress is measured by: the objective, or a small part of the first one."""
    return max(abs(now.analysis.value), NEGLIGIBLE * abs(now.values[0]) if now.values else 0.0)


def _accepted(setting: Setting, now: Standing, clock: Clock, record: StepRecord) -> DesignAccepted:
    entry = history_entry(now.iteration, now.analysis, now.disc, now.report, now.states, now.optimality, clock, record)
    # The sag under weight alone is shown for the first and the last design.
    sag = compute_sag(setting.problem, now.disc, now.analysis) if now.iteration == 0 else None
    state = {
        "iteration": now.iteration,
        "radius": now.radius,
        "values": np.array(now.values),
        **now.lateral.pack(),
        **now.stepper.pack(),
        **now.memory.pack(),
        **checkpoint.pack(now.analysis, now.disc),
    }
    body, fields = setting.space.body(now.analysis.phi), collect_fields(now.disc, now.analysis, sag)
    return DesignAccepted(now.iteration, entry, body, now.analysis.pressures, fields, state)
