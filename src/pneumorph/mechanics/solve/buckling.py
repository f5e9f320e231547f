"""Where a body loses its stability under rising loads, and where it goes from there.

A state between two loads is reached by the path of stable states only where it is near the one that the state before
predicts. Else stable states are followed in steps, each of which must end near its prediction. Where even a short step
does not, no stable state is near: the body has buckled, or has snapped through at a limit point, and relaxes to another
one (`relaxation.py`), from which the loads go on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.linear import SingularMatrix, TooCostly
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.equilibrium import TOLERANCE, Equilibrium, NoEquilibrium, in_words, read_off
from pneumorph.mechanics.solve.lateral import masses_of, softest
from pneumorph.mechanics.solve.prediction import guess_after, predict_change
from pneumorph.mechanics.solve.relaxation import relax
from pneumorph.mechanics.solve.search import between, find_near, part_way, without_meeting

RESOLUTION, FINEST, BEYOND = 5e-3, 2e-4, 4
"""Shortest step, relative to the pressures reached: so exactly is known where stability is lost; the same relative to
the way; and how many such steps farther the body relaxes."""

FIRST = 1 / 4
"""The first step, as a part of the way."""

NEAR = 0.5
"""Largest distance of the next state on a path from the predicted one, over the predicted motion."""

FAR = 4.0
"""Motion over the predicted one from which on a body has gone to another state, if it has lost its stability."""

SOON, AGAIN = 4.0, 16.0
"""Shortest steps within which the softest stiffness must reach zero where stability is lost; and how many times shorter
the steps become where it does not."""

FEW, MOST = 5, 600
"""Most factorisations in a step, and on the whole way."""


def through(
    begin: Configuration,
    state: State,
    whole: Configuration,
    tangent: Tangent,
    ahead: State | None,
    found: Equilibrium | NoEquilibrium,
) -> Equilibrium | NoEquilibrium:
    """What a body does between two loads, where a search from one to the other may have passed a loss of stability.

    Parameters
    ----------
    begin : Configuration
        The loads before, on the same nodes.
    state : State
        A stable equilibrium there.
    whole : Configuration
        The loads after.
    tangent : Tangent
        The linear solver of their model.
    ahead : State, optional
        What `state` predicts there.
    found : Equilibrium or NoEquilibrium
        What the search found.

    Returns
    -------
    `found` where that is stable and near what is predicted; else what `follow_stable` finds, so that it does not depend
    on how far the search went at once. Where it finds neither a state nor a loss of stability that the body survives,
    `found`, with the states that were passed.
    """
    if isinstance(found, Equilibrium) and found.stable and ahead and _as_predicted(whole, found.state, ahead, state):
        return found
    followed = follow_stable(begin, state, whole, tangent)
    if isinstance(followed, Equilibrium) or followed.buckled:
        return followed
    return replace(found, way=followed.way)


@dataclass(frozen=True, eq=False)
class Place:
    """A stable state on the way, and the part of the way that is done."""

    at: Configuration
    state: State
    reached: float


def follow_stable(
    begin: Configuration, state: State, whole: Configuration, tangent: Tangent
) -> Equilibrium | NoEquilibrium:
    """Follow stable states from an equilibrium of `begin` to the loads of `whole`, through losses of stability.

    Where stability is lost the body relaxes under loads a little farther, so that its state there does not depend on
    where the way ends. If it ends before them, the way goes back from there.

    Parameters
    ----------
    begin : Configuration
        The loads where it starts, on the same nodes.
    state : State
        A stable equilibrium there.
    whole : Configuration
        The loads where it ends.
    tangent : Tangent
        The linear solver of their model.
    """
    before = tangent.factorisations, tangent.solves
    tangent.max_factorisations = tangent.factorisations + MOST
    here, last, end = Place(begin, state, 0.0), None, None
    step, residual, buckled, way, relaxed = FIRST, 0.0, {}, [(begin, state)], False
    try:
        while here.reached != 1.0:
            back = here.reached > 1.0
            shortest = _shortest(begin, whole, here)
            step = max(step, shortest / AGAIN)
            fraction = max(1.0, here.reached - step) if back else min(1.0, here.reached + step)
            part = part_way(begin, whole, fraction)
            end = predict_change(here.at, tangent, here.state, whole) if end is None else end
            ahead = between(here.state, end, (fraction - here.reached) / (1.0 - here.reached))
            found = _next(here.at, part, tangent, here.state, ahead)
            if found is None and step > shortest:
                step = max(step / 4.0, shortest)
                continue
            if found is None:
                lost = not back and _is_lost(tangent, last, here, shortest)
                if not lost and step > shortest / AGAIN:
                    step /= 4.0
                    continue
                if back or not (lost or whole.model.contact):
                    return _none(buckled, way, here, "none was found near the next one predicted")
                pressures = _pressures(part)
                # A little beyond it the body relaxes sooner.
                fraction = here.reached + BEYOND * shortest
                part = part_way(begin, whole, fraction)
                ahead = between(here.state, end, (fraction - here.reached) / (1.0 - here.reached))
                found = _relaxed(part, tangent, here.state)
                if isinstance(found, str):
                    return _none(buckled, way, here, found)
                gone, predicted = (_distance(part, each, here.state) for each in (found[0], ahead))
                if lost and not buckled and gone > FAR * predicted:
                    buckled = pressures
                last, step, relaxed = None, BEYOND * shortest, True
            else:
                last, step = here, 2.0 * step
            (reached_state, residual), end = found, None
            here = Place(part, reached_state, fraction)
            way += [] if relaxed or fraction == 1.0 else [(part, reached_state)]
        return replace(read_off(whole, tangent, here.state, residual, before), buckled=buckled, way=tuple(way))
    except SingularMatrix:
        return _none(buckled, way, here, "the tangent is singular")
    except TooCostly:
        return _none(buckled, way, here, f"no other was found in {MOST} factorisations")
    finally:
        tangent.max_factorisations = math.inf


def _pressures(at: Configuration) -> dict[str, float]:
    return dict(zip(at.model.chambers, map(float, at.loads.pressure), strict=True))


def _none(buckled: dict[str, float], way: list[tuple[Configuration, State]], here: Place, reason: str) -> NoEquilibrium:
    """Where and why no stable state was followed any farther."""
    limit = _pressures(here.at)
    words = f"stable states were followed up to {in_words(limit)}; {reason}"
    words = f"the body buckles at {in_words(buckled)}; then {words}" if buckled else words
    return NoEquilibrium(words, min(here.reached, 1.0), None, buckled, limit, tuple(way))


def _shortest(begin: Configuration, whole: Configuration, here: Place) -> float:
    """The shortest step as a part of the way."""
    change = np.abs(whole.loads.pressure - begin.loads.pressure).max()
    return max(float(RESOLUTION * np.abs(here.at.loads.pressure).max() / change), FINEST)


def _is_lost(tangent: Tangent, last: Place | None, here: Place, shortest: float) -> bool:
    """Whether stability is about to be lost: the square of the softest stiffness, extrapolated, falls to zero soon.

    That is linear in the loads where a limit point is near. Where a bifurcation is, it falls sooner than it would.
    """
    if last is None:
        return here.reached == 0.0
    masses = masses_of(here.at)
    then, now = (softest(each.at, each.state, tangent, masses).stiffness ** 2 for each in (last, here))
    return now <= (then - now) * SOON * shortest / (here.reached - last.reached)


def _next(
    at: Configuration, part: Configuration, tangent: Tangent, state: State, ahead: State
) -> tuple[State, float] | None:
    """The next stable state on a path, with its relative residual, from the one before and the predicted one."""
    start = without_meeting(part, state, ahead)
    try:
        with tangent.spending(FEW):
            found = find_near(part, tangent, guess_after(at, state, part, start), TOLERANCE)
            if isinstance(found, str) or tangent.pivots_at(part, found[0]) > 0:
                return None
    except (SingularMatrix, TooCostly):
        return None
    return found if _as_predicted(part, found[0], ahead, state) else None


def _as_predicted(at: Configuration, found: State, ahead: State, before: State) -> bool:
    """Whether a state is the one that is predicted after the state before it."""
    predicted = _distance(at, ahead, before)
    if _distance(at, found, ahead) <= NEAR * predicted:
        return True
    # What comes into contact moves less than predicted.
    return at.model.contact is not None and _distance(at, found, before) <= predicted


def _relaxed(part: Configuration, tangent: Tangent, state: State) -> tuple[State, float] | str:
    """The stable state to which a body relaxes, with its relative residual, or why there is none."""
    relaxed = relax(part, tangent, state)
    found = relaxed if isinstance(relaxed, str) else find_near(part, tangent, relaxed, TOLERANCE)
    if isinstance(found, str):
        return found
    return "the body relaxes to an unstable state" if tangent.pivots_at(part, found[0]) > 0 else found


def _distance(at: Configuration, one: State, other: State) -> float:
    """Norm of the difference of the displacements of all nodes, mm."""
    u, v = (displacement(at.model.tip, at.X, each) for each in (one, other))
    return float(np.linalg.norm(u - v))
