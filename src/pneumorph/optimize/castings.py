"""Perturbed castings, for which designs are robust: chosen again every few designs, and carried to new meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, with_castings
from pneumorph.analysis.castings import Casting, worst_changes
from pneumorph.analysis.tolerances import Tolerances, moved_by
from pneumorph.errors import Hopeless
from pneumorph.mechanics import NoEquilibrium, Tangent
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.iterate import Iterate, evaluate
from pneumorph.optimize.model import no_curvature
from pneumorph.optimize.setup import Setup
from pneumorph.problem import RobustSpec


def tolerances_of(robust: RobustSpec) -> Tolerances:
    """The tolerances of a table [robust]."""
    return Tolerances(robust.rubber, robust.pressure, robust.wall, robust.shift, robust.tilt, scale=0.0, load=0.0)


def begun_robust(setup: Setup, disc: Discretisation, analysis: Analysis) -> tuple[Discretisation, Analysis]:
    """The start with its castings, where designs are to be robust.

    Raises
    ------
    Hopeless
        If a casting has no state.
    """
    if setup.problem.robust is None:
        return disc, analysis
    disc = _with_worst(setup, setup.problem.robust, disc, analysis)
    found = with_castings(setup.problem, disc, analysis, most=setup.settings.trial.most_on_new_mesh)
    if isinstance(found, NoEquilibrium):
        raise Hopeless(f"robust: at the start {found.reason}; lower the pressures, or give smaller deviations")
    return disc, found


def renewed(setup: Setup, current: Iterate, clock: Clock) -> Iterate:
    """The iterate with the castings in which its tasks differ most; as it was where one of them has no state.

    Its objective is another one then. Those of earlier designs are changed by as much, so that their gains stay; the
    curvature of the other objective is forgotten.
    """
    robust = setup.problem.robust
    if robust is None or current.number == 0 or current.number % setup.settings.castings:
        return current
    with clock.phase("equilibrium"):
        disc = _with_worst(setup, robust, current.disc, current.analysis)
        most = setup.settings.trial.most_on_new_mesh
        analysis = with_castings(setup.problem, disc, current.analysis, most=most)
    if isinstance(analysis, NoEquilibrium):
        return current
    more = analysis.value - current.analysis.value
    learnt = replace(
        current.learnt,
        curvature=no_curvature(setup.space.n),
        objectives=tuple(value + more for value in current.learnt.objectives[:-1]),
    )
    return evaluate(setup, current.number, replace(current.design, analysis=analysis, disc=disc), learnt, clock)


def carried(disc: Discretisation, X: np.ndarray, castings: Mapping[str, tuple[Casting, ...]]) -> Discretisation:
    """A new mesh, whose nodes are at X (N, 3) mm, with the castings of the one before."""
    there = {
        task: tuple(
            Casting(each.changes, moved_by(disc.morph, X, each.changes), Tangent(disc.model)) for each in castings[task]
        )
        for task in castings
    }
    return replace(disc, castings=there)


def _with_worst(setup: Setup, robust: RobustSpec, disc: Discretisation, analysis: Analysis) -> Discretisation:
    """The mesh with the castings in which the tasks of a design differ most; solvers are kept."""
    castings, tolerances = {}, tolerances_of(robust)
    for task in setup.problem.task:
        at, tangent, equilibrium, _, _ = analysis.state(disc, task.name)
        objective, known = disc.objectives[task.name], disc.castings.get(task.name, ())
        worst = worst_changes(disc.morph, at, tangent, equilibrium.state, objective, tolerances, robust.deviations)
        solvers = [each.tangent for each in known] or [Tangent(disc.model) for _ in worst]
        castings[task.name] = tuple(
            Casting(changes, moved_by(disc.morph, at.X, changes), solver)
            for changes, solver in zip(worst, solvers, strict=True)
        )
    return replace(disc, castings=castings)
