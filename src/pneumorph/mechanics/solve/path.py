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
from dataclasses import dataclass

import numpy as np

from pneumorph.doing import doing
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.solve.balance import (
    RUNAWAY_STRETCH,
)
from pneumorph.mechanics.solve.border import given_pressures
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, in_words, settled
from pneumorph.mechanics.solve.place import PathPoint, Place, advance, limit_between, loaded, place_at
from pneumorph.mechanics.solve.search import solve

MOST_POINTS, MOST_SECONDS = 100, 600.0
"""A path ends after this many points, or this much time."""

FIRST_RISE = 0.05
"""Fraction of the pressures that the first step adds."""

LONGER, MISSED = 2.0, 0.01
"""A step is at most this many times as long as the one before it; and its end should be this far from its prediction,
in parts of the step: the next step is made as long as that allows."""

OVERSHOT = 1.1
"""A limit point that is predicted within reach is stepped past, by a tenth of its distance, so that two places enclose
it."""

FEW = 3
"""After a step that took more factorisations than this, or that was halved, the next one is no longer than it."""

SHORTEST = 1e-3
"""Shortest step, relative to the first."""


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
    reached, begins = (0.0, loaded(at, 0.0)) if since is None else (1.0, at)
    begin = since or solve(begins, tangent)
    if isinstance(begin, NoEquilibrium):
        return begin
    begins = begins if since is not None else settled(begins, begin)
    try:
        here = place_at(at, begins, tangent, begin, reached)
    except SingularMatrix:
        return NoEquilibrium("the tangent where the path begins is singular", reached, begin)

    def ended(places: Sequence[Place], limits: Sequence[PathPoint]) -> str:
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
    here: Place,
    ended: Callable[[Sequence[Place], Sequence[PathPoint]], str],
    far: Callable[[str], None],
) -> Path:
    """`follow` from its first place on, until there is a reason to end; `far` is told how far it has come."""
    places: list[Place] = [here]
    limits: list[PathPoint] = []
    step = first = FIRST_RISE / here.slope
    longer = LONGER
    while True:
        far(f"point {len(places)} at {_in_words(at, here.point.load)}")
        if reason := ended(places, limits):
            break
        following = advance(at, tangent, here, step)
        if following is None:
            step, longer = step / 2, 1.0
            if step < SHORTEST * first:
                reason = "no step along it could be corrected any more"
                break
            continue
        if here.slope * following.slope < 0:
            limits.append(limit_between(at, tangent, here, following, step).point)
        if following.point.equilibrium.factorisations > FEW:
            longer = 1.0
        here, step, longer = following, _next(following, step, longer), LONGER
        places.append(here)
    return Path(tuple(place.point for place in places), tuple(limits), reason)


def _next(here: Place, step: float, longer: float) -> float:
    """The length of the step from a place to which one of length `step` led; at most `longer` times that."""
    # Predictions miss by the third power of a step, or the second where how the path bends is not known.
    power = 0.5 if np.any(here.bend) else 1.0
    step *= min(longer, max((MISSED / max(here.missed, 1e-12)) ** power, 0.5))
    to_limit = OVERSHOT * here.to_limit
    return to_limit if 0.0 < to_limit < step else step


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


def _ended(at: Configuration, here: Place, volume: float | None, load: float | None) -> str:
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
