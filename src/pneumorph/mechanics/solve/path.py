"""Equilibrium paths: the states of a body as its pressures grow in proportion, through limit points and beyond.

The pressures are λ p̂; all other loads stay. Past a limit point, where a chamber balloons, λ falls while the body keeps
moving. So the arc length is prescribed and λ is found with the state, by Newton's method on the bordered system
(Riks 1979; Crisfield 1981; Keller 1977)

    [ K   −f ] [dx]   [−R]
    [ tᵀ   0 ] [dλ] = [ 0],   f = Σ p̂_c ∂V_c/∂x,

with two back-solves with the factorised tangent K, for plain and mixed elements alike. t is the direction K⁻¹f of the
path at the last point, with unit length in the displacements. Where chambers are filled or sealed, the bordered tangent
takes the place of K (`filled.py`), and only the pressures that are given are scaled: what is filled in, or the gas,
stays. So a limit point is one under the control that each chamber has.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.doing import doing
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.metrics import Metrics, metrics_after
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    RUNAWAY_STRETCH,
    applied_force,
    free_share,
    length,
    pressure_force,
    residual_at,
    smallest_ratio,
    supported,
)
from pneumorph.mechanics.solve.border import border_at, given_pressures, missing_volumes, volume_at_rest, with_pressures
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, in_words, read_off, settled
from pneumorph.mechanics.solve.filled import EXACT_VOLUME
from pneumorph.mechanics.solve.saddle import Iterate, metrics_along_step, reduced_with
from pneumorph.mechanics.solve.search import solve

TOLERANCE = 1e-8
"""Relative residual, over the norm of the applied forces, at which a point has converged."""

MOST_POINTS, MOST_SECONDS = 100, 600.0
"""A path ends after this many points, or this much time."""

FIRST_RISE = 0.05
"""Fraction of the pressures that the first step adds."""

STRAIGHT, BENT = 0.97, 0.7
"""Cosines of the angle between the directions at neighbouring points: above the first, steps grow; below the second, a
step is rejected, since it may have jumped to another path."""

SHORTEST = 1e-3
"""Shortest step, relative to the first."""

MOST_CORRECTIONS, CONTRACTION = 15, 0.3
"""Most corrections per point, and the ratio of two corrections above which the tangent is factorised again."""


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
class Path:
    """A path of equilibria.

    Attributes
    ----------
    points : in order along the path, the first of them where it begins.
    limits : limit points, where the pressures have an extremum, dλ/ds = 0.
    reason : why the path ends, as part of a sentence.
    """

    points: tuple[PathPoint, ...]
    limits: tuple[PathPoint, ...]
    reason: str


@dataclass(frozen=True)
class _Place:
    """A point of the path and its direction there: dx/ds (n,), with unit length in the displacements, and dλ/ds.

    `across` is dx/ds without the hydrostatic unknowns; it measures the distance along the path. Pressures of enclosed
    chambers follow the other unknowns, as if they were hydrostatic ones.
    """

    point: PathPoint
    at: Configuration
    vector: np.ndarray
    direction: np.ndarray
    across: np.ndarray
    slope: float

    @property
    def unknowns(self) -> np.ndarray:
        """Those of the state (n,), without the pressures of enclosed chambers."""
        return self.vector[: self.at.model.size]


def follow(
    at: Configuration,
    tangent: Tangent,
    volume: float | None = None,
    load: float | None = None,
    first_limit: bool = False,
    most: int = MOST_POINTS,
    seconds: float = MOST_SECONDS,
    since: Equilibrium | None = None,
) -> Path | NoEquilibrium:
    """Follow the path of equilibria that starts without pressure, or at the state `since`, where λ is 1.

    Parameters
    ----------
    at : with the pressures p̂ that are scaled; weights, springs and plate loads stay.
    tangent : the linear solver of its model; left factorised at the last point tried.
    volume : mm³; the path ends when the conjugate volume Σ p̂_c V_c / max p̂ reaches it.
    load : the path ends when λ reaches it from below.
    first_limit : whether the path ends at its first limit point.
    most, seconds : limits on the number of points and the time.
    since : an equilibrium at the pressures p̂.

    Returns
    -------
    NoEquilibrium if there is no state without pressures to start from, or no pressure to raise.
    """
    began = time.perf_counter()
    if not np.any(given_pressures(at)):
        return NoEquilibrium("no chamber has a pressure that a path could follow", 0.0, None)
    reached, begins = (0.0, _loaded(at, 0.0)) if since is None else (1.0, at)
    begin = since or solve(begins, tangent)
    if isinstance(begin, NoEquilibrium):
        return begin
    begins = begins if since is not None else settled(begins, begin)
    try:
        here = _place(at, begins, tangent, begin, reached, None)
    except SingularMatrix:
        return NoEquilibrium("the tangent where the path begins is singular", reached, begin)

    def ended(places: Sequence[_Place], limits: Sequence[PathPoint]) -> str:
        if limits and first_limit:
            return "the pressures have reached their limit"
        if len(places) >= most:
            return f"{most} points were asked for at most"
        if time.perf_counter() - began > seconds:
            return f"{seconds:g} s have passed"
        return _ended(at, places[-1], volume, load)

    with doing("following the path of equilibria to its limit pressure") as far:
        return _followed(at, tangent, here, ended, far)


def _followed(
    at: Configuration,
    tangent: Tangent,
    here: _Place,
    ended: Callable[[Sequence[_Place], Sequence[PathPoint]], str],
    far: Callable[[str], None],
) -> Path:
    """`follow` from its first place on, until there is a reason to end; `far` is told how far it has come."""
    places: list[_Place] = [here]
    limits: list[PathPoint] = []
    step = first = FIRST_RISE / here.slope
    while True:
        far(f"point {len(places)} at {_in_words(at, here.point.load)}")
        if reason := ended(places, limits):
            break
        following = _advance(at, tangent, here, step)
        if following is None:
            step /= 2
            if step < SHORTEST * first:
                reason = "no step along it could be corrected any more"
                break
            continue
        if here.slope * following.slope < 0:
            limits.append(_limit(at, tangent, here, following, step).point)
        straight = here.across @ following.across > STRAIGHT
        here, step = following, step * (1.25 if straight else 0.8)
        places.append(here)
    return Path(tuple(place.point for place in places), tuple(limits), reason)


def diagnose(at: Configuration, tangent: Tangent, failure: NoEquilibrium) -> Equilibrium | NoEquilibrium:
    """Find out by path following why no stable state was found, and name the limit pressure.

    Where the path leads to a stable state at the full pressures after all, that state is returned.
    """
    path = follow(at, tangent, load=1.0, first_limit=True, most=40, seconds=60.0)
    if isinstance(path, NoEquilibrium):
        return failure
    last = path.points[-1]
    asked = f"{_in_words(at, 1.0)} has no stable state near"
    # A path goes on beyond a bifurcation; its last point is past the limit, where there is one.
    before = path.points[:-1] if path.limits else path.points
    lost = next((point for point in before if not point.equilibrium.stable), None)
    if path.limits and lost is None:
        limit = path.limits[0]
        volumes = ", ".join(f"{volume:.5g} mm³" for volume in limit.equilibrium.volumes.values())
        return NoEquilibrium(
            f"{asked}: pressure reaches its limit at {_in_words(at, limit.load)} (volume {volumes}), beyond it the "
            f"body deforms further {_beyond(at)}",
            limit.load,
            last.equilibrium,
            limit=limit.pressures,
        )
    if last.load >= 1.0:
        there = solve(at, tangent, last.equilibrium.state)
        if isinstance(there, Equilibrium) and there.stable:
            return there
    if lost is not None:
        return NoEquilibrium(
            f"{asked}: the body buckles before {_in_words(at, lost.load)}",
            lost.load,
            last.equilibrium,
            limit=lost.pressures,
        )
    return NoEquilibrium(
        f"{failure.reason}; equilibria were followed up to {_in_words(at, last.load)}, where {path.reason}",
        last.load,
        last.equilibrium,
        limit=last.pressures,
    )


def _in_words(at: Configuration, load: float) -> str:
    """The pressures λ p̂ as text."""
    return in_words(dict(zip(at.model.chambers, load * given_pressures(at), strict=True)))


def _beyond(at: Configuration) -> str:
    """What the pressures do beyond a limit point, in words."""
    pressures = at.loads.pressure[at.loads.pressure != 0.0]
    if np.all(pressures < 0.0):
        return "while the vacuum weakens"
    return "while the pressure falls" if np.all(pressures > 0.0) else "while pressure and vacuum weaken"


def _loaded(at: Configuration, load: float, enclosed: np.ndarray | None = None) -> Configuration:
    """With λ p̂, and with the pressures (k,) of enclosed chambers."""
    if at.enclosed is None or enclosed is None:
        return replace(at, loads=at.loads._replace(pressure=at.loads.pressure * load))
    return with_pressures(
        replace(at, loads=at.loads._replace(pressure=given_pressures(at) * load)), at.enclosed, enclosed
    )


def _ended(at: Configuration, here: _Place, volume: float | None, load: float | None) -> str:
    """Why the path ends at a point; empty where it goes on."""
    point = here.point
    if volume is not None and _conjugate_volume(at, point.equilibrium) >= volume:
        return "the volume that was asked for is reached"
    if load is not None and point.load >= load:
        return "the pressures that were asked for are reached"
    if point.load < 0:
        return "the pressures have fallen to nothing"
    if point.equilibrium.max_stretch > RUNAWAY_STRETCH:
        return f"the largest stretch has passed {RUNAWAY_STRETCH:g}"
    return ""


def _conjugate_volume(at: Configuration, equilibrium: Equilibrium) -> float:
    pressure = given_pressures(at)
    volumes = np.array([equilibrium.volumes[name] for name in at.model.chambers])
    return float(pressure @ volumes / np.abs(pressure).max())


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


def _place(
    at: Configuration,
    here: Configuration,
    tangent: Tangent,
    equilibrium: Equilibrium,
    load: float,
    before: _Place | None,
) -> _Place:
    """The point at an equilibrium of the configuration `here`, with the direction of the path."""
    tangent.move_to(here, equilibrium.state)
    vector, moving = at.model.vector(equilibrium.state), _moving(at)
    along = _along(at, here, tangent, equilibrium.state)
    size = float(np.linalg.norm(moving * along))
    if before is not None and before.across @ along < 0:
        size = -size
    pressures = dict(zip(at.model.chambers, map(float, np.asarray(here.loads.pressure)), strict=True))
    direction = along / size
    if at.enclosed is not None:
        vector = np.append(vector, np.asarray(here.loads.pressure)[at.enclosed.rows(at.model)])
    return _Place(PathPoint(load, pressures, equilibrium), here, vector, direction, moving * direction, 1.0 / size)


def _advance(at: Configuration, tangent: Tangent, here: _Place, step: float) -> _Place | None:
    """The point at distance `step` along the direction at `here`; None where it was not found."""
    before = tangent.factorisations, tangent.solves
    try:
        tangent.move_to(here.at, here.point.equilibrium.state)
        corrected = _corrected(at, tangent, here, step)
        if corrected is None:
            return None
        vector, load, residual = corrected
        there = _loaded(at, load, vector[at.model.size :])
        equilibrium = read_off(there, tangent, at.model.state(vector[: at.model.size]), residual, before)
        following = _place(at, there, tangent, equilibrium, load, here)
    except SingularMatrix:
        return None
    return following if here.across @ following.across > BENT else None


def _corrected(
    at: Configuration, tangent: Tangent, here: _Place, step: float
) -> tuple[np.ndarray, float, float] | None:
    """Unknowns, λ and relative residual at distance `step`, by Newton's method on the bordered system."""
    model, size = at.model, at.model.size
    if free_share(at, here.unknowns, step * here.direction[:size]) < 1.0:
        return None
    vector, load = here.vector + step * here.direction, here.point.load + step * here.slope
    along = here.direction / here.slope
    scale = applied_force(_loaded(at, load, vector[size:]), model.state(vector[:size]))
    previous, fresh = np.inf, False
    metrics: Metrics = ()
    if model.reinforcements:
        was, now = (displacement(model.tip, at.X, model.state(each)) for each in (here.unknowns, vector[:size]))
        metrics = metrics_after(model, at.X, model.state(here.unknowns), now - was)
    for _ in range(MOST_CORRECTIONS):
        there, state = _loaded(at, load, vector[size:]), model.state(vector[:size])
        residual = residual_at(there, vector[:size])
        error = float(np.linalg.norm(residual)) / scale
        if not np.isfinite(error) or smallest_ratio(at, vector[:size]) <= SMALLEST_RATIO:
            return None
        short = np.zeros(0) if at.enclosed is None else missing_volumes(there, state)
        if error <= TOLERANCE and np.abs(short).max(initial=0.0) <= EXACT_VOLUME * volume_at_rest(at):
            return vector, load, error
        point = reduced_with(there, tangent, Iterate(vector[:size], metrics, residual, residual))
        change, rise = _bordered(there, tangent, state, point.reduced, short, along, here.across)
        now = length(at, change[:size])
        if now > CONTRACTION * previous and not fresh:
            tangent.factorise(there, state, metrics=metrics)
            along = _along(at, there, tangent, state)
            point = reduced_with(there, tangent, point)
            change, rise = _bordered(there, tangent, state, point.reduced, short, along, here.across)
            fresh, now = True, length(at, change[:size])
        elif now > 2 * previous:
            return None
        else:
            fresh = False
        if free_share(at, vector[:size], change[:size]) < 1.0:
            return None
        by = metrics_along_step(there, tangent, point, change[:size])
        metrics = tuple(held + each for held, each in zip(metrics, by, strict=True))
        vector, load, previous = vector + change, load + rise, now
    return None


def _bordered(
    there: Configuration,
    tangent: Tangent,
    state: State,
    residual: np.ndarray,
    short: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
) -> tuple[np.ndarray, float]:
    """dx and dλ: the correction at constant λ, moved along the path back to the prescribed distance."""
    change = tangent.precondition(-residual)
    if there.enclosed is not None:
        change = border_at(there, tangent, state, last=True).solution(change, -short)
    rise = -float(across @ change) / float(across @ along)
    return change + rise * along, rise


def _limit(at: Configuration, tangent: Tangent, here: _Place, following: _Place, step: float) -> _Place:
    """The limit point between two points: dλ/ds = 0 of the cubic through both, refined up to twice."""
    low, high = (0.0, here), (step, following)
    best = max(here, following, key=lambda place: abs(place.point.load))
    for _ in range(3):
        (a, left), (b, right) = low, high
        # dλ by the distance along the direction of the first point.
        rises = [place.slope / float(here.across @ place.direction) for place in (left, right)]
        at_limit = _stationary(b - a, left.point.load, right.point.load, *rises)
        there = _advance(at, tangent, here, a + at_limit)
        if there is None:
            return best
        best = there
        if abs(there.slope) * (b - a) < 1e-6 * abs(there.point.load):
            return best
        if there.slope * left.slope > 0:
            low = (a + at_limit, there)
        else:
            high = (a + at_limit, there)
    return best


def _stationary(width: float, left: float, right: float, left_slope: float, right_slope: float) -> float:
    """Where in (0, width) the cubic with these values and slopes at the ends is stationary; the slopes differ in sign.

    Its derivative is quadratic, c + b s + a s² with s in (0, 1).
    """
    c, d, rise = left_slope, right_slope, (right - left) / width
    a, b = 3 * (c + d - 2 * rise), 2 * (3 * rise - 2 * c - d)
    roots = np.roots([a, b, c]) if abs(a) > 1e-12 * (abs(b) + abs(c)) else np.array([-c / b])
    inside = [float(root.real) for root in np.atleast_1d(roots) if abs(root.imag) < 1e-12 and 0 < root.real < 1]
    return width * (inside[0] if inside else c / (c - d))
