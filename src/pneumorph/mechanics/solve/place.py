"""Places on a path of equilibria: its direction and how it bends there, and how the next place is found.

From a place x the next one is predicted at a distance s along the path's direction t, to second order,

    x + s t + ½ s² t',    λ + s λ' + ½ s² λ",

and corrected on the plane across t by Newton's method on the bordered system (see `path.py`). Both t' and λ" come from
the same system, with the second derivative of the residual along the path, a difference quotient. Corrections use the
factorisation of the place from which the step begins; where these do not get on, the tangent is factorised again:
long steps with Newton's corrections take fewer factorisations than short ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.metrics import Metrics, metrics_after
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    SMOOTH,
    applied_force,
    free_share,
    length,
    places,
    pressure_force,
    residual_at,
    smallest_ratio,
    supported,
)
from pneumorph.mechanics.solve.border import border_at, given_pressures, missing_volumes, volume_at_rest, with_pressures
from pneumorph.mechanics.solve.equilibrium import Equilibrium, read_off
from pneumorph.mechanics.solve.filled import EXACT_VOLUME
from pneumorph.mechanics.solve.saddle import Iterate, metrics_along_step, reduced_with

TOLERANCE = 1e-8
"""Relative residual, over the norm of the applied forces, at which a place has converged."""

MOST_CORRECTIONS, MOST_TANGENTS, CONTRACTION, GROWN = 15, 5, 0.3, 2.0
"""Most corrections and factorisations for a place; the ratio of two corrections above which the tangent is factorised
again; and that of two of Newton's above which the search ends."""

BENT = 0.7
"""Cosine of the angle between the direction at a place and the one predicted, below which it may be on another path."""

APART = 1e-3
"""Of the difference quotients: the largest motion of a node, relative to the diagonal of the body."""

MOST_TO_LIMIT, EXACT, ENOUGH = 4, 1e-9, 1e-6
"""Most steps to a limit point; the relative error of λ at which they end; and that of λ which the last may leave."""


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium on a path.

    Attributes
    ----------
    load : λ, the ratio of the pressures to those of the configuration.
    pressures : dict by chamber, MPa.
    equilibrium : Equilibrium
        Its `negative_pivots` are those of the tangent at constant pressures.
    """

    load: float
    pressures: dict[str, float]
    equilibrium: Equilibrium


@dataclass(frozen=True)
class Place:
    """A point of the path and its direction there: dx/ds (n,), with unit length in the displacements, and dλ/ds.

    `across` is dx/ds without the hydrostatic unknowns; it measures the distance along the path. Pressures of enclosed
    chambers follow the other unknowns, as if they were hydrostatic ones. `bend` is d²x/ds² (n,), which is across the
    direction, and `slope_rate` d²λ/ds². `missed` is how far the place was from its prediction, in parts of the step.
    """

    point: PathPoint
    at: Configuration
    vector: np.ndarray
    direction: np.ndarray
    across: np.ndarray
    slope: float
    bend: np.ndarray
    slope_rate: float
    missed: float = 0.0

    @property
    def unknowns(self) -> np.ndarray:
        """Those of the state (n,), without the pressures of enclosed chambers."""
        return self.vector[: self.at.model.size]

    @property
    def to_limit(self) -> float:
        """How far dλ/ds = 0 is, to first order: backwards where it is negative."""
        return -self.slope / self.slope_rate if self.slope_rate else float(np.copysign(np.inf, self.slope))

    def ahead(self, step: float) -> tuple[np.ndarray, float]:
        """The unknowns and λ predicted at a distance."""
        return (
            self.vector + step * self.direction + 0.5 * step**2 * self.bend,
            self.point.load + step * self.slope + 0.5 * step**2 * self.slope_rate,
        )


def loaded(at: Configuration, load: float, enclosed: np.ndarray | None = None) -> Configuration:
    """With λ p̂, and with the pressures (k,) of enclosed chambers."""
    if at.enclosed is None or enclosed is None:
        return replace(at, loads=at.loads._replace(pressure=at.loads.pressure * load))
    return with_pressures(
        replace(at, loads=at.loads._replace(pressure=given_pressures(at) * load)), at.enclosed, enclosed
    )


def place_at(
    at: Configuration,
    here: Configuration,
    tangent: Tangent,
    equilibrium: Equilibrium,
    load: float,
    before: np.ndarray | None = None,
) -> Place:
    """The place at an equilibrium of the configuration `here`, with the path's direction.

    Parameters
    ----------
    at : with the pressures p̂.
    here : with those of the equilibrium.
    tangent : of its model; left factorised there.
    equilibrium : on the path.
    load : λ there.
    before : (n,) what the path is to go along rather than against; by default, to where λ rises.
    """
    tangent.move_to(here, equilibrium.state)
    vector, moving = at.model.vector(equilibrium.state), _moving(at)
    along = _along(at, here, tangent, equilibrium.state)
    size = float(np.linalg.norm(moving * along))
    if before is not None and before @ along < 0:
        size = -size
    pressures = dict(zip(at.model.chambers, map(float, np.asarray(here.loads.pressure)), strict=True))
    direction = along / size
    if at.enclosed is not None:
        vector = np.append(vector, np.asarray(here.loads.pressure)[at.enclosed.rows(at.model)])
    point = PathPoint(load, pressures, equilibrium)
    place = Place(point, here, vector, direction, moving * direction, 1.0 / size, np.zeros_like(direction), 0.0)
    return _with_bend(at, tangent, place)


def advance(at: Configuration, tangent: Tangent, here: Place, step: float) -> Place | None:
    """The place at distance `step` along the direction at `here`; None where it was not found."""
    before = tangent.factorisations, tangent.solves
    (ahead, load), moving = here.ahead(step), _moving(at)
    # After a step that has led nowhere, the factorisation is of a state on it.
    known = tangent.is_of(here.at, here.point.equilibrium.state)
    along = np.append(here.direction, here.slope) if known else None
    towards = here.across + step * moving * here.bend
    try:
        found = _corrected(at, tangent, here.unknowns, here.across, ahead, load, along)
        following = None if found is None else _found(at, tangent, *found, towards, before)
    except SingularMatrix:
        return None
    if following is None or towards @ following.across <= BENT * np.linalg.norm(towards):
        return None
    return replace(following, missed=float(np.linalg.norm(moving * (following.vector - ahead))) / abs(step))


def limit_between(at: Configuration, tangent: Tangent, here: Place, following: Place, step: float) -> Place:
    """The limit point between two places at a distance `step`, by Newton's steps along the path from the nearer one."""
    nearer = min(here, following, key=lambda place: abs(place.to_limit))
    found = _at_limit(at, tangent, nearer, step)
    return found or max(here, following, key=lambda place: abs(place.point.load))


def limit_near(at: Configuration, tangent: Tangent, state: State, load: float) -> Place | None:
    """The limit point of the path near that of another configuration of the model, where other nodes or loads are near.

    None where it is not found, or is not one at which stable states end; nor where there is contact, or a chamber is
    filled or sealed.

    Parameters
    ----------
    at : with the pressures p̂.
    tangent : of its model; left factorised at the limit point.
    state, load : the other limit point, and λ there.
    """
    if at.enclosed is not None or at.model.contact is not None:
        return None
    before, there = (tangent.factorisations, tangent.solves), loaded(at, load)
    vector, moving = at.model.vector(state), _moving(at)
    try:
        # Near a limit point the path goes along the softest motion, whatever the state.
        tangent.factorise(there, state)
        along = _along(at, there, tangent, state)
        across = moving * along / np.linalg.norm(moving * along)
        found = _corrected(at, tangent, vector, across, vector, load, np.append(along, 1.0), fresh=True)
        place = None if found is None else _found(at, tangent, *found, across, before)
        place = None if place is None else _at_limit(at, tangent, place, np.inf)
    except SingularMatrix:
        return None
    if place is None or place.slope_rate >= 0.0 or place.point.equilibrium.negative_pivots > 1:
        return None
    return place


def _at_limit(at: Configuration, tangent: Tangent, place: Place, farthest: float) -> Place | None:
    """The limit point near a place, by Newton's steps for dλ/ds = 0 that are no longer than `farthest`."""
    for _ in range(MOST_TO_LIMIT):
        if place.slope**2 <= 2.0 * EXACT * abs(place.slope_rate * place.point.load):
            return place
        there = advance(at, tangent, place, float(np.clip(place.to_limit, -farthest, farthest)))
        if there is None:
            return None
        place = there
    return place if place.slope**2 <= 2.0 * ENOUGH * abs(place.slope_rate * place.point.load) else None


def _found(
    at: Configuration,
    tangent: Tangent,
    vector: np.ndarray,
    load: float,
    residual: float,
    towards: np.ndarray,
    before: tuple[int, int],
) -> Place:
    """The place with the unknowns and λ that were found."""
    there = loaded(at, load, vector[at.model.size :])
    equilibrium = read_off(there, tangent, at.model.state(vector[: at.model.size]), residual, before)
    return place_at(at, there, tangent, equilibrium, load, towards)


def _moving(at: Configuration) -> np.ndarray:
    """1 for the unknowns that measure the distance along the path, 0 for hydrostatic and constrained ones."""
    moving = np.where(at.constrained, 0.0, 1.0)
    moving[at.model.hydrostatic_unknowns] = 0.0
    return moving if at.enclosed is None else np.append(moving, np.zeros(len(at.enclosed.chambers)))


def _along(at: Configuration, here: Configuration, tangent: Tangent, state: State) -> np.ndarray:
    """dx/dλ = K⁻¹f with the last factorisation, at the pressures of `here`."""
    push = pressure_force(at, state, given_pressures(at))
    along = tangent.precondition(supported(at, push))
    return along if at.enclosed is None else border_at(here, tangent, state, last=True).solution(along)


def _with_bend(at: Configuration, tangent: Tangent, here: Place) -> Place:
    """A place with how the path bends there; not with contact, which bends paths where it begins."""
    model, size = at.model, at.model.size
    if model.contact is not None:
        return here
    far = np.abs(places(at, here.unknowns + here.direction[:size]) - places(at, here.unknowns)).max()
    small = APART * float(np.linalg.norm(np.ptp(at.X, axis=0))) / max(float(far), 1e-300)

    def second(of: Callable[[np.ndarray, Configuration], np.ndarray]) -> np.ndarray:
        parts = []
        for share in (-small, 0.0, small):
            vector = here.vector + share * here.direction
            there = loaded(at, here.point.load + share * here.slope, vector[size:])
            parts.append(of(vector[:size], there))
        return (parts[0] - 2.0 * parts[1] + parts[2]) / small**2

    bent = second(lambda vector, there: residual_at(there, vector))
    short = np.zeros(0)
    if at.enclosed is not None:
        short = second(lambda vector, there: missing_volumes(there, model.state(vector)))
    along = np.append(here.direction, here.slope)
    state = here.point.equilibrium.state
    change = _bordered(here.at, tangent, state, bent, short, along, here.across)
    return replace(here, bend=change[:-1], slope_rate=float(change[-1]))


def _corrected(
    at: Configuration,
    tangent: Tangent,
    since: np.ndarray,
    across: np.ndarray,
    vector: np.ndarray,
    load: float,
    along: np.ndarray | None,
    fresh: bool = False,
) -> tuple[np.ndarray, float, float] | None:
    """Unknowns, λ and relative residual of the path where it meets the plane through some unknowns.

    Parameters
    ----------
    at, tangent : see `advance`.
    since : (n,) the unknowns of the state from which these are predicted.
    across : (n,) normal to the plane.
    vector, load : where the search begins.
    along : (n + 1,) K⁻¹f and 1 with the last factorisation, up to a factor; None where it is not to be used.
    fresh : whether it is of the state where the search begins.
    """
    model, size = at.model, at.model.size
    if free_share(at, since, vector[:size] - since) < 1.0:
        return None
    scale = applied_force(loaded(at, load, vector[size:]), model.state(vector[:size]))
    previous, newton, made = np.inf, np.inf, 0
    metrics: Metrics = ()
    if model.reinforcements:
        was, now = (displacement(model.tip, at.X, model.state(each)) for each in (since, vector[:size]))
        metrics = metrics_after(model, at.X, model.state(since), now - was)
    for _ in range(MOST_CORRECTIONS):
        there, state = loaded(at, load, vector[size:]), model.state(vector[:size])
        residual = residual_at(there, vector[:size])
        error = float(np.linalg.norm(residual)) / scale
        if not np.isfinite(error) or smallest_ratio(at, vector[:size]) <= SMALLEST_RATIO:
            return None
        short = np.zeros(0) if at.enclosed is None else missing_volumes(there, state)
        if error <= TOLERANCE and np.abs(short).max(initial=0.0) <= EXACT_VOLUME * volume_at_rest(at):
            return vector, load, error
        point = reduced_with(there, tangent, Iterate(vector[:size], metrics, residual, residual))
        change, now = np.zeros(0), np.inf
        if along is not None:
            change = _bordered(there, tangent, state, point.reduced, short, along, across)
            now = length(at, change[:size])
        # Far from where it was factorised, the tangent's correction of a rough state is not one.
        far = newton == np.inf and error > SMOOTH and not fresh
        if along is None or far or now > CONTRACTION * previous:
            if made == MOST_TANGENTS:
                return None
            tangent.factorise(there, state, metrics=metrics)
            made += 1
            along = np.append(_along(at, there, tangent, state), 1.0)
            point = reduced_with(there, tangent, point)
            change = _bordered(there, tangent, state, point.reduced, short, along, across)
            now = length(at, change[:size])
            if now > GROWN * newton:
                return None
            newton = now
        elif fresh:
            newton, fresh = now, False
        if free_share(at, vector[:size], change[:size]) < 1.0:
            return None
        by = metrics_along_step(there, tangent, point, change[:size])
        metrics = tuple(held + each for held, each in zip(metrics, by, strict=True))
        vector, load, previous = vector + change[:-1], load + float(change[-1]), now
    return None


def _bordered(
    there: Configuration,
    tangent: Tangent,
    state: State,
    residual: np.ndarray,
    short: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
) -> np.ndarray:
    """dx and dλ (n + 1,): the correction at constant λ, moved `along` the path onto the plane `across` it."""
    change = tangent.precondition(-residual)
    if there.enclosed is not None:
        change = border_at(there, tangent, state, last=True).solution(change, -short)
    change = np.append(change, 0.0)
    return change - (float(across @ change[:-1]) / float(across @ along[:-1])) * along
