"""Analyse the design after a step, on a new mesh where the old one has become poor."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, analyse, carry_over, discretise, predict_states
from pneumorph.errors import MeshError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import needs_remesh, relax
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize.events import Event, MeshKept, Remeshed
from pneumorph.optimize.history import Clock
from pneumorph.problem import Problem

MOST_FACTORISATIONS, MOST_ELSEWHERE, MOST_NEARBY = 40, 20, 10
"""A step is taken back if the equilibrium of a task takes more factorisations than this: that of a smaller step is
usually found in a tenth of them. The last number is for states near the last on the very same mesh, the second for
those on another one, both without contact and hydrostatic unknowns: few that are found take more than half of it."""

BEARABLE = 0.002
"""A mesh is kept if no new one can be made and its worst element is better than this."""


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
    """

    disc: Discretisation
    analysis: Analysis | None
    reason: str
    before: float
    remeshed: bool
    factorisations: int


def analyse_trial(
    problem: Problem,
    space: DesignSpace,
    number: int,
    disc: Discretisation,
    now: Analysis,
    phi: np.ndarray,
    clock: Clock,
) -> Generator[Event, None, Trial]:
    """Analyse the design Φ (n,) with this number, a step away from an analysed one on a given mesh."""
    count, points, given = disc.factorisations, space.control_points(phi), disc
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
                new = discretise(problem, space.body(phi))
            except MeshError as error:
                quality, poor = _quality(disc, points), None
                if quality < BEARABLE:
                    return Trial(disc, None, str(error), now.value, True, 0)
                yield MeshKept(number, str(error), quality)
            else:
                starts = carry_over(disc, disc.morph.positions(points), starts, new)
                disc, count = new, 0
    if poor is not None:
        yield Remeshed(number, poor, disc.model.elements, _quality(disc, points), disc.model.part)
    before = now.value
    with clock.phase("equilibrium"):
        same = None if poor is not None else now
        most = MOST_FACTORISATIONS
        if disc.model.contact is None and not disc.model.mixed:
            most = MOST_NEARBY if disc is given else MOST_ELSEWHERE
        found = analyse(problem, space, disc, phi, starts, most=most, near=same)
        if not isinstance(found, NoEquilibrium) and disc is not given and found.value > before:
            before = _before(problem, space, disc, now, found)
    spent = disc.factorisations - count
    if isinstance(found, NoEquilibrium):
        return Trial(disc, None, found.reason, before, poor is not None, spent)
    return Trial(disc, found, "", before, poor is not None, spent)


def _before(problem: Problem, space: DesignSpace, disc: Discretisation, now: Analysis, trial: Analysis) -> float:
    """The objective before a step, on the mesh after it: another mesh changes it by as much as a small step gains."""
    starts = predict_states(space, disc, trial, now.phi)
    again = analyse(problem, space, disc, now.phi, starts, most=MOST_FACTORISATIONS)
    return now.value if isinstance(again, NoEquilibrium) else again.value


def _quality(disc: Discretisation, points: np.ndarray) -> float:
    """Quality of the worst element of the mesh moved to these control points."""
    return float(scaled_jacobian(disc.morph.positions(points), disc.morph.mesh.tets).min())
