"""Designs whose error of the mesh is larger than `mesh.error`: their elements are divided where it comes from."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import replace

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    MeshError,
    analyse,
    divided,
    largest_share,
    moved,
    quick_errors,
    to_divide,
)
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize.buckling import rejudge
from pneumorph.optimize.castings import carried
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import Divided, Event, NotDivided
from pneumorph.optimize.iterate import Iterate, evaluate
from pneumorph.optimize.setup import Setup

ROUNDS = 6
"""Most times that elements are divided for a design."""

Solved = tuple[Discretisation, Analysis, Mapping[str, MeshError]]


def fine_enough(setup: Setup, number: int, found: Solved, clock: Clock) -> Generator[Event, None, Solved]:
    """A design on a mesh whose error is as small as asked for; as it was where that is not reached.

    Parameters
    ----------
    setup : of the run.
    number : of the design.
    found : its mesh, its states, and their errors by the mesh.
    clock : counts the time.
    """
    problem, asked = setup.problem, setup.problem.mesh.error
    if asked is None:
        return found
    for _ in range(ROUNDS):
        disc, analysis, errors = found
        share = largest_share(problem, errors)
        if share is None or share <= asked:
            break
        with clock.phase("equilibrium"):
            marked = to_divide(problem, disc, analysis, errors)
            if not len(marked):
                yield NotDivided(number, share, "none of them contributes to it")
                break
            new, states = divided(problem, disc, analysis, marked, setup.mesher.heights)
            if disc.castings:
                new = carried(new, new.morph.positions(analysis.points), disc.castings)
            if scaled_jacobian(new.morph.positions(analysis.points), new.morph.mesh.tets).min() <= 0.0:
                yield NotDivided(number, share, "one would be inverted")
                break
            most = setup.settings.trial.most_on_new_mesh
            there = analyse(problem, setup.space, new, analysis.phi, states, most=most)
            if isinstance(there, NoEquilibrium):
                # A finer mesh is softer, and a body that is near to its limits on a coarse one may have no state there.
                yield NotDivided(number, share, f"on the finer mesh, {there.reason}")
                break
            yield Divided(number, share, new.model.elements, new.model.part)
            found = new, there, quick_errors(problem, new, there)
    return found


def with_finer_mesh(setup: Setup, current: Iterate, clock: Clock) -> Generator[Event, None, Iterate]:
    """The iterate on a finer mesh, if its error is known and larger than asked for.

    Its objective is another one then. Those of earlier designs are changed by as much, so that their gains stay.
    """
    found = yield from fine_enough(setup, current.number, (current.disc, current.analysis, current.errors), clock)
    disc, analysis, errors = found
    if disc is current.disc:
        return current
    lateral = rejudge(disc, analysis, current.lateral.at_rest, current.lateral.load)
    more = analysis.value - current.analysis.value
    earlier = tuple(value + more for value in current.learnt.objectives[:-1])
    learnt = replace(current.learnt, objectives=earlier, looked=moved(setup.problem, analysis))
    design = replace(current.design, analysis=analysis, disc=disc, lateral=lateral)
    return replace(evaluate(setup, current.number, design, learnt, clock), errors=errors)
