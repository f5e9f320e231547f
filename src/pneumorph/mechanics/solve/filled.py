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
    squeezed,
)
from pneumorph.mechanics.solve.border import border_at, enclosed_in, pushes, with_pressures
from pneumorph.mechanics.solve.saddle import GROWN, Iterate, metrics_along_step, reduced_with

FIRST, SMALLEST, GROWTH = 1 / 8, 1 / 2048, 1.5
"""The first step and the smallest one, as parts of the way from rest, and by what the next one is longer."""

MOST_CORRECTIONS, SMALLEST_SHARE = 20, 1 / 16
"""Most corrections per step, and the smallest part of one with a new factorisation that is tried."""

CONTRACTION, WORTH = 0.3, 6
"""The tangent is factorised again where the ratio of two corrections is above the first, and where it would take more
of them than the second: so many cost as much as a factorisation."""

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
            vector, pressure = (
                old + (fraction - reached) * by for old, by in zip((vector, pressure), ahead, strict=True)
            )
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
                why = squeezed(last.at, last.vector)
                return f"no equilibrium was found beyond {reached:.3g} of what is filled in and of the loads{why}"
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


@dataclass(frozen=True, eq=False)
class _Place:
    """A state and its pressures on the way to an equilibrium.

    Attributes
    ----------
    at : Configuration
        With the pressures.
    iterate : Iterate
    pressure : (k,) MPa
    short : (k,) mm³
        What is missing of the volumes, of what is meshed.
    """

    at: Configuration
    iterate: Iterate
    pressure: np.ndarray
    short: np.ndarray


def _place(
    at: Configuration, rest: np.ndarray, vector: np.ndarray, pressure: np.ndarray, metrics: Metrics
) -> _Place | None:
    """A place; None where an element is turned inside out, or the pressure of a gas has no volume."""
    model, given = at.model, enclosed_in(at)
    if smallest_ratio(at, vector) <= SMALLEST_RATIO or np.any(given.gas & (pressure <= -given.atmosphere)):
        return None
    there = with_pressures(at, given, pressure)
    residual = residual_at(there, vector)
    if not np.isfinite(residual).all():
        return None
    volumes = model.copies * volumes_of(model, at.X, model.state(vector))[given.rows(model)]
    short = (given.volumes(rest, pressure) - volumes) / model.copies
    return _Place(there, Iterate(vector, metrics, residual, residual), pressure, short)


def _corrected(
    at: Configuration, tangent: Tangent, last: Filled, vector: np.ndarray, pressure: np.ndarray, tolerance: float
) -> Filled | Literal["meeting"] | None:
    """The state and the pressures near a guess of both; None where corrections do not get on.

    `MEETING` where they would lead through surfaces. As in `saddle.py`, a step is taken where the next correction is
    smaller, and that is the next step as long as fewer such steps are left than cost as much as a factorisation.
    """
    model = at.model
    rest = model.copies * volumes_of(model, at.X, model.state(np.zeros(model.size)))[enclosed_in(at).rows(model)]
    vector, metrics = held(at, vector), ()
    if model.reinforcements:
        was, now = (displacement(model.tip, at.X, model.state(each)) for each in (last.vector, vector))
        metrics = metrics_after(model, at.X, model.state(last.vector), now - was)
    here, direction, fresh = _place(at, rest, vector, pressure, metrics), None, False
    for _ in range(MOST_CORRECTIONS):
        if here is None:
            return None
        vector = here.iterate.vector
        state, size = model.state(vector), float(np.linalg.norm(here.iterate.residual))
        scale = applied_force(here.at, state)
        exact = np.abs(here.short).max() <= EXACT_VOLUME * rest.max() / model.copies
        if exact and (size <= tolerance * scale or (fresh and size <= residual_rounding(here.at, vector))):
            return Filled(here.at, vector, size / scale)
        fresh = direction is None
        if direction is None:
            tangent.factorise(here.at, state, metrics=here.iterate.metrics)
            direction = _correction(here, tangent, rest)
        change, _ = direction
        if not np.isfinite(change).all() or (model.contact is not None and near_share(at, vector, change) < 1.0):
            return None
        if free_share(at, vector, change) < 1.0:
            return MEETING
        moved = _moved(at, tangent, rest, here, direction, SMALLEST_SHARE if fresh else 1.0)
        if moved is None and fresh:
            return None
        if moved is None:
            direction = None
            continue
        here, direction, contraction = moved
        left = np.log(tolerance * scale / max(size, 1e-300)) / np.log(min(contraction, 0.99))
        if contraction > CONTRACTION or left > WORTH:
            direction = None
    return None


def _moved(
    at: Configuration,
    tangent: Tangent,
    rest: np.ndarray,
    here: _Place,
    direction: tuple[np.ndarray, np.ndarray],
    smallest: float,
) -> tuple[_Place, tuple[np.ndarray, np.ndarray], float] | None:
    """The place after a step that passes the test, the next correction, and its size over that of the step.

    Parameters
    ----------
    at, tangent : what is solved.
    rest : (k,) volumes of the chambers at rest, mm³.
    here : where the step begins.
    direction : dx (n,) and dp (k,).
    smallest : the smallest part of it that is tried; it is halved until the next correction is smaller.
    """
    (change, rise), step = direction, 1.0
    before, by = length(at, change), metrics_along_step(here.at, tangent, here.iterate, change)
    while step >= smallest:
        metrics = tuple(one + step * each for one, each in zip(here.iterate.metrics, by, strict=True))
        trial = _place(at, rest, here.iterate.vector + step * change, here.pressure + step * rise, metrics)
        if trial is not None:
            following = _correction(trial, tangent, rest)
            contraction = length(at, following[0]) / max(before, 1e-300)
            if contraction <= (GROWN if metrics else 1 - step / 4):
                return trial, following, contraction if step == 1.0 else 1.0
        step /= 2
    return None


def _correction(here: _Place, tangent: Tangent, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """dx (n,) and dp (k,) of the bordered system at a place, with the last factorisation."""
    at, given = here.at, enclosed_in(here.at)
    point = reduced_with(at, tangent, here.iterate)
    push = pushes(at, given, at.model.state(point.vector))
    solved = tangent.precondition(np.column_stack([-point.reduced, push]))
    solved = np.where(at.constrained[:, None], 0.0, solved)
    still, along = solved[:, 0], solved[:, 1:]
    slopes = given.slopes(rest, here.pressure) / at.model.copies
    rise = np.linalg.solve(push.T @ along - np.diag(slopes), here.short - push.T @ still)
    return still + along @ rise, rise
