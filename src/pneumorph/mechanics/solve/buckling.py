"""Where a body loses its stability under rising loads, and where it goes from there.

Stable states are followed from one load to another in steps, each of which must end near the state that the step
before it predicts. Where even a short step does not, no stable state is near: the body has buckled, or has snapped
through at a limit point, and relaxes to another one (`relaxation.py`), from which the loads go on.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.linear import SingularMatrix, TooCostly
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.equilibrium import (
    TOLERANCE,
    Equilibrium,
    NoEquilibrium,
    between,
    find_near,
    part_way,
    read_off,
    without_meeting,
)
from pneumorph.mechanics.solve.prediction import guess_after, predict_change
from pneumorph.mechanics.solve.relaxation import relax

RESOLUTION, BEYOND = 5e-3, 4
"""Shortest step, relative to the pressures: so exactly is known where stability is lost; and how many of them farther
the body relaxes."""

FIRST = 1 / 4
"""The first step, as a part of the way."""

NEAR = 0.5
"""Largest distance of the next state on a path from the predicted one, over the predicted motion."""

FAR = 4.0
"""Motion over the predicted one from which on a body has gone to another state, if it has lost its stability."""

FEW, MOST = 5, 1000
"""Most factorisations in a step, and on the whole way."""


def through(
    begin: Configuration, state: State, whole: Configuration, tangent: Tangent, found: Equilibrium | NoEquilibrium
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
    found : Equilibrium or NoEquilibrium
        What the search found.

    Returns
    -------
    A stable equilibrium, with the pressures in `buckled` if stability was lost on the way; else `found`.
    """
    known = found if isinstance(found, Equilibrium) and found.stable else None
    if known is not None:
        ahead = predict_change(begin, tangent, state, whole)
        if _distance(whole, known.state, state) <= FAR * _distance(whole, ahead, state):
            return known
    followed = follow_stable(begin, state, whole, tangent, known)
    return found if isinstance(followed, NoEquilibrium) else followed


def follow_stable(
    begin: Configuration, state: State, whole: Configuration, tangent: Tangent, known: Equilibrium | None = None
) -> Equilibrium | NoEquilibrium:
    """Follow stable states from an equilibrium of `begin` to the loads of `whole`, through losses of stability.

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
    known : Equilibrium, optional
        A stable state at `whole`, which is the result if stability is lost on the way.
    """
    before = tangent.factorisations, tangent.solves
    tangent.max_factorisations = tangent.factorisations + MOST
    at, reached, residual, end = begin, 0.0, 0.0, None
    shortest = _shortest(begin, whole)
    step, buckled = max(FIRST, shortest), {}
    try:
        while reached < 1.0:
            fraction = min(1.0, reached + step)
            part = part_way(begin, whole, fraction)
            end = predict_change(at, tangent, state, whole) if end is None else end
            ahead = between(state, end, (fraction - reached) / (1.0 - reached))
            found = _next(at, part, tangent, state, ahead)
            if found is None and step > shortest:
                step = max(step / 4.0, shortest)
                continue
            if found is None:
                pressures = dict(zip(whole.model.chambers, map(float, part.loads.pressure), strict=True))
                if known is not None:
                    return replace(known, buckled=pressures)
                # A little beyond it the body relaxes sooner.
                fraction = min(1.0, reached + BEYOND * shortest)
                part = part_way(begin, whole, fraction)
                ahead = between(state, end, (fraction - reached) / (1.0 - reached))
                found = _relaxed(part, tangent, state)
                if isinstance(found, str):
                    return NoEquilibrium(found, reached, None)
                if not buckled and _distance(part, found[0], state) > FAR * _distance(part, ahead, state):
                    buckled = pressures
            (state, residual), at, reached, step, end = found, part, fraction, 2.0 * step, None
        return replace(read_off(whole, tangent, state, residual, before), buckled=buckled)
    except SingularMatrix:
        return NoEquilibrium("the tangent is singular", reached, None)
    except TooCostly:
        return NoEquilibrium(f"no stable state was found in {MOST} factorisations", reached, None)
    finally:
        tangent.max_factorisations = math.inf


def _shortest(begin: Configuration, whole: Configuration) -> float:
    """The shortest step as a part of the way."""
    pressures = np.array([begin.loads.pressure, whole.loads.pressure])
    change = np.abs(pressures[1] - pressures[0]).max()
    return float(RESOLUTION * np.abs(pressures).max() / change)


def _next(
    at: Configuration, part: Configuration, tangent: Tangent, state: State, ahead: State
) -> tuple[State, float] | None:
    """The next stable state on a path, with its relative residual, from the one before and the predicted one."""
    allowed = tangent.max_factorisations
    start = without_meeting(part, state, ahead)
    tangent.max_factorisations = min(allowed, tangent.factorisations + FEW)
    try:
        found = find_near(part, tangent, guess_after(at, state, part, start), TOLERANCE)
        if isinstance(found, str) or tangent.pivots_at(part, found[0]) > 0:
            return None
    except (SingularMatrix, TooCostly):
        return None
    finally:
        tangent.max_factorisations = allowed
    predicted = _distance(part, ahead, state)
    if _distance(part, found[0], ahead) <= NEAR * predicted:
        return found
    # What comes into contact moves less than predicted.
    stopped = part.model.contact is not None and _distance(part, found[0], state) <= predicted
    return found if stopped else None


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
