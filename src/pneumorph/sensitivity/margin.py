"""The pressure at the next limit point of a path over the working pressure, and its exact derivatives.

At a limit point the tangent K has a null vector w, which is also its left one. Along a change of shape or loads the
limit point stays on the path of equilibria, so wᵀ(∂R/∂X dX + ∂R/∂λ dλ) = 0: the derivatives of λ need no further solve.

Pressures of chambers that are filled or sealed are not scaled: what is filled in, or the gas, stays. The null vector is
that of the bordered tangent then, and its part q of these pressures adds −q·∂(V − v)/∂X, as in `adjoint`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Loads,
    NoEquilibrium,
    PathPoint,
    State,
    Tangent,
    follow,
    limit_near,
)
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.solve.border import border_at, given_pressures
from pneumorph.sensitivity.adjoint import by_known, volumes_by_shape

BEYOND = 1.25
"""Multiple of the bound up to which a path is followed; a body without a limit point up to there is far from it."""


@dataclass(frozen=True, eq=False)
class Margin:
    """The limit point ahead of a state.

    Attributes
    ----------
    load : float
        λ, its given pressures over the working ones; where the path was followed without one, the last λ.
    state : State or None
        Its state; None where there is none, and the derivatives are zero.
    known : bool
        False where the path could not be followed as far as was asked: whether a limit point is ahead is not known.
    estimate : float
        The estimate of λ because of which the path was followed or not, or a bound from that of a design before.
    pressures : {chamber: MPa}
        There; empty without a state.
    """

    load: float
    state: State | None
    estimate: float = math.inf
    pressures: Mapping[str, float] = field(default_factory=dict)
    known: bool = True


def find_margin(
    at: Configuration, tangent: Tangent, equilibrium: Equilibrium, bound: float, near: Margin | None = None
) -> Margin:
    """Follow the path from a state to the limit point ahead, or up to `BEYOND` times the bound, or as far as possible.

    Parameters
    ----------
    at : Configuration
        With the working pressures.
    tangent : Tangent
        Of its model; left at the last point.
    equilibrium : Equilibrium
        The state there.
    bound : float
        Of the margin.
    near : Margin, optional
        The limit point ahead of a state nearby, of the same model: that of this one is looked for near it first.
    """
    far = Margin(BEYOND * bound, None)
    if near is not None and near.state is not None:
        place = limit_near(at, tangent, near.state, near.load)
        if place is not None and place.point.load > 1.0:
            return _at(place.point) if place.point.load < far.load else far
    path = follow(at, tangent, load=far.load, first_limit=True, since=equilibrium)
    if isinstance(path, NoEquilibrium):
        # Without pressure there is no limit.
        return replace(far, load=1.0, known=False) if np.any(given_pressures(at)) else far
    if path.limits:
        return _at(path.limits[0])
    reached = path.points[-1].load
    return far if reached >= far.load else Margin(max(point.load for point in path.points), None, known=False)


def _at(limit: PathPoint) -> Margin:
    return Margin(limit.load, limit.equilibrium.state, pressures=limit.pressures)


def margin_slope(
    at: Configuration, tangent: Tangent, margin: Margin
) -> tuple[np.ndarray, dict[str, float], np.ndarray]:
    """dλ/dX (N, 3), dλ/dp by chamber for the working pressures p (1/MPa), and by sheets and fibres (R, 2)."""
    model = at.model
    if margin.state is None:
        return np.zeros(at.X.shape), dict.fromkeys(model.chambers, 0.0), np.zeros(np.shape(at.loads.reinforcement))
    by_X, by_loads, _ = limit_slope(at, tangent, margin)
    by_pressure = dict(zip(model.chambers, (margin.load * np.asarray(by_loads.pressure)).tolist(), strict=True))
    return by_X, by_pressure, np.asarray(by_loads.reinforcement)


def limit_slope(at: Configuration, tangent: Tangent, margin: Margin) -> tuple[np.ndarray, Loads, np.ndarray]:
    """dλ/dX (N, 3), dλ/dL by the loads L at the limit point, and by what is added to the forces R (n,) there.

    The pressures there are λ times the working ones.

    Parameters
    ----------
    at : with the working pressures.
    tangent : of its model; left at the limit point.
    margin : with a state.
    """
    model, working = at.model, given_pressures(at)
    assert margin.state is not None
    pressure = np.array([margin.pressures[name] for name in model.chambers])
    there = replace(at, loads=at.loads._replace(pressure=pressure))
    tangent.factorise(there, margin.state)
    border = None if at.enclosed is None else border_at(there, tangent, margin.state)
    # Inverse iterations: the eigenvalue is tiny, so each adds many digits.
    vector = np.where(at.constrained, 0.0, np.random.default_rng(0).normal(size=model.size))
    below = np.zeros(0 if border is None else len(border.schur))
    for _ in range(3):
        vector = np.where(at.constrained, 0.0, tangent.precondition(vector))
        if border is not None:
            both = border.solution(vector, below)
            vector, below = both[: model.size], both[model.size :]
        size = float(np.linalg.norm(vector))
        vector, below = vector / size, below / size
    w = model.state(vector)
    ((shape, acting),) = products.pullback(model.potential, at.X, margin.state, there.loads, [w])
    if border is not None:
        shape = shape - volumes_by_shape(there, margin.state, below[None])[0]
    by_pressure = by_known(at, np.asarray(acting.pressure))
    rise = float(by_pressure @ working)
    slopes = Loads(*(-np.asarray(part) / rise for part in acting))
    return -shape / rise, slopes._replace(pressure=-by_pressure / rise), -vector / rise
