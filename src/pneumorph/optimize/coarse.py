"""The first designs of a run are on larger elements than those asked for: a third as many, which saves time.

What a step gains there it gains on smaller elements too, but for a few per cent of the motion, and limits on the shape
do not depend on a mesh (Nash 2000, "A multigrid approach to discretized optimization problems"; here each mesh is left
once for all). The last designs, and so the result, are on the elements asked for.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pneumorph.analysis import Analysis, expect_limit_points
from pneumorph.analysis.bodies import mesher_of
from pneumorph.errors import Hopeless, MeshError, ProblemError
from pneumorph.limits.kinds.states import MARGIN
from pneumorph.limits.limit import ROUNDING
from pneumorph.mechanics import part_of
from pneumorph.optimize.acceptance import newly_intersects
from pneumorph.optimize.buckling import buckles, rejudge
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import Event, NotRefined, Refined, Served
from pneumorph.optimize.iterate import AnalysedDesign, Iterate, Learnt, evaluate
from pneumorph.optimize.record import StepRecord, accepted
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.start import on_new_mesh, restored
from pneumorph.optimize.states import worst_state
from pneumorph.optimize.stopping import missed_by_less

Checkpoint = Mapping[str, Any]


def coarse_setup(setup: Setup) -> Setup | None:
    """The setup of a problem's own body with larger elements; None where these would not do for it."""
    problem = setup.problem
    if problem.mesh.error is not None:
        return None
    size = setup.settings.coarse.factor * problem.mesh.size
    try:
        problem.with_changes({"mesh.size": f"{size!r} mm"})
    except ProblemError:
        return None
    return replace(setup, mesher=mesher_of(problem, part_of(problem), size))


def serves(coarse: Setup) -> bool:
    """Whether a run of a body begins on larger elements."""
    settings = coarse.settings.coarse
    if coarse.problem.optimizer.iterations < settings.fewest:
        return False
    try:
        morph = coarse.mesher.mesh(coarse.space.body(coarse.space.start))
    except MeshError:
        return False
    return morph.size > coarse.problem.mesh.size and len(morph.mesh.tets) >= settings.least


def has_served(coarse: Setup, current: Iterate) -> str | None:
    """Why the larger elements have served with this design, as a sentence; None where designs go on with them."""
    settings, problem = coarse.settings.coarse, coarse.problem
    if current.number >= settings.share * problem.optimizer.iterations:
        return f"{100 * settings.share:.0f} % of the designs are made"
    if missed_by_less(coarse, current, settings.misfit):
        return "the targets are near"
    if current.disc.morph.size <= problem.mesh.size:
        return "larger ones would not mesh this body"
    if time.time() + settings.left * current.took > coarse.settings.until:
        return "time is short"
    return None


def refined(
    setup: Setup,
    coarse: Setup,
    last: Iterate,
    passed: Sequence[Checkpoint],
    number: int,
    reason: str,
    record: StepRecord,
    clock: Clock,
) -> Generator[Event, None, Iterate | None]:
    """A design on elements of the size asked for: the last one on larger ones, or one before it which is sound there.

    A body on smaller elements is a little softer: it may buckle, or its states may be beyond their limits.

    Parameters
    ----------
    setup, coarse : of the run, with elements of the size asked for and with larger ones.
    last : the last design on larger ones.
    passed : checkpoints of the designs before it, as far as they are known.
    number : of the new design: that of the last one, if this has not been recorded yet, or the next one.
    reason : why it is the last one, as a sentence.
    record : how the new design was reached so far.
    clock : counts the time of it.

    Returns
    -------
    Iterate or None
        None where no design is found to be sound.
    """
    yield Served(last.number, reason)
    spent = record.factorisations
    for back, design in _latest_first(coarse, last, passed):
        shape = last.number - back
        found, why, made = _analysed(setup, design, clock)
        spent += made
        if found is None:
            yield NotRefined(shape, why)
            continue
        if back:
            record = StepRecord(spent, remeshed=True)
        gained = found.analysis.value - design.analysis.value
        earlier = last.learnt.objectives[: -1 - back]
        learnt = replace(last.learnt, objectives=tuple(value + gained for value in earlier))
        if back:
            shorter = setup.settings.radius.shrink * learnt.radius
            learnt = replace(learnt, radius=shorter, stride=Learnt.stride, state_curvature=0.0)
        current = evaluate(setup, number, found, learnt, clock)
        model = found.disc.model
        yield Refined(number, shape, setup.mesher.size, model.elements, model.part)
        yield accepted(setup, current, replace(record, factorisations=spent, remeshed=True), clock)
        return current
    return None


def _latest_first(coarse: Setup, last: Iterate, passed: Sequence[Checkpoint]) -> Iterator[tuple[int, AnalysedDesign]]:
    """The last design and some before it, with how many designs each is before the last one: 0, 1, 3, 7, …"""
    yield 0, last.design
    back = 1
    while back <= len(passed):
        try:
            design = restored(coarse, passed[-back])
        except ProblemError:  # Its states are not found again.
            return
        yield back, design
        back = 2 * back + 1


def _analysed(setup: Setup, design: AnalysedDesign, clock: Clock) -> tuple[AnalysedDesign | None, str, int]:
    """A design on elements of the size asked for; None and the reason where it is not sound there; factorisations."""
    try:
        disc, analysis = on_new_mesh(setup, design, setup.settings.coarse.most, clock)
    except Hopeless as error:
        return None, str(error), 0
    if not isinstance(analysis, Analysis):
        return None, analysis.reason, disc.factorisations
    with clock.phase("equilibrium"):
        lateral = rejudge(disc, analysis, design.lateral.at_rest, design.lateral.load)
        if (bound := MARGIN.read(setup.problem.limits)) is not None:
            expect_limit_points(design.analysis, analysis, bound)
        excess, limit = worst_state(setup.problem, disc, analysis)
        before, _ = worst_state(setup.problem, design.disc, design.analysis)
    reason = ""
    if buckles(design.lateral, lateral):
        reason = "it would buckle laterally"
    elif newly_intersects(design.analysis, analysis):
        reason = "the body would self-intersect"
    elif excess > max(before, ROUNDING):
        reason = f"it would be {100 * excess:.2g} % beyond limits.{limit}"
    made = disc.factorisations
    return (None if reason else replace(design, analysis=analysis, disc=disc, lateral=lateral)), reason, made
