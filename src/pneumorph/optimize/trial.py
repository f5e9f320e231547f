"""Analyse the design after a step, on a new mesh where the old one has become poor."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, analyse, carry_over, discretise, predict_states
from pneumorph.errors import MeshError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Guess, NoEquilibrium
from pneumorph.mesh import needs_remesh, relax
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize.buckling import LateralStability, Stiffnesses, judge
from pneumorph.optimize.events import Event, MeshKept, Remeshed
from pneumorph.optimize.history import Clock
from pneumorph.problem import Problem

MOST_FACTORISATIONS, ELSEWHERE, ENOUGH = 40, 20, 8
"""A search is given up if the equilibrium of a task takes more factorisations than this. The others are without
contact, the last on the mesh that the search comes from: what is not found there at once is found in shorter steps."""

ROUGHEST = 5.0
"""Residual of a predicted state, over κ/μ and the applied forces, above which a search without contact does not even
begin: it hardly ever ends."""

SHORTEST = 1 / 4
"""Least part of a step that is gone at a time."""

BEARABLE = 0.002
"""A mesh is kept if no new one can be made and its worst element is better than this."""


SOUND, FINER = 0.05, 0.8
"""A mesh with no worse element is kept where a new one would need elements smaller than this part of `mesh.size`, or
than its own. Half the size has eight times as many: a design would take longer than all before."""


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
        How it stands motions to a side, where it was analysed.
    reached : float
        Where it was gone in parts, how much of the step had states.
    """

    disc: Discretisation
    analysis: Analysis | None
    reason: str
    before: float
    remeshed: bool
    factorisations: int
    lateral: LateralStability | None = None
    reached: float = 1.0


def analyse_trial(
    problem: Problem,
    space: DesignSpace,
    number: int,
    disc: Discretisation,
    now: Analysis,
    phi: np.ndarray,
    clock: Clock,
    at_rest: Stiffnesses = MappingProxyType({}),
) -> Generator[Event, None, Trial]:
    """Analyse the design Φ (n,) with this number, a step away from an analysed one on a given mesh.

    `at_rest` are stiffnesses against motions to a side, see `judge`.
    """
    count, points, given, reached = disc.factorisations, space.control_points(phi), disc, 1.0
    with clock.phase("geometry"):
        poor = needs_remesh(disc.morph, points)
        if poor is not None:
            # Mostly a few elements fold, which moving the nodes inside repairs; a new mesh starts from that too.
            disc = replace(disc, morph=relax(disc.morph, points))
            poor = needs_remesh(disc.morph, points)
    with clock.phase("equilibrium"):
        starts = predict_states(space, disc, now, phi)
    with clock.phase("geometry"):
        if poor is not None:
            try:
                new = discretise(problem, space.body(phi), _finest(problem, disc, points))
            except MeshError as error:
                quality, poor = _quality(disc, points), None
                if quality < BEARABLE:
                    return Trial(disc, None, str(error), now.value, True, 0)
                yield MeshKept(number, str(error), quality)
            else:
                starts = _carried(disc, now, new, (disc.morph.positions(points), starts))
                disc, count = new, 0
    if poor is not None:
        yield Remeshed(number, poor, disc.model.elements, _quality(disc, points), disc.model.part)
    with clock.phase("equilibrium"):
        if disc.model.contact is not None:
            same = now if poor is None else None
            found = analyse(problem, space, disc, phi, starts, most=MOST_FACTORISATIONS, near=same)
        else:
            most, begin, near = (ENOUGH, given, now) if poor is None else (ELSEWHERE, disc, None)
            found = analyse(problem, space, disc, phi, starts, most=most, roughest=ROUGHEST)
            if isinstance(found, NoEquilibrium):
                near = near or _on_mesh(problem, space, disc, given, now)
                if isinstance(near, NoEquilibrium):
                    found = near
                else:
                    found, reached = _by_parts(problem, space, begin, near, disc, phi)
        before = now.value
        if not isinstance(found, NoEquilibrium) and disc is not given and found.value > before:
            before = _before(problem, space, disc, now, found)
        lateral = None if isinstance(found, NoEquilibrium) else judge(disc, found, at_rest)
    spent = disc.factorisations - count
    if isinstance(found, NoEquilibrium):
        return Trial(disc, None, found.reason, before, poor is not None, spent, reached=reached)
    return Trial(disc, found, "", before, poor is not None, spent, lateral)


def _finest(problem: Problem, disc: Discretisation, points: np.ndarray) -> float:
    """The smallest elements of a new mesh, mm; any where the mesh there is does not serve any more."""
    return min(FINER * problem.mesh.size, disc.morph.size) if _quality(disc, points) >= SOUND else 0.0


def _carried(
    old: Discretisation, now: Analysis, new: Discretisation, ahead: tuple[np.ndarray, Mapping[str, Guess]] | None = None
) -> dict[str, Guess]:
    """The states of an analysed design, or those predicted from it, on a new mesh."""
    states = {name: found.state for name, found in now.equilibria.items()}
    return carry_over(old, now.X, states, new, new.morph.positions(now.points), ahead)


def _before(problem: Problem, space: DesignSpace, disc: Discretisation, now: Analysis, trial: Analysis) -> float:
    """The objective before a step, on the mesh after it: another mesh changes it by as much as a small step gains."""
    starts = predict_states(space, disc, trial, now.phi)
    again = analyse(problem, space, disc, now.phi, starts, most=MOST_FACTORISATIONS)
    return now.value if isinstance(again, NoEquilibrium) else again.value


def _on_mesh(
    problem: Problem, space: DesignSpace, disc: Discretisation, given: Discretisation, now: Analysis
) -> Analysis | NoEquilibrium:
    """A design that was analysed on a given mesh, on another one."""
    return analyse(problem, space, disc, now.phi, _carried(given, now, disc), most=ELSEWHERE)


def _by_parts(
    problem: Problem, space: DesignSpace, begin: Discretisation, near: Analysis, end: Discretisation, phi: np.ndarray
) -> tuple[Analysis | NoEquilibrium, float]:
    """The design Φ (n,) by way of others between it and one near it, and how much of the way had states.

    Nodes inside go along.
    """
    found, reached, part = near, 0.0, 0.5
    while reached < 1.0:
        share = min(reached + part, 1.0)
        shift = begin.morph.shift + share * (end.morph.shift - begin.morph.shift)
        disc, there = replace(end, morph=replace(end.morph, shift=shift)), near.phi + share * (phi - near.phi)
        if _quality(disc, space.control_points(there)) < BEARABLE:
            return NoEquilibrium("the mesh folds on the way", 0.0, None), reached
        starts = predict_states(space, disc, found, there)
        tried = analyse(problem, space, disc, there, starts, most=ENOUGH, roughest=ROUGHEST)
        if not isinstance(tried, NoEquilibrium):
            found, reached = tried, share
        elif part > SHORTEST:
            part /= 2
        else:
            return tried, reached
    return found, reached


def _quality(disc: Discretisation, points: np.ndarray) -> float:
    """Quality of the worst element of the mesh moved to these control points."""
    return float(scaled_jacobian(disc.morph.positions(points), disc.morph.mesh.tets).min())
