"""How fast a motion changes with the pressure of a chamber, and the exact derivatives of that by shape and loads.

With K v = ∂R/∂p, the state moves by −v where the pressure p grows: the path of equilibria. A motion m has the gradient
∂m/∂X − ∂(wᵀR)/∂X with K w = ∂m/∂u, and its rate along the path has the derivative of that along the path, with w held:

    d²m/dX dp = D[∂m/∂X − ∂(wᵀR)/∂X] − ∂(zᵀR)/∂X,    K z = D[∂m/∂u − K w]

So z is the only further solution. The first derivatives are exact. D is their difference over four states on the
tangent of the path, of fourth order in the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.sensitivity.adjoint import Sloped

BESIDE = 0.01
"""Largest displacement of the nearer states, mm: truncation is then about 1e-9, and rounding less."""


@dataclass(frozen=True)
class PressureRate:
    """The rate of a motion and its derivatives, by X (N, 3) per mm, pressures (1/MPa), and sheets and fibres (R, 2)."""

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


def rate_slopes(
    at: Configuration, tangent: Tangent, state: State, motion: Sloped, accuracy: float
) -> dict[str, PressureRate]:
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
    model, potential = at.model, at.model.potential
    _, _, seed = motion.slope(model, at.X, state)
    w = _solution(at, tangent, state, seed, accuracy)

    def first(there: State, loads: Loads) -> tuple[np.ndarray, Loads, State]:
        """Derivatives of m − wᵀR by X, loads and the unknowns, with w held."""
        _, by_X, by_state = motion.slope(model, at.X, there)
        ((shape, acting),) = products.pullback(potential, at.X, there, loads, [w])
        stiff = products.tangent_product(potential, at.X, there, loads, w)
        return by_X - shape, jax.tree.map(np.negative, acting), jax.tree.map(np.subtract, by_state, stiff)

    rates = {}
    for number, chamber in enumerate(model.chambers):
        rise = jax.tree.map(lambda load: np.zeros(np.shape(load)), at.loads)
        rise = rise._replace(pressure=np.eye(len(model.chambers))[number])
        along = products.load_product(potential, at.X, state, at.loads, rise)
        along = jax.tree.map(np.negative, _solution(at, tangent, state, along, accuracy))
        value = float(model.vector(seed) @ model.vector(along))
        longest = float(np.abs(along.u).max(initial=1e-12))

        def beside(step: float, along: State = along, rise: Loads = rise) -> Any:
            return first(_moved(state, along, step), _moved(at.loads, rise, step))

        direct, acting, by_state = _derivative(beside, BESIDE / longest)
        z = _solution(at, tangent, state, by_state, accuracy)
        ((shape, through),) = products.pullback(potential, at.X, state, at.loads, [z])
        by_pressure = acting.pressure - np.asarray(through.pressure)
        rates[chamber] = PressureRate(
            value,
            direct - shape,
            dict(zip(model.chambers, map(float, by_pressure), strict=True)),
            acting.reinforcement - np.asarray(through.reinforcement),
        )
    return rates


def _solution(at: Configuration, tangent: Tangent, state: State, seed: State, accuracy: float) -> State:
    """K⁻¹ seed, zero where the state is constrained."""
    model = at.model
    return model.state(tangent.solve_at(at, state, np.where(at.constrained, 0.0, model.vector(seed)), accuracy))


def _moved(start: Any, along: Any, step: float) -> Any:
    return jax.tree.map(lambda there, way: np.asarray(there) + step * np.asarray(way), start, along)


def _derivative(function: Callable[[float], Any], step: float) -> Any:
    """The derivative at zero of a function of a number, whose values are trees of arrays; of fourth order."""
    near, behind, far, back = (function(each * step) for each in (1.0, -1.0, 2.0, -2.0))
    return jax.tree.map(
        lambda a, b, c, d: (8.0 * np.subtract(a, b) - np.subtract(c, d)) / (12.0 * step), near, behind, far, back
    )
