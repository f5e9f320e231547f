"""Equilibria of bodies with chambers whose pressure is unknown (`assembly/enclosed.py`), by Newton's method.

The state and the pressures are unknowns together, so that states are found on both sides of a limit point, where the
pressure falls while the volume grows. What is filled in is raised in adaptive steps together with all other loads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.enclosed import Enclosed, volume_slopes, volumes_of
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.metrics import Metrics, metrics_after
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    applied_force,
    free_share,
    held,
    length,
    residual_at,
    residual_rounding,
    smallest_ratio,
    supported,
)
from pneumorph.mechanics.solve.saddle import Iterate, metrics_along_step, reduced_with

FIRST, SMALLEST, GROWTH = 1 / 8, 1 / 2048, 1.5
"""The first step and the smallest one, as parts of the way from rest, and by what the next one is longer."""

MOST_CORRECTIONS, CONTRACTION = 15, 0.3
"""Most corrections per step, and the ratio of two corrections above which the tangent is factorised again."""

EXACT_VOLUME = 1e-10
"""Error of a volume, relative to that at rest, that counts as none."""


@dataclass(frozen=True, eq=False)
class Filled:
    """A state with its pressures: unknowns (n,), the configuration with all pressures, and the relative residual."""

    at: Configuration
    vector: np.ndarray
    residual: float

    @property
    def state(self) -> State:
        return self.at.model.state(self.vector)


def with_pressures(at: Configuration, given: Enclosed, pressure: np.ndarray) -> Configuration:
    """The configuration where enclosed chambers have these pressures (k,) in MPa."""
    every = np.array(at.loads.pressure, dtype=float)
    every[given.rows(at.model)] = pressure
    return replace(at, loads=at.loads._replace(pressure=every))


def fill(
    at: Configuration,
    tangent: Tangent,
    begin: Configuration,
    state: State,
    tolerance: float,
    first: float = FIRST,
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
    """
    own, before = _enclosed(at), _enclosed(begin)
    rows, step, reached = own.rows(at.model), first, 0.0
    last = Filled(begin, at.model.vector(state), 0.0)
    ahead: tuple[np.ndarray, np.ndarray] | None = None
    while reached < 1.0:
        fraction = min(1.0, reached + step)
        loads = type(at.loads)(*(one + fraction * (two - one) for one, two in zip(begin.loads, at.loads, strict=True)))
        X = at.X if at.X is begin.X else begin.X + fraction * (at.X - begin.X)
        part = replace(at, X=X, loads=loads, enclosed=before.towards(own, fraction))
        vector, pressure = last.vector, np.asarray(last.at.loads.pressure)[rows]
        if ahead is not None:
            vector, pressure = vector + step * ahead[0], pressure + step * ahead[1]
        try:
            found = _corrected(part, tangent, last, vector, pressure, tolerance)
        except SingularMatrix:
            found = None
        if found is None:
            step = min(step, fraction - reached) / 2
            if step < SMALLEST:
                return f"no equilibrium was found beyond {reached:.3g} of what is filled in and of the loads"
            continue
        moved, rise = found.vector - last.vector, np.asarray(found.at.loads.pressure)[rows] - pressure_of(last, rows)
        ahead = moved / (fraction - reached), rise / (fraction - reached)
        last, reached, step = found, fraction, GROWTH * step
    return last


def nearest_pressure(at: Configuration, state: State) -> np.ndarray:
    """The pressures (k,) of the enclosed chambers that balance a state best: R = 0 in the least squares."""
    given = _enclosed(at)
    none = with_pressures(at, given, np.zeros(len(given.chambers)))
    push = _pushes(at, given, state)
    return np.linalg.lstsq(push, residual_at(none, at.model.vector(state)), rcond=None)[0]


def pressure_of(found: Filled, rows: np.ndarray) -> np.ndarray:
    """The pressures (k,) of the chambers in some rows."""
    return np.asarray(found.at.loads.pressure)[rows]


def _enclosed(at: Configuration) -> Enclosed:
    assert at.enclosed is not None
    return at.enclosed


def _corrected(
    at: Configuration, tangent: Tangent, last: Filled, vector: np.ndarray, pressure: np.ndarray, tolerance: float
) -> Filled | None:
    """The state and the pressures near a guess of both; None where corrections do not get on."""
    model, given = at.model, _enclosed(at)
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
        if not np.isfinite(now) or free_share(at, vector, change) < 1.0:
            return None
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
    push = _pushes(at, given, state)
    solved = tangent.precondition(np.column_stack([-residual, push]))
    solved = np.where(at.constrained[:, None], 0.0, solved)
    still, along = solved[:, 0], solved[:, 1:]
    slopes = given.slopes(rest, pressure) / at.model.copies
    rise = np.linalg.solve(push.T @ along - np.diag(slopes), short - push.T @ still)
    return still + along @ rise, rise


def _pushes(at: Configuration, given: Enclosed, state: State) -> np.ndarray:
    """f (n, k) of what is meshed: by the unknowns, zero where they are constrained."""
    by = volume_slopes(at.model, at.X, state)[1][given.rows(at.model)]
    return np.array([supported(at, each) for each in by]).reshape(len(given.chambers), -1).T


@dataclass(frozen=True, eq=False)
class Border:
    """The border of the tangent at an equilibrium: K⁻¹f (n, k), S (k, k) and V₀ (k,) in mm³."""

    along: np.ndarray
    schur: np.ndarray
    rest: np.ndarray
    push: np.ndarray


def border_at(at: Configuration, tangent: Tangent, state: State) -> Border:
    """The border at an equilibrium, of which the tangent is factorised if it is not yet.

    Parameters
    ----------
    at : Configuration
        With enclosed chambers and their pressures.
    tangent : Tangent
        The linear solver of its model.
    state : State
        The equilibrium.
    """
    model, given = at.model, _enclosed(at)
    rows, push = given.rows(model), _pushes(at, given, state)
    rest = model.copies * volumes_of(model, at.X, model.state(np.zeros(model.size)))[rows]
    along = tangent.solve_at(at, state, push)
    slopes = given.slopes(rest, np.asarray(at.loads.pressure)[rows]) / model.copies
    return Border(along, np.diag(slopes) - push.T @ along, rest, push)


def negative_motions(at: Configuration, tangent: Tangent, state: State) -> int:
    """Negative pivots of the tangent with what enclosed chambers add to it, see `assembly/enclosed.py`."""
    pivots = tangent.pivots_at(at, state)
    if at.enclosed is None:
        return pivots
    schur = border_at(at, tangent, state).schur
    return pivots + int(np.count_nonzero(np.linalg.eigvalsh(schur) < 0.0)) - len(schur)
