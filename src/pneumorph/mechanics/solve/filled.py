"""Equilibria of bodies with chambers whose pressure is unknown (`assembly/enclosed.py`), by Newton's method.

The state and the pressures are unknowns together, so that states are found on both sides of a limit point, where the
pressure falls while the volume grows. What is filled in is raised in adaptive steps together with all other loads.

Corrections of both would lead through surfaces that touch. There the state is found at given pressures, which is stable
where it does not balloon, and Newton's method finds the pressures whose volumes are those asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from pneumorph.doing import doing
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.enclosed import Enclosed, volumes_of
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.metrics import Metrics, metrics_after
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    applied_force,
    free_share,
    free_way,
    held,
    length,
    near_share,
    residual_at,
    residual_rounding,
    smallest_ratio,
)
from pneumorph.mechanics.solve.border import border_at, enclosed_in, pushes, with_pressures
from pneumorph.mechanics.solve.saddle import Iterate, metrics_along_step, reduced_with

FIRST, SMALLEST, GROWTH = 1 / 8, 1 / 2048, 1.5
"""The first step and the smallest one, as parts of the way from rest, and by what the next one is longer."""

MOST_CORRECTIONS, CONTRACTION = 15, 0.3
"""Most corrections per step, and the ratio of two corrections above which the tangent is factorised again."""

EXACT_VOLUME = 1e-10
"""Error of a volume, relative to that at rest, that counts as none."""

NEAR_VOLUME, MOST_PRESSURES = 1e-3, 12
"""The same from which on corrections of state and pressures together are tried again, and most pressures in a step."""

MEETING: Final = "meeting"
"""What comes of corrections on whose way surfaces meet."""

Search = Callable[[Configuration, Tangent, State, float], tuple[State, float] | str]
"""Finds a stable state at given pressures, see `equilibrium.find_near`."""


@dataclass(frozen=True, eq=False)
class Filled:
    """A state with its pressures: unknowns (n,), the configuration with all pressures, and the relative residual."""

    at: Configuration
    vector: np.ndarray
    residual: float

    @property
    def state(self) -> State:
        return self.at.model.state(self.vector)


def fill(
    at: Configuration,
    tangent: Tangent,
    begin: Configuration,
    state: State,
    tolerance: float,
    first: float = FIRST,
    search: Search | None = None,
) -> Filled | str:
    """The equilibrium of a configuration with enclosed chambers, from one of another, or why there is none.

    Parameters
    ----------
    at : Configuration
        With enclosed chambers.
    tangent : Tangent
        The linear solver of its model.
    begin : Configuration
        With the same chambers enclosed, and with their pressures among its loads.
    state : State
        Its equilibrium.
    tolerance : float
        Residual over the applied force.
    first : float
        The first step, as a part of the way.
    search : Search, optional
        Where surfaces touch.
    """
    with doing("filling chambers") as far:
        return _filled(at, tangent, begin, state, tolerance, first, search, far)


def _filled(
    at: Configuration,
    tangent: Tangent,
    begin: Configuration,
    state: State,
    tolerance: float,
    first: float,
    search: Search | None,
    far: Callable[[str], None],
) -> Filled | str:
    """`fill`; `far` is told how far it has come."""
    own, before = enclosed_in(at), enclosed_in(begin)
    rows, step, reached = own.rows(at.model), first, 0.0
    last = Filled(begin, at.model.vector(state), 0.0)
    ahead: tuple[np.ndarray, np.ndarray] | None = None
    while reached < 1.0:
        fraction = min(1.0, reached + step)
        far(f"{100 * fraction:.3g} %")
        part = _part_way(begin, at, before.towards(own, fraction), fraction)
        vector, pressure = last.vector, np.asarray(last.at.loads.pressure)[rows]
        if ahead is not None:
            vector, pressure = vector + step * ahead[0], pressure + step * ahead[1]
        if at.model.contact is not None:
            free = free_way(last.at, last.state, part, at.model.state(vector))
            if free < 1.0:
                # What an obstacle presses on goes along with it.
                fraction, vector = reached + free * (fraction - reached), last.vector + free * (vector - last.vector)
                part = _part_way(begin, at, before.towards(own, fraction), fraction)
        try:
            found = _corrected(part, tangent, last, vector, pressure, tolerance)
            if found == MEETING and search is not None:
                found = _by_pressures(part, tangent, vector, pressure, tolerance, search)
        except SingularMatrix:
            found = None
        if not isinstance(found, Filled):
            step = min(step, fraction - reached) / 2
            # Without a way to go in parts, shorter ones are the same.
            if step < SMALLEST or begin is at:
                return f"no equilibrium was found beyond {reached:.3g} of what is filled in and of the loads"
            continue
        moved, rise = found.vector - last.vector, np.asarray(found.at.loads.pressure)[rows] - pressure_of(last, rows)
        ahead = moved / (fraction - reached), rise / (fraction - reached)
        last, reached, step = found, fraction, GROWTH * step
    return last


def _part_way(begin: Configuration, at: Configuration, given: Enclosed, fraction: float) -> Configuration:
    """A fraction of the way from one configuration to another, with what is given of the enclosed chambers there."""
    loads = type(at.loads)(*(one + fraction * (two - one) for one, two in zip(begin.loads, at.loads, strict=True)))
    X = at.X if at.X is begin.X else begin.X + fraction * (at.X - begin.X)
    return replace(at, X=X, loads=loads, enclosed=given)


def _by_pressures(
    at: Configuration, tangent: Tangent, vector: np.ndarray, pressure: np.ndarray, tolerance: float, search: Search
) -> Filled | None:
    """The state and the pressures near a guess of both, from states at given pressures; None if these lead nowhere.

    Parameters
    ----------
    at, tangent : what is solved.
    vector, pressure : (n,) and (k,) the guess.
    tolerance : relative residual of the states.
    search : which finds them.
    """
    model, given, previous = at.model, enclosed_in(at), np.inf
    rows, copies = given.rows(model), model.copies
    for _ in range(MOST_PRESSURES):
        there = with_pressures(at, given, pressure)
        answer = search(there, tangent, model.state(vector), tolerance)
        if isinstance(answer, str):
            return None
        state, residual = answer
        border = border_at(there, tangent, state)
        short = (given.volumes(border.rest, pressure) - copies * volumes_of(model, at.X, state)[rows]) / copies
        error = float(np.abs(short).max() * copies / border.rest.max())
        found = Filled(there, model.vector(state), residual)
        rise = np.linalg.solve(-border.schur, short)
        change = border.along @ rise
        free = free_share(there, found.vector, change)
        vector, pressure = found.vector + free * change, pressure + rise
        if error <= NEAR_VOLUME and free == 1.0:
            both = _corrected(at, tangent, found, vector, pressure, tolerance)
            if isinstance(both, Filled):
                return both
        if error <= max(EXACT_VOLUME, tolerance):
            return found
        if error > previous or np.any(given.gas & (pressure <= -given.atmosphere)):
            return None
        previous = error
    return None


def nearest_pressure(at: Configuration, state: State) -> np.ndarray:
    """The pressures (k,) of the enclosed chambers that balance a state best; of a gas, that of its volume."""
    model, given = at.model, enclosed_in(at)
    rows = given.rows(model)
    rest, now = (volumes_of(model, at.X, each)[rows] for each in (model.state(np.zeros(model.size)), state))
    pressure = np.where(given.gas, given.pressures(rest, now), 0.0)
    known, liquid = with_pressures(at, given, pressure), ~given.gas
    push = pushes(at, given, state)[:, liquid]
    # R = 0 in the least squares.
    pressure[liquid] = np.linalg.lstsq(push, residual_at(known, model.vector(state)), rcond=None)[0]
    return pressure


def pressure_of(found: Filled, rows: np.ndarray) -> np.ndarray:
    """The pressures (k,) of the chambers in some rows."""
    return np.asarray(found.at.loads.pressure)[rows]


def _corrected(
    at: Configuration, tangent: Tangent, last: Filled, vector: np.ndarray, pressure: np.ndarray, tolerance: float
) -> Filled | Literal["meeting"] | None:
    """The state and the pressures near a guess of both; None where corrections do not get on.

    `MEETING` where they would lead through surfaces.
    """
    model, given = at.model, enclosed_in(at)
    rows, copies = given.rows(model), model.copies
    rest = copies * volumes_of(model, at.X, model.state(np.zeros(model.size)))[rows]
    vector, previous, fresh = held(at, vector), np.inf, False
    metrics: Metrics = ()
    if model.reinforcements:
        was, now = (displacement(model.tip, at.X, model.state(each)) for each in (last.vector, vector))
        metrics = metrics_after(model, at.X, model.state(last.vector), now - was)
    for _ in range(MOST_CORRECTIONS):
        there, state = with_pressures(at, given, pressure), model.state(vector)
        residual = residual_at(there, vector)
        size = float(np.linalg.norm(residual))
        if not np.isfinite(size) or smallest_ratio(at, vector) <= SMALLEST_RATIO:
            return None
        short = (given.volumes(rest, pressure) - copies * volumes_of(model, at.X, state)[rows]) / copies
        scale = applied_force(there, state)
        exact = np.abs(short).max() <= EXACT_VOLUME * rest.max() / copies
        if exact and (size <= tolerance * scale or (fresh and size <= residual_rounding(there, vector))):
            return Filled(there, vector, size / scale)
        first = previous == np.inf
        if first:
            tangent.factorise(there, state, metrics=metrics)
        point = reduced_with(there, tangent, Iterate(vector, metrics, residual, residual))
        change, rise = _bordered(there, tangent, given, rest, pressure, state, point.reduced, short)
        now = length(at, change)
        if now > CONTRACTION * previous and not fresh:
            tangent.factorise(there, state, metrics=metrics)
            point = reduced_with(there, tangent, point)
            change, rise = _bordered(there, tangent, given, rest, pressure, state, point.reduced, short)
            fresh, now = True, length(at, change)
        elif now > 2 * previous:
            return None
        else:
            fresh = first
        if not np.isfinite(now) or (model.contact is not None and near_share(at, vector, change) < 1.0):
            return None
        if free_share(at, vector, change) < 1.0:
            return MEETING
        by = metrics_along_step(there, tangent, point, change)
        metrics = tuple(one + each for one, each in zip(metrics, by, strict=True))
        vector, pressure, previous = vector + change, pressure + rise, now
        if np.any(given.gas & (pressure <= -given.atmosphere)):
            return None
    return None


def _bordered(
    at: Configuration,
    tangent: Tangent,
    given: Enclosed,
    rest: np.ndarray,
    pressure: np.ndarray,
    state: State,
    residual: np.ndarray,
    short: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """dx and dp of the bordered system, with the last factorisation."""
    push = pushes(at, given, state)
    solved = tangent.precondition(np.column_stack([-residual, push]))
    solved = np.where(at.constrained[:, None], 0.0, solved)
    still, along = solved[:, 0], solved[:, 1:]
    slopes = given.slopes(rest, pressure) / at.model.copies
    rise = np.linalg.solve(push.T @ along - np.diag(slopes), short - push.T @ still)
    return still + along @ rise, rise
