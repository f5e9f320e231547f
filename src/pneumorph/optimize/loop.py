"""The design loop (the paper's Algorithm 1), as a feasible trust-region method.

Derivatives; the best step in the trust region within the linearised limits; the step brought within the true limits;
equilibria of the new design; acceptance by actual and predicted gain; a new region; until nothing more can be gained.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.analysis import (
    check_stability,
    collect_fields,
    compute_inflation,
    motion_rates,
    near_margins,
    quick_errors,
    thickenings,
)
from pneumorph.doing import doing
from pneumorph.errors import Hopeless
from pneumorph.limits.kinds.states import MARGIN
from pneumorph.optimize.acceptance import (
    PROPOSAL_TESTS,
    Attempt,
    Ended,
    Tried,
    Verdict,
    first_objection,
    judged,
    judged_on_larger_elements,
)
from pneumorph.optimize.castings import renewed
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.coarse import coarse_setup, has_served, refined, serves
from pneumorph.optimize.correction import corrected
from pneumorph.optimize.events import DesignRejected, Event, Finished, Started
from pneumorph.optimize.finer import with_finer_mesh
from pneumorph.optimize.iterate import Iterate, evaluate, looked_at, with_errors
from pneumorph.optimize.proposal import propose
from pneumorph.optimize.radius import begin as first_region
from pneumorph.optimize.radius import next_radius
from pneumorph.optimize.record import StepRecord, accepted, checkpoint
from pneumorph.optimize.settings import LoopSettings
from pneumorph.optimize.setup import Setup, build_setup
from pneumorph.optimize.start import begun_from, resumed, start
from pneumorph.optimize.stopping import TIME_IS_UP, conclusion, reason_to_stop
from pneumorph.optimize.trial import analyse_trial
from pneumorph.problem import Problem
from pneumorph.problem.defaults import MARGIN as WATCHED


def design(
    problem: Problem,
    state: Mapping[str, Any] | None = None,
    settings: LoopSettings | None = None,
    begin: Mapping[str, Any] | None = None,
) -> Iterator[Event]:
    """Design a body for a problem; yields events, among them every accepted design.

    Every accepted design satisfies every limit, and its objective is better than that of the design before. Where the
    states of the start violate a limit, designs first reduce that violation.

    Parameters
    ----------
    problem : Problem
    state : of a `DesignAccepted`, to resume from there.
    settings : of the loop, by default the usual ones.
    begin : of a `DesignAccepted` of another problem with the same body and part of it, to start with that design.

    Raises
    ------
    ComputationError
        When the starting design cannot be brought within its limits, cannot be meshed or has no equilibrium.
    """
    setup = build_setup(problem, settings)
    return optimise(setup, state, begin, coarse_setup(setup))


def optimise(
    setup: Setup,
    state: Mapping[str, Any] | None = None,
    begin: Mapping[str, Any] | None = None,
    coarse: Setup | None = None,
) -> Iterator[Event]:
    """Run the design loop on any body, mesh and limits; see `design`.

    Parameters
    ----------
    setup, state, begin : see `design`.
    coarse : the same with larger elements, on which the first designs are made if that is worthwhile.
    """
    clock = Clock()
    at = coarse if coarse is not None and _begins_on(coarse, state, begin) else setup
    if state is not None:
        current = resumed(at, state)
    elif begin is not None:
        current = yield from begun_from(at, begin, clock)
    else:
        try:
            current = yield from start(at, clock)
        except Hopeless:
            if at is setup:
                raise
            at = setup
            current = yield from start(at, clock)
    yield _started(at, current)
    if state is None:
        yield accepted(at, current, StepRecord(current.disc.factorisations, remeshed=False), clock)
    if at.coarse:
        current, finer = yield from _on_larger_elements(setup, at, current)
        setup = at if finer is None else setup
        current = finer or current
    while True:
        reason = reason_to_stop(setup, current)
        clock = Clock()
        following = (yield from improve(setup, current, clock)) if reason is None else Ended(reason)
        if isinstance(following, Ended):
            finer = None if reason == TIME_IS_UP else (yield from _looked_again(setup, current))
            if finer is None or finer.number == current.number:
                yield _finished(setup, finer or current, following.reason)
                return
            current = finer
        else:
            current, record = following
            yield accepted(setup, current, record, clock)


def _begins_on(coarse: Setup, state: Mapping[str, Any] | None, begin: Mapping[str, Any] | None) -> bool:
    """Whether a run begins, or goes on, on larger elements."""
    if state is not None:
        return bool(state.get("coarse", False))
    return begin is None and serves(coarse)


def _on_larger_elements(
    setup: Setup, coarse: Setup, current: Iterate
) -> Generator[Event, None, tuple[Iterate, Iterate | None]]:
    """Designs until larger elements have served: the last one there, and the first one after it on those asked for.

    None where no design is sound there, or there is no time for it.
    """
    passed: list[Mapping[str, Any]] = []
    while True:
        clock, reason = Clock(), reason_to_stop(coarse, current)
        step = improve(coarse, current, clock, judged_on_larger_elements)
        following = (yield from step) if reason is None else Ended(reason)
        if isinstance(following, Ended):
            if following.reason == TIME_IS_UP:
                return current, None
            record, number = StepRecord(following.factorisations, remeshed=True), current.number + 1
            return current, (
                yield from refined(setup, coarse, current, passed, number, following.reason, record, clock)
            )
        passed.append(checkpoint(coarse, current))
        current, record = following
        if (reason := has_served(coarse, current)) is not None:
            finer = yield from refined(setup, coarse, current, passed, current.number, reason, record, clock)
            if finer is not None:
                return current, finer
        yield accepted(coarse, current, record, clock)
        if reason is not None:
            return current, None


def _looked_again(setup: Setup, current: Iterate) -> Generator[Event, None, Iterate | None]:
    """The last design with the errors by its mesh, where one is asked for that is not known; else None.

    Where it is larger, the same design follows on a finer mesh, from which the run goes on.
    """
    if setup.problem.mesh.error is None or current.errors or current.number >= setup.problem.optimizer.iterations:
        return None
    clock = Clock()
    with clock.phase("equilibrium"):
        last = looked_at(setup, current)
    finer = yield from with_finer_mesh(setup, last, clock)
    if finer.disc is last.disc:
        return last
    finer = replace(finer, number=current.number + 1)
    yield accepted(setup, finer, StepRecord(finer.disc.factorisations, remeshed=False), clock)
    return finer


def improve(
    setup: Setup, current: Iterate, clock: Clock, judge: Callable[[Tried], Verdict] = judged
) -> Generator[Event, None, tuple[Iterate, StepRecord] | Ended]:
    """One iteration: steps are tried in smaller and smaller trust regions until one is accepted; the next iterate.

    Parameters
    ----------
    setup, current : of the run.
    clock : counts the time.
    judge : tells what speaks against a step that was tried.
    """
    settings, factorisations = setup.settings, 0
    made = current.disc.factorisations
    current = renewed(setup, current, clock)
    factorisations += current.disc.factorisations - made
    region = first_region(settings.radius, current.learnt.radius, current.learnt.stride)
    current = current.learning(
        curvature=current.learnt.curvature.with_design(current.analysis.phi, current.slopes.rest)
    )
    while not region.exhausted(settings.radius):
        with clock.phase("subproblem"):
            proposal = propose(setup, current, region)
        asked, region = region.radius, replace(region, radius=proposal.radius)
        attempt = Attempt(setup, current, region, asked, proposal, clock)
        verdict = first_objection(PROPOSAL_TESTS, attempt)
        if verdict is None:
            region = region.after_trial()
            given = setup, current.number + 1, current.design, proposal.within.phi, current.learnt.stride, clock
            trial = yield from analyse_trial(*given)
            current = current.learning(stride=trial.stride)
            tried = corrected(Tried(setup, current, region, asked, proposal, clock, trial))
            trial, proposal = tried.trial, tried.proposal
            factorisations += trial.factorisations
            verdict = judge(tried)
            if verdict is None:
                following = _accept(tried)
                finer = yield from with_finer_mesh(setup, following, clock)
                factorisations += finer.disc.factorisations if finer.disc is not following.disc else 0
                length = float(np.abs(proposal.change).max())
                return finer, StepRecord(factorisations, trial.remeshed, length, tried.ratio, proposal.step.evaluations)
        if isinstance(verdict, Ended):
            return replace(verdict, factorisations=factorisations)
        region, current = verdict.region, verdict.current
        if verdict.reason:
            yield DesignRejected(current.number + 1, verdict.reason, region.radius * setup.reference)
    if not region.trials:
        return Ended("no step within the limits improves the design")
    return Ended("the trust region has become too small: no trial step improved the design")


def _accept(tried: Tried) -> Iterate:
    """The next iterate: the trial design, with what its step has taught."""
    setup, current, proposal = tried.setup, tried.current, tried.proposal
    long = proposal.step.length >= setup.settings.proposal.long * tried.length
    learnt = replace(
        current.learnt,
        stepper=current.learnt.stepper.after(proposal.step),
        radius=next_radius(setup.settings.radius, tried.region, tried.ratio, proposal.kept, long, tried.trial.stride),
        state_curvature=current.states.curvature(tried.trial.state_excess, proposal.change),
    )
    following = evaluate(setup, current.number + 1, tried.design, learnt, tried.clock)
    return with_errors(setup, following, tried.trial.remeshed)


def _started(setup: Setup, current: Iterate) -> Started:
    model = current.disc.model
    return Started(
        iteration=current.number,
        iterations=setup.problem.optimizer.iterations,
        variables=setup.space.n,
        larger=setup.mesher.size if setup.coarse else None,
        elements=model.elements,
        element=model.element,
        dofs=model.size,
        part=model.part,
    )


def _finished(setup: Setup, last: Iterate, reason: str) -> Finished:
    """The end of the run, with what is reported of the last design: its stability, how it sags and inflates."""
    with doing("looking at the last design"):
        is_stable = check_stability(last.disc, last.analysis)
        why = conclusion(setup, last, reason, is_stable)
        held = last.feasible and not last.states.unknown
        if not setup.settings.looked_at:
            fields = collect_fields(last.disc, last.analysis)
            return Finished(last.number, why, held, is_stable, {}, {}, {}, {}, fields)
        sag, inflation = compute_inflation(setup.problem, last.disc, last.analysis)
        thickening = thickenings(setup.problem, last.disc, last.analysis)
        fields = collect_fields(last.disc, last.analysis, sag, inflation, thickening)
        rates = motion_rates(last.disc, last.analysis)
        errors = last.errors or quick_errors(setup.problem, last.disc, last.analysis)
        mesh = {name: error.fine for name, error in errors.items()}
        near, unknown = near_margins(last.disc, last.analysis, MARGIN.read(setup.problem.limits) or WATCHED)
    return Finished(last.number, why, held, is_stable, rates, near, unknown, mesh, fields)
