"""Analyse the design after a step, on a new mesh where the old one has become poor."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    analyse,
    carry_over,
    expect_limit_points,
    joined,
    predict_states,
    remember_limit_points,
)
from pneumorph.errors import MeshError
from pneumorph.limits.kinds.states import MARGIN
from pneumorph.limits.limit import ROUNDING
from pneumorph.mechanics import Guess, NoEquilibrium
from pneumorph.mesh import between, needs_remesh, poor, relax, slide
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize.buckling import LateralStability, judge, judge_after
from pneumorph.optimize.castings import carried
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import Event, MeshKept, Remeshed
from pneumorph.optimize.iterate import AnalysedDesign
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.states import worst_state


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

    @property
    def beyond_states(self) -> bool:
        """Whether its states violate a limit."""
        return self.state_excess > ROUNDING


@dataclass(frozen=True, eq=False)
class _Followed:
    """The mesh of a trial with the states to begin from, and whether it is new."""

    disc: Discretisation
    starts: Mapping[str, Guess]
    remeshed: bool


def analyse_trial(
    setup: Setup, number: int, now: AnalysedDesign, phi: np.ndarray, clock: Clock
) -> Generator[Event, None, Trial]:
    """Analyse a design that is a step away from the current one.

    Parameters
    ----------
    setup : of the run.
    number : of the new design.
    now : the current design.
    phi : (n,) the new design.
    clock : counts the time.
    """
    before, count = now.analysis.value, now.disc.factorisations
    mesh = yield from _follow(setup, number, now, phi, clock)
    if isinstance(mesh, MeshError):
        return Trial(now.disc, None, str(mesh), before, remeshed=True, factorisations=0)
    with clock.phase("equilibrium"):
        analysis, reached = _solve(setup, now, mesh, phi)
    spent = Trial(mesh.disc, None, "", before, mesh.remeshed, 0 if mesh.remeshed else -count, reached=reached)
    return _judged(setup, number, now, spent, analysis, clock)


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
        analysis = analyse(setup.problem, setup.space, disc, phi, starts, most=most, near=trial.analysis)
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
        return replace(spent, analysis=None, reason=analysis.reason, factorisations=done)
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
    setup: Setup, number: int, now: AnalysedDesign, phi: np.ndarray, clock: Clock
) -> Generator[Event, None, _Followed | MeshError]:
    """The mesh for a new design, with its predicted states; the error where there is none."""
    space, settings, disc, points = setup.space, setup.settings.trial, now.disc, setup.space.control_points(phi)
    with clock.phase("geometry"):
        reason = needs_remesh(disc.morph, points)
        if reason is not None:
            # Mostly a few elements fold, which moving the nodes inside repairs; a new mesh starts from that too.
            disc = replace(disc, morph=relax(disc.morph, points))
            if disc.model.contact is None and poor(disc.morph, points):
                disc = replace(disc, morph=slide(disc.morph, points))
            reason = needs_remesh(disc.morph, points)
    with clock.phase("equilibrium"):
        starts = predict_states(space, disc, now.analysis, phi)
    if reason is None:
        return _Followed(disc, starts, remeshed=False)
    quality, like = _quality(disc, points), disc.morph.at(points)
    if like.halved is not None:
        with clock.phase("equilibrium"):
            like = replace(like, halved=joined(setup.problem, now.disc, now.analysis))
    with clock.phase("geometry"):
        # Any size of elements, where the mesh does not serve any more.
        sound = quality >= settings.sound
        finest = min(settings.finer * setup.problem.mesh.size, disc.morph.size) if sound else 0.0
        try:
            new = setup.discretise(space.body(phi), finest, like)
        except MeshError as error:
            if quality < settings.bearable:
                return error
            yield MeshKept(number, str(error), quality)
            return _Followed(disc, starts, remeshed=False)
        new = carried(new, new.morph.positions(points), disc.castings)
        starts = states_on(disc, now.analysis, new, (disc.morph.positions(points), starts))
    yield Remeshed(number, reason, new.model.elements, _quality(new, points), new.model.part)
    return _Followed(new, starts, remeshed=True)


def _solve(
    setup: Setup, now: AnalysedDesign, mesh: _Followed, phi: np.ndarray
) -> tuple[Analysis | NoEquilibrium, float]:
    """The new design on its mesh, and how much of the step had states if it was solved in parts."""
    problem, space, settings, disc = setup.problem, setup.space, setup.settings.trial, mesh.disc
    if disc.model.contact is not None:
        near = None if mesh.remeshed else now.analysis
        return analyse(problem, space, disc, phi, mesh.starts, most=settings.most_in_contact, near=near), 1.0
    most = settings.most_on_new_mesh if mesh.remeshed else settings.most
    analysis = analyse(problem, space, disc, phi, mesh.starts, most=most, roughest=settings.roughest)
    if not isinstance(analysis, NoEquilibrium):
        return analysis, 1.0
    if not mesh.remeshed:
        return _in_parts(setup, now.disc, now.analysis, disc, phi)
    starts = states_on(now.disc, now.analysis, disc)
    again = analyse(problem, space, disc, now.analysis.phi, starts, most=settings.most_on_new_mesh)
    return (again, 1.0) if isinstance(again, NoEquilibrium) else _in_parts(setup, disc, again, disc, phi)


def _in_parts(
    setup: Setup, begin: Discretisation, near: Analysis, end: Discretisation, phi: np.ndarray
) -> tuple[Analysis | NoEquilibrium, float]:
    """The design Φ (n,) by way of others between it and one near it, and how much of the way had states.

    Nodes inside go along.

    Parameters
    ----------
    begin, near : the design near it, and its mesh.
    end, phi : the design, and its mesh: the same, perhaps with other nodes inside.
    """
    problem, space, settings = setup.problem, setup.space, setup.settings.trial
    last, reached, part = near, 0.0, 0.5
    while reached < 1.0:
        share = min(reached + part, 1.0)
        disc = replace(end, morph=between(begin.morph, end.morph, share))
        there = near.phi + share * (phi - near.phi)
        if _quality(disc, space.control_points(there)) < settings.bearable:
            # It says nothing of the states of shorter steps.
            return NoEquilibrium("elements of the mesh invert along the step", 0.0, None), max(reached, part)
        starts = predict_states(space, disc, last, there)
        tried = analyse(problem, space, disc, there, starts, most=settings.most, roughest=settings.roughest)
        if not isinstance(tried, NoEquilibrium):
            last, reached = tried, share
        elif part > settings.shortest:
            part /= 2
        else:
            return tried, reached
    return last, reached


def states_on(
    old: Discretisation, now: Analysis, new: Discretisation, ahead: tuple[np.ndarray, Mapping[str, Guess]] | None = None
) -> dict[str, Guess]:
    """The states of an analysed design, or those predicted from it, on a new mesh.

    Parameters
    ----------
    old, now : its mesh, and the design.
    new : the new mesh.
    ahead : see `carry_over`.
    """
    states = {name: equilibrium.state for name, equilibrium in now.equilibria.items()}
    return carry_over(old, now.X, states, new, new.morph.positions(now.points), ahead)


def _value_on(setup: Setup, disc: Discretisation, now: Analysis, trial: Analysis) -> float:
    """The objective before a step, on the mesh after it: another mesh changes it by as much as a small step gains."""
    starts = predict_states(setup.space, disc, trial, now.phi)
    most = setup.settings.trial.most_in_contact
    again = analyse(setup.problem, setup.space, disc, now.phi, starts, most=most)
    return now.value if isinstance(again, NoEquilibrium) else again.value


def _quality(disc: Discretisation, points: np.ndarray) -> float:
    """Quality of the worst element of the mesh moved to these control points."""
    return float(scaled_jacobian(disc.morph.positions(points), disc.morph.mesh.tets).min())
