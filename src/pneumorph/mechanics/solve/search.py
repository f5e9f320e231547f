"""The search for the equilibrium of a body under given loads.

Plain elements minimise the potential (`descent.py`). Mixed ones, where the equilibrium is a saddle point, use Newton's
method (`saddle.py`). Both look for stable states; where there is none, `NoEquilibrium` has the reason.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import jax
import numpy as np

from pneumorph.doing import doing
from pneumorph.mechanics.assembly.linear import SingularMatrix, TooCostly
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import Guess, State, volume_ratio
from pneumorph.mechanics.solve.balance import (
    applied_force,
    bulk_over_shear,
    free_share,
    free_way,
    relative_residual,
    squeezed,
    unloaded,
)
from pneumorph.mechanics.solve.border import with_pressures
from pneumorph.mechanics.solve.descent import ROUGH, minimise
from pneumorph.mechanics.solve.equilibrium import TOLERANCE, Equilibrium, NoEquilibrium, in_words, read_off, rest
from pneumorph.mechanics.solve.filled import FIRST, Filled, Search, fill, nearest_pressure, pressure_of
from pneumorph.mechanics.solve.fitting import fitted
from pneumorph.mechanics.solve.landing import Unheld, landed, unheld
from pneumorph.mechanics.solve.prediction import MOST_BEFORE, along_path, guess_after, predict_change
from pneumorph.mechanics.solve.saddle import find_stable

SMALLEST_FRACTION = 1 / 20
"""Fraction of the load that is still halved once when the load is stepped up."""

FIRST_RESHAPED, FIRST_MOVED = 1 / 2, 1 / 8
"""Fractions of the way in the first step: where nodes move from one design to another, and where obstacles or a plate
that is held move."""

SMALLEST_FIRST = 1 / 512
"""The same in the first step: a membrane at rest is far softer than under any load."""

FEW, EASY = 8, 4
"""Factorisations after which a long step is given up, and up to which the next one is longer: what searches find after
dozens of them costs more than two steps half as long."""

SMALLEST_MOVE = 1e-4
"""`SMALLEST_FRACTION` where obstacles move, which may have to be less than the gap to what they press on."""


def solve(
    at: Configuration,
    tangent: Tangent,
    start: State | Guess | None = None,
    tolerance: float = TOLERANCE,
    since: tuple[Configuration, State] | None = None,
    most: float = math.inf,
    roughest: float = math.inf,
    earlier: Sequence[tuple[State, float]] = (),
) -> Equilibrium | NoEquilibrium:
    """Find the equilibrium of a configuration.

    Newton's method goes to the full load at once from `start`. Without a start, or if that fails, the load is raised in
    adaptive steps: from `since`, another configuration of the same model with its equilibrium, or else from rest,
    weights and plate loads first, then pressures. Where the nodes of `since` are in other places, they are moved in the
    same steps. A state has converged when its residual is `tolerance` times the norm of the applied forces. The search
    ends after `most` factorisations, and does not begin where the start's own residual is more than `roughest` κ/μ
    times the applied forces: from so far away it would hardly lead anywhere. A state found from the start
    may cost one more, for its stability.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    start : State or Guess, optional
        Where the search begins.
    tolerance : float
        Residual over the applied force at which it ends.
    since : (Configuration, State), optional
        An equilibrium from which the load may be raised.
    most : float
        Most factorisations.
    roughest : float
        Largest residual of the start, over κ/μ times the applied force.
    earlier : sequence of (State, float)
        The equilibria before `since`, in order, and at which fractions of the way from there they were, below 0, if the
        loads went the same way.
    """
    before = tangent.factorisations, tangent.solves
    tangent.max_factorisations = tangent.factorisations + most
    try:
        # Starts may be anywhere: what is not finite is seen by its value.
        with np.errstate(over="ignore", invalid="ignore"):
            found = _searched(at, tangent, start, tolerance, since, before, roughest, earlier)
        if isinstance(found, Equilibrium) and (loose := unheld(at, tangent, found.state)) is not None:
            return NoEquilibrium(loose, 1.0, None)
        return found
    except SingularMatrix:
        return NoEquilibrium("the tangent is singular", 0.0, None)
    except Unheld as error:
        return NoEquilibrium(str(error), 0.0, None)
    except TooCostly:
        return NoEquilibrium(f"no equilibrium found in {most:g} factorisations", 0.0, None)
    finally:
        tangent.max_factorisations = math.inf


def _searched(
    at: Configuration,
    tangent: Tangent,
    start: State | Guess | None,
    tolerance: float,
    since,
    before,
    roughest: float,
    earlier: Sequence[tuple[State, float]],
) -> Equilibrium | NoEquilibrium:
    """The search of `solve`."""
    if at.enclosed is not None:
        return _filled(at, tangent, start, tolerance, since, before)
    if start is not None:
        with suppress(Unheld):
            begin = _begin(at, start)
            if roughest < math.inf and not relative_residual(at, begin.state) <= roughest * bulk_over_shear(at):
                return NoEquilibrium("there is no equilibrium near the predicted state", 0.0, None)
            found = _search(at, tangent, begin, tolerance, checked=False)
            if not isinstance(found, str):
                most = tangent.max_factorisations - before[0]
                # It is not given up for what the search has cost.
                tangent.max_factorisations = math.inf
                answer = read_off(at, tangent, *found, before)
                if answer.negative_pivots and not at.model.mixed:
                    # Seldom: steps have ended where there is no minimum. It may take as many factorisations again.
                    again: tuple[State, float] | str = ""
                    with suppress(TooCostly, SingularMatrix), tangent.spending(most):
                        again = _search(at, tangent, begin, tolerance)
                    if not isinstance(again, str):
                        return read_off(at, tangent, *again, before)
                return answer
    if since is not None:
        begin, state = since
        return _raise(at, begin, state, tangent, before, tolerance, earlier)
    return _step_up(at, tangent, before, tolerance)


def _filled(at: Configuration, tangent: Tangent, start: State | Guess | None, tolerance: float, since, before):
    """The search of `solve` where pressures are unknown."""
    assert at.enclosed is not None
    found: Filled | str = ""
    search = None if at.model.contact is None else find_near
    if start is not None:
        state = start.state if isinstance(start, Guess) else start
        begin = with_pressures(at, at.enclosed, nearest_pressure(at, state))
        found = fill(begin, tangent, begin, state, tolerance, 1.0, search)
    if isinstance(found, str) and since is not None:
        begin, state = since
        # The steps of a sweep are short; one that is not is divided. Chambers that are emptied may collapse in one.
        whole = FIRST if _emptied(at) else 1.0
        found = fill(at, tangent, begin, state, tolerance, whole, search)
    if isinstance(found, str):
        found = _from_rest(at, tangent, tolerance, search)
    if isinstance(found, str):
        return NoEquilibrium(found, 0.0, None)
    pressures = pressure_of(found, at.enclosed.rows(at.model))
    equilibrium = read_off(found.at, tangent, found.state, found.residual, before)
    return replace(equilibrium, enclosed=dict(zip(at.enclosed.chambers, map(float, pressures), strict=True)))


def _from_rest(at: Configuration, tangent: Tangent, tolerance: float, search: Search | None) -> Filled | str:
    """Fill chambers from rest, and load what is filled; where that leads nowhere, both at once.

    A membrane hardly bears its loads before it is filled. A chamber that is emptied collapses, and the loads decide in
    which way.
    """
    assert at.enclosed is not None
    begin, state, last = replace(unloaded(at), enclosed=at.enclosed.part(0.0)), rest(at.model), ""
    if not _emptied(at) and (np.any(at.loads.wrench) or np.any(at.loads.acceleration)):
        full = replace(unloaded(at), enclosed=at.enclosed)
        last = fill(full, tangent, begin, state, tolerance, search=search)
        if isinstance(last, Filled):
            last = fill(at, tangent, last.at, last.state, tolerance, 1.0, search)
    return last if isinstance(last, Filled) else fill(at, tangent, begin, state, tolerance, search=search)


def _emptied(at: Configuration) -> bool:
    """Whether a chamber has less than at rest."""
    filled = at.enclosed
    return filled is not None and bool(np.any(np.where(filled.gas, filled.filling, filled.added) < 0.0))


def find_near(at: Configuration, tangent: Tangent, start: State | Guess, tolerance: float) -> tuple[State, float] | str:
    """A stable state near `start` with its relative residual, or the reason why none was found.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        Factorised on the way.
    start : State or Guess
        Where the search begins.
    tolerance : float
        Relative residual of an equilibrium.
    """
    return _search(at, tangent, _begin(at, start), tolerance)


def _begin(at: Configuration, start: State | Guess) -> Guess:
    """Where a search begins: free obstacles are let down, and displacements fitted to the gradients that are known."""
    guess = start if isinstance(start, Guess) else Guess(start)
    begin, F = landed(at, guess.state), guess.gradients
    # What is fitted might go through a surface, and so might steps along which Π rises.
    if at.model.contact is not None:
        return Guess(begin, metrics=guess.metrics)
    if F is None:
        return replace(guess, state=begin)
    return replace(guess, state=fitted(at, begin, F) if relative_residual(at, begin) > ROUGH else begin)


def _search(
    at: Configuration, tangent: Tangent, begin: Guess, tolerance: float, checked: bool = True
) -> tuple[State, float] | str:
    """`find_near`, from where a search begins; `checked` is as for `minimise`."""
    if at.model.mixed:
        return find_stable(at, tangent, begin, tolerance)
    if at.model.reinforcements:
        found = find_stable(at, tangent, begin, tolerance)
        if not isinstance(found, str) and tangent.negative_pivots == 0:
            return found
    ratios = begin.ratios
    if ratios is None and begin.gradients is not None:
        ratios = volume_ratio(begin.gradients)
    return minimise(at, tangent, begin.state, tolerance, ratios, checked)


def _step_up(at: Configuration, tangent: Tangent, before, tolerance: float) -> Equilibrium | NoEquilibrium:
    """Raise the load from rest: weights and plate loads first, under which the body sags, then the pressures.

    Where it does not bear the first, all together.
    """
    loads, begin, state = at.loads, unloaded(at), rest(at.model)
    if np.any(loads.acceleration) or np.any(loads.wrench):
        sagging = replace(at, loads=unloaded(at).loads._replace(acceleration=loads.acceleration, wrench=loads.wrench))
        # Relative to the full load: the forces of a small weight may be lost in rounding errors of the residual.
        near = tolerance * max(1.0, applied_force(at, state) / applied_force(sagging, state))
        sag = _raise(sagging, begin, state, tangent, before, near)
        if not (np.any(loads.pressure) or np.any(loads.shift) or np.any(loads.held)):
            return sag
        # What does not bear its loads without its pressure may bear both together.
        if isinstance(sag, Equilibrium):
            begin, state = sagging, sag.state
    return _raise(at, begin, state, tangent, before, tolerance)


def _raise(
    whole: Configuration,
    begin: Configuration,
    state: State,
    tangent: Tangent,
    before,
    tolerance: float,
    earlier: Sequence[tuple[State, float]] = (),
) -> Equilibrium | NoEquilibrium:
    """Raise the load from an equilibrium of `begin` to the loads of `whole`, in adaptive steps; nodes may move too.

    Every step begins where the state before it is predicted to lead. Without contact, sheets and fibres the path is
    extrapolated from the second step on. Long steps of plain elements are given up soon; others take more
    factorisations anyway.
    """
    at, ahead, residual, reached, reason, passed = begin, None, 0.0, 0.0, "", deque(earlier, MOST_BEFORE)
    reshaped = not np.array_equal(whole.X, begin.X)
    still = (np.array_equal(getattr(whole.loads, part), getattr(begin.loads, part)) for part in ("shift", "held"))
    moving = reshaped or not all(still)
    step = FIRST_RESHAPED if reshaped else FIRST_MOVED if moving else 1.0
    plain, smooth = whole.model.plain, whole.model.contact is None and not whole.model.reinforcements
    while reached < 1.0:
        short = SMALLEST_MOVE if moving else SMALLEST_FRACTION
        smallest = short if moving or reached else SMALLEST_FIRST
        fraction = min(1.0, reached + step)
        # At the full load use the caller's own configuration, so that its factorisation is recognised.
        part = part_way(begin, whole, fraction)
        ahead = predict_change(at, tangent, state, whole) if ahead is None else ahead
        start = between(state, ahead, (fraction - reached) / (1.0 - reached))
        if moving and whole.model.contact is not None and (free := free_way(at, state, part, start)) < 1.0:
            # What an obstacle presses on goes along with it.
            fraction, start = reached + free * (fraction - reached), between(state, start, free)
            part = part_way(begin, whole, fraction)
        start = without_meeting(part, state, start)
        divisible, spent = plain and fraction - reached >= 2 * short, tangent.factorisations
        # Shares of the way that is left.
        back = [(one, (share - reached) / (1.0 - reached)) for one, share in passed] if smooth else []
        further = along_path(part, state, ahead, back, (fraction - reached) / (1.0 - reached))
        with doing(_where(part, fraction)):
            guess = guess_after(at, state, part, start) if further is None else Guess(further)
            found = _found_soon(part, tangent, guess, tolerance, FEW if divisible else math.inf)
            if isinstance(found, str) and (step < short or (whole.model.contact is not None and not moving)):
                # Near a limit load, and where surfaces come near, a prediction may lead farther away.
                found = find_near(part, tangent, state, tolerance)
        if isinstance(found, str):
            reason, step = found, min(step, fraction - reached) / 2
            if step < smallest / 2:
                nearest = None if at is begin else read_off(at, tangent, state, 0.0, before)
                why = f"{reason}{squeezed(at, at.model.vector(state))}"
                return NoEquilibrium(f"no equilibrium found {_where(part, fraction)}: {why}", reached, nearest)
            continue
        passed.append((state, reached))
        (state, residual), reached, at, ahead = found, fraction, part, None
        step *= 1.5 if not divisible or tangent.factorisations - spent <= EASY else 1.0
    return read_off(at, tangent, state, residual, before)


def _found_soon(
    at: Configuration, tangent: Tangent, start: Guess, tolerance: float, most: float
) -> tuple[State, float] | str:
    """`find_near` in a few factorisations; if that takes more than are left at all, the search ends."""
    try:
        with tangent.spending(most):
            return find_near(at, tangent, start, tolerance)
    except TooCostly:
        if tangent.factorisations >= tangent.max_factorisations:
            raise
        return f"none was found in {most:g} factorisations"


def part_way(begin: Configuration, whole: Configuration, fraction: float) -> Configuration:
    """The configuration at a fraction of the way from one to another; at its end the other one itself."""
    if fraction == 1.0:
        return whole
    X = whole.X if whole.X is begin.X else between(begin.X, whole.X, fraction)
    return replace(whole, X=X, loads=between(begin.loads, whole.loads, fraction))


def without_meeting(at: Configuration, state: State, end: State) -> State:
    """The state on the way from one to another before surfaces meet; the other one if they do not."""
    model = at.model
    if model.contact is None or end is state:
        return end
    vector = model.vector(state)
    change = model.vector(end) - vector
    return model.state(vector + free_share(at, vector, change) * change)


def between(one, other, part: float):
    """Interpolate or extrapolate linearly between two loads, or two states."""
    return jax.tree.map(lambda a, b: a + part * (b - a), one, other)


def _where(at: Configuration, fraction: float) -> str:
    """The loads near which no equilibrium was found, in words."""
    pressures = at.loads.pressure
    if np.any(at.loads.shift):
        return f"at {fraction:.2g} of the way of the obstacles"
    if np.any(at.loads.held):
        return f"at {fraction:.2g} of the way of the plate"
    if not np.any(pressures):
        return f"at {fraction:.2g} of the weight and the plate's loads"
    return f"near {in_words(dict(zip(at.model.chambers, pressures, strict=True)))}"
