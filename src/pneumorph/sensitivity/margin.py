"""The pressure at the next limit point of a path over the working pressure, and its exact derivatives.

At a limit point the tangent K has a null vector w, which is also its left one. Along a change of shape or loads the
limit point stays on the path of equilibria, so wᵀ(∂R/∂X dX + ∂R/∂λ dλ) = 0: the derivatives of λ need no further solve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics import Configuration, Equilibrium, NoEquilibrium, State, Tangent, follow
from pneumorph.mechanics.assembly import products

BEYOND = 1.25
"""Multiple of the bound up to which a path is followed; a body without a limit point up to there is far from it."""


@dataclass(frozen=True, eq=False)
class Margin:
    """The limit point ahead of a state.

    Attributes
    ----------
    load : float
        λ, its pressures over the working ones; where the path was followed without one, the last λ.
    state : State or None
        Its state; None where there is none, and the derivatives are zero.
    estimate : float
        The estimate of λ because of which the path was followed or not, or a bound from that of a design before.
    """

    load: float
    state: State | None
    estimate: float = math.inf


def find_margin(at: Configuration, tangent: Tangent, equilibrium: Equilibrium, bound: float) -> Margin:
    """Follow the path from a state to the limit point ahead, or up to `BEYOND` times the bound.

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
    """
    far = Margin(BEYOND * bound, None)
    path = follow(at, tangent, load=far.load, first_limit=True, since=equilibrium)
    if isinstance(path, NoEquilibrium):
        # Without pressure there is no limit.
        return far
    if not path.limits:
        return Margin(min(path.points[-1].load, far.load), None)
    return Margin(path.limits[0].load, path.limits[0].equilibrium.state)


def margin_slope(
    at: Configuration, tangent: Tangent, margin: Margin
) -> tuple[np.ndarray, dict[str, float], np.ndarray]:
    """dλ/dX (N, 3), dλ/dp by chamber for the working pressures p (1/MPa), and by sheets and fibres (R, 2)."""
    model, working = at.model, np.asarray(at.loads.pressure)
    if margin.state is None:
        return np.zeros(at.X.shape), dict.fromkeys(model.chambers, 0.0), np.zeros(np.shape(at.loads.reinforcement))
    there = replace(at, loads=at.loads._replace(pressure=margin.load * working))
    tangent.factorise(there, margin.state)
    # Inverse iterations: the eigenvalue is tiny, so each adds many digits.
    vector = np.where(at.constrained, 0.0, np.random.default_rng(0).normal(size=model.size))
    for _ in range(3):
        vector = np.where(at.constrained, 0.0, tangent.precondition(vector))
        vector /= np.linalg.norm(vector)
    w = model.state(vector)
    ((shape, acting),) = products.pullback(model.potential, at.X, margin.state, there.loads, [w])
    by_pressure = np.asarray(acting.pressure)
    rise = float(by_pressure @ working)
    pressures = dict(zip(model.chambers, -margin.load * by_pressure / rise, strict=True))
    by_reinforcement = -np.asarray(acting.reinforcement) / rise
    return -shape / rise, {name: float(value) for name, value in pressures.items()}, by_reinforcement
