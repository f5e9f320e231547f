"""How fast a motion changes with the pressure of a chamber or its own force, and exact derivatives by shape and loads.

With K v = ∂R/∂p, the state moves by −v where the pressure p grows: the path of equilibria. A motion m has the gradient
∂m/∂X − ∂(wᵀR)/∂X with K w = ∂m/∂u, and its rate along the path has the derivative of that along the path, with w held:

    d²m/dX dp = D[∂m/∂X − ∂(wᵀR)/∂X] − ∂(zᵀR)/∂X,    K z = D[∂m/∂u − K w]

So z is the only further solution. A force that does work on m itself moves the state by w: the compliance sᵀK⁻¹s with
s = ∂m/∂u is the rate of m with it. As the force acts on what m is of, m counts once more in its derivative:

    d²m/dX df = D[2 ∂m/∂X − ∂(wᵀR)/∂X] − ∂(zᵀR)/∂X,    K z = D[2 ∂m/∂u − K w]

with D along w. The first derivatives are exact. D is their difference over four states on the tangent of the path, of
fourth order in the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.sensitivity.adjoint import Sloped

BESIDE = 0.01
"""Largest displacement of the nearer states, mm: truncation is then about 1e-9, and rounding less."""


@dataclass(frozen=True)
class Rate:
    """A rate, or another value, with derivatives by X (N, 3) per mm, pressures (1/MPa), sheets and fibres (R, 2)."""

    value: float
    X: np.ndarray
    pressure: Mapping[str, float]
    reinforcement: np.ndarray


def pressure_rates(
    at: Configuration, tangent: Tangent, state: State, motion: Sloped, accuracy: float
) -> dict[str, float]:
    """dm/dp by chamber, in the motion's unit per MPa, by one adjoint solve.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    motion : Sloped
        m.
    accuracy : float
        Of the adjoint, see `Tangent.solve_at`.
    """
    _, _, seed = motion.slope(at.model, at.X, state)
    w = _solution(at, tangent, state, seed, accuracy)
    ((_, acting),) = products.pullback(at.model.potential, at.X, state, at.loads, [w])
    return dict(zip(at.model.chambers, map(float, -np.asarray(acting.pressure)), strict=True))


def rate_slopes(at: Configuration, tangent: Tangent, state: State, motion: Sloped, accuracy: float) -> dict[str, Rate]:
    """The same with their derivatives, by one adjoint solve for the motion and two for each chamber.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    motion : Sloped
        m.
    accuracy : float
        Of the adjoints, see `Tangent.solve_at`.
    """
    model = at.model
    _, _, seed = motion.slope(model, at.X, state)
    w = _solution(at, tangent, state, seed, accuracy)
    rates = {}
    for number, chamber in enumerate(model.chambers):
        rise = _none(at.loads)._replace(pressure=np.eye(len(model.chambers))[number])
        along = products.load_product(model.potential, at.X, state, at.loads, rise)
        along = jax.tree.map(np.negative, _solution(at, tangent, state, along, accuracy))
        value = float(model.vector(seed) @ model.vector(along))
        path = _Path(w, along, rise)
        rates[chamber] = _with_derivatives(value, at, tangent, state, motion, path, accuracy)
    return rates


def compliance(at: Configuration, tangent: Tangent, state: State, motion: Sloped, accuracy: float) -> float:
    """dm/df by a force f on the whole body that does the work f δm, in mm/N or rad/(N·mm), by one solution.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    motion : Sloped
        m, in mm or rad.
    accuracy : float
        Of the solution, see `Tangent.solve_at`.
    """
    _, _, seed = motion.slope(at.model, at.X, state)
    w = _solution(at, tangent, state, seed, accuracy)
    return float(at.model.vector(seed) @ at.model.vector(w)) / at.model.copies


def compliance_slope(at: Configuration, tangent: Tangent, state: State, motion: Sloped, accuracy: float) -> Rate:
    """The same with its derivatives, by two solutions.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    motion : Sloped
        m, in mm or rad.
    accuracy : float
        Of the solutions, see `Tangent.solve_at`.
    """
    model = at.model
    _, _, seed = motion.slope(model, at.X, state)
    w = _solution(at, tangent, state, seed, accuracy)
    path = _Path(w, w, _none(at.loads), times=2.0)
    whole = _with_derivatives(float(model.vector(seed) @ model.vector(w)), at, tangent, state, motion, path, accuracy)
    return scaled(whole, 1.0 / model.copies)


def scaled(rate: Rate, factor: float) -> Rate:
    """A multiple of a rate, or of another value with such derivatives."""
    pressure = {chamber: factor * by for chamber, by in rate.pressure.items()}
    return Rate(factor * rate.value, factor * rate.X, pressure, factor * rate.reinforcement)


class _Path(NamedTuple):
    """The adjoint of a motion, how the state and the loads change along a path, and how often the motion counts."""

    adjoint: State
    along: State
    rise: Loads
    times: float = 1.0


def _with_derivatives(
    value: float, at: Configuration, tangent: Tangent, state: State, motion: Sloped, path: _Path, accuracy: float
) -> Rate:
    """A rate along a path with its derivatives, by one solution."""
    model, potential = at.model, at.model.potential
    w, along, rise, times = path

    def beside(step: float) -> tuple[np.ndarray, Loads, State]:
        """Derivatives of m − wᵀR by X, loads and the unknowns beside the state, with w held."""
        there, loads = _moved(state, along, step), _moved(at.loads, rise, step)
        _, by_X, by_state = motion.slope(model, at.X, there)
        ((shape, acting),) = products.pullback(potential, at.X, there, loads, [w])
        stiff = products.tangent_product(potential, at.X, there, loads, w)
        by_unknowns = jax.tree.map(lambda own, by: times * np.asarray(own) - np.asarray(by), by_state, stiff)
        return times * by_X - shape, jax.tree.map(np.negative, acting), by_unknowns

    longest = float(np.abs(along.u).max(initial=1e-12))
    direct, acting, by_state = _derivative(beside, BESIDE / longest)
    z = _solution(at, tangent, state, by_state, accuracy)
    ((shape, through),) = products.pullback(potential, at.X, state, at.loads, [z])
    by_pressure = acting.pressure - np.asarray(through.pressure)
    return Rate(
        value,
        direct - shape,
        dict(zip(model.chambers, map(float, by_pressure), strict=True)),
        acting.reinforcement - np.asarray(through.reinforcement),
    )


def _solution(at: Configuration, tangent: Tangent, state: State, seed: State, accuracy: float) -> State:
    """K⁻¹ seed, zero where the state is constrained."""
    model = at.model
    return model.state(tangent.solve_at(at, state, np.where(at.constrained, 0.0, model.vector(seed)), accuracy))


def _none(loads: Loads) -> Loads:
    return jax.tree.map(lambda load: np.zeros(np.shape(load)), loads)


def _moved(start: Any, along: Any, step: float) -> Any:
    return jax.tree.map(lambda there, way: np.asarray(there) + step * np.asarray(way), start, along)


def _derivative(function: Callable[[float], Any], step: float) -> Any:
    """The derivative at zero of a function of a number, whose values are trees of arrays; of fourth order."""
    near, behind, far, back = (function(each * step) for each in (1.0, -1.0, 2.0, -2.0))
    return jax.tree.map(
        lambda a, b, c, d: (8.0 * np.subtract(a, b) - np.subtract(c, d)) / (12.0 * step), near, behind, far, back
    )
