"""Analyse the design after a step, on a new mesh where the old one has become poor."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    SelfIntersecting,
    analyse,
    expect_limit_points,
    joined,
    predict_states,
    remember_limit_points,
)
from pneumorph.errors import MeshError
from pneumorph.limits.kinds.states import MARGIN
from pneumorph.limits.limit import ROUNDING
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import needs_remesh
from pneumorph.optimize.buckling import LateralStability, judge, judge_after
from pneumorph.optimize.castings import carried
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import Event, MeshKept, Remeshed
from pneumorph.optimize.iterate import AnalysedDesign
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.states import worst_state
from pneumorph.optimize.way import (
    Followed,
    Place,
    Way,
    before_last_part,
    follow,
    follow_on,
    quality,
    states_on,
    with_moved_nodes,
)


@dataclass(frozen=True, eq=False)
class Trial:
    """A design that was tried.

    Attributes
    ----------
    disc : Discretisation
        The mesh of the design before, with the same nodes inside or others, or a new one.
    analysis : Analysis or None
        None where the design could not be analysed.
    reason : str
        Why it could not; else empty.
    before : float
        Objective of the design before, on the mesh of the trial.
    remeshed : bool
    factorisations : int
    lateral : LateralStability or None
        Its stability against lateral buckling, where it was analysed.
    state_excess, state_limit : float, str
        By how much its states violate a limit at most, relative to the bound, and the name of that limit.
    reached : float
        Where it was solved in parts of the step, how much of the step had states.
    stride : float
        How long the first part of the next step may be, in reference steps.
    crossed : SelfIntersecting or None
        Where the body would intersect itself, on the mesh of the trial.
    """

    disc: Discretisation
    analysis: Analysis | None
    reason: str
    before: float
    remeshed: bool
    factorisations: int
    lateral: LateralStability | None = None
    state_excess: float = -np.inf
    state_limit: str = ""
    reached: float = 1.0
    stride: float = math.inf
    crossed: SelfIntersecting | None = None

    @property
    def beyond_states(self) -> bool:
        """Whether its states violate a limit."""
        return self.state_excess > ROUNDING


def analyse_trial(
    setup: Setup, number: int, now: AnalysedDesign, phi: np.ndarray, stride: float, clock: Clock
) -> Generator[Event, None, Trial]:
    """Analyse a design that is a step away from the current one.

    Parameters
    ----------
    setup : of the run.
    number : of the new design.
    now : the current design.
    phi : (n,) the new design.
    stride : length of the first part in which its states are followed, in reference steps; see `way.follow`.
    clock : counts the time.
    """
    before, count = now.analysis.value, now.disc.factorisations
    way, remeshed = yield from _follow(setup, number, now, phi, stride, clock)
    if isinstance(way, MeshError):
        return Trial(now.disc, None, str(way), before, remeshed=True, factorisations=0, stride=stride)
    done = (now.disc.factorisations if remeshed else 0) - count
    spent = Trial(way.disc, None, "", before, remeshed, done, reached=way.reached, stride=way.stride)
    return _judged(setup, number, now, spent, way.found, clock)


def analyse_again(setup: Setup, number: int, now: AnalysedDesign, trial: Trial, phi: np.ndarray, clock: Clock) -> Trial:
    """Analyse a design near that of a trial, on its mesh, by the states of that.

    Parameters
    ----------
    setup, number, now, clock : see `analyse_trial`.
    trial : which was analysed.
    phi : (n,) the design near it.
    """
    disc, settings = trial.disc, setup.settings.trial
    assert trial.analysis is not None
    count = disc.factorisations
    most = settings.most if disc.model.contact is None else settings.most_in_contact
    with clock.phase("equilibrium"):
        starts = predict_states(setup.space, disc, trial.analysis, phi)
        near, apart = trial.analysis, now.analysis
        analysis = analyse(setup.problem, setup.space, disc, phi, starts, near=near, apart=apart, most=most)
    return _judged(setup, number, now, replace(trial, factorisations=trial.factorisations - count), analysis, clock)


def _judged(
    setup: Setup, number: int, now: AnalysedDesign, spent: Trial, analysis: Analysis | NoEquilibrium, clock: Clock
) -> Trial:
    """A trial with its states, once its stability and its limits are known.

    Parameters
    ----------
    setup, number, now, clock : see `analyse_trial`.
    spent : the trial without them or with those of a design nearby on its mesh, and its factorisations less those of
        its mesh before it.
    analysis : its states.
    """
    problem, disc, before = setup.problem, spent.disc, spent.before
    if isinstance(analysis, NoEquilibrium):
        done = spent.factorisations + disc.factorisations
        crossed = analysis if isinstance(analysis, SelfIntersecting) else None
        return replace(spent, analysis=None, reason=analysis.reason, factorisations=done, crossed=crossed)
    with clock.phase("equilibrium"):
        if disc is not now.disc and analysis.value > before:
            before = _value_on(setup, disc, now.analysis, analysis)
        # The last design of a run is judged before it is accepted.
        last = number >= problem.optimizer.iterations
        lateral = judge(disc, analysis, now.lateral.at_rest) if last else judge_after(disc, analysis, now.lateral)
    done = spent.factorisations + disc.factorisations
    with clock.phase("equilibrium"):
        if (bound := MARGIN.read(problem.limits)) is not None:
            expect_limit_points(now.analysis, analysis, bound)
            if disc.model is now.disc.model:
                remember_limit_points(now.analysis, analysis)
            if spent.analysis is not None:
                remember_limit_points(spent.analysis, analysis)
        excess, limit = worst_state(problem, disc, analysis)
    return replace(
        spent,
        analysis=analysis,
        before=before,
        factorisations=done,
        lateral=lateral,
        state_excess=excess,
        state_limit=limit,
        reached=1.0,
    )


def _follow(
    setup: Setup, number: int, now: AnalysedDesign, phi: np.ndarray, stride: float, clock: Clock
) -> Generator[Event, None, tuple[Followed | MeshError, bool]]:
    """The states of a new design, and whether it has a new mesh; the error where there is no mesh for it."""
    with clock.phase("geometry"):
        way = _serving(Way(setup, Place(now.disc, now.analysis), now.disc, phi))
        reason = needs_remesh(way.end.morph, setup.space.control_points(phi))
    if reason is not None:
        return (yield from _on_new_mesh(number, way, reason, stride, clock))
    with clock.phase("equilibrium"):
        return follow(way, stride), False


def _on_new_mesh(
    number: int, way: Way, reason: str, stride: float, clock: Clock
) -> Generator[Event, None, tuple[Followed | MeshError, bool]]:
    """What `_follow` finds where the mesh would not serve to the end of the way, with the reason."""
    setup, begin, disc = way.setup, way.begin, way.end
    settings, points = setup.settings.trial, setup.space.control_points(way.phi)
    with clock.phase("equilibrium"):
        # Mostly it serves for a part of it.
        known = before_last_part(way, min(stride, settings.stride))
        if isinstance(known.found, NoEquilibrium):
            return known, False
        starts = way.predicted(disc, 1.0, known.here, known.last)
    worst, like = quality(disc, points), disc.morph.at(points)
    if like.halved is not None:
        with clock.phase("equilibrium"):
            like = replace(like, halved=joined(setup.problem, begin.disc, begin.analysis))
    with clock.phase("geometry"):
        # Any size of elements, where the mesh does not serve any more.
        sound = worst >= settings.sound
        finest = min(settings.finer * setup.mesher.size, disc.morph.size) if sound else 0.0
        if setup.coarse:
            finest = max(finest, setup.problem.mesh.size)
        try:
            new = setup.discretise(setup.space.body(way.phi), finest, like)
        except MeshError as error:
            if worst < settings.bearable:
                return error, True
            yield MeshKept(number, str(error), worst)
            with clock.phase("equilibrium"):
                return follow(way, stride), False
        new = carried(new, new.morph.positions(points), disc.castings)
        starts = states_on(known.here, new, (disc.morph.positions(points), starts))
    yield Remeshed(number, reason, new.model.elements, quality(new, points), new.model.part)
    with clock.phase("equilibrium"):
        return follow_on(way, known, new, starts), True


def _serving(way: Way) -> Way:
    """The way with nodes of its mesh moved, in parts too, where it would have to be remeshed for the new design."""
    disc, parts = way.end, max(math.ceil(way.length / way.setup.settings.trial.stride - 0.1), 1)
    for part in range(1, parts + 1):
        points = way.setup.space.control_points(way.design(part / parts))
        if needs_remesh(disc.morph, points):
            # Mostly a few elements fold, which moving the nodes inside repairs; a new mesh starts from that too.
            disc = with_moved_nodes(disc, points)
    return replace(way, end=disc)


def _value_on(setup: Setup, disc: Discretisation, now: Analysis, trial: Analysis) -> float:
    """The objective before a step, on the mesh after it: another mesh changes it by as much as a small step gains."""
    starts = predict_states(setup.space, disc, trial, now.phi)
    most = setup.settings.trial.most_in_contact
    again = analyse(setup.problem, setup.space, disc, now.phi, starts, most=most)
    return now.value if isinstance(again, NoEquilibrium) else again.value
