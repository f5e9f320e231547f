"""Exact derivatives of the discrete problem by adjoints: dJ/dX = ∂J/∂X − ∂(wᵀR)/∂X with K w = ∂J/∂u; K is symmetric.

Where pressures are unknown (`mechanics/assembly/enclosed.py`), the bordered tangent, which is symmetric too, takes the
place of K: with S q = fᵀK⁻¹ ∂J/∂u the adjoint is w = K⁻¹(∂J/∂u + f q), and q·∂(V − v)/∂X is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pneumorph.mechanics import Configuration, Equilibrium, Tangent, rest
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.enclosed import volume_slopes
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.border import border_at
from pneumorph.objective import Objective

NOTHING = 1e-12
"""Derivatives of a residual below this part of the largest of all are rounding errors."""


class Sloped(Protocol):
    """A function of a state with its derivatives, such as an `Objective` or a `StrainShare`.

    Attributes
    ----------
    by_pressure : {chamber: float}
        What it grows by per MPa of given pressures, beside what these do to the state.
    """

    @property
    def by_pressure(self) -> Mapping[str, float]: ...

    def slope(self, model: Model, X: np.ndarray, state: State) -> tuple[float, np.ndarray, State]:
        """Value, and derivatives with respect to X (N, 3) and the unknowns."""
        ...


@dataclass(frozen=True)
class NodalGradient:
    """Gradient of an objective at an equilibrium.

    Attributes
    ----------
    value : float
        J.
    X : (N, 3) array
        dJ/dX per mm of node motion, including the change of the equilibrium.
    pressure : {chamber: float}
        dJ/dp, 1/MPa.
    reinforcement : (R, 2) array
        By stiffnesses and angles of sheets and fibres, per N/mm and per rad.
    adjoint : State
        w.
    """

    value: float
    X: np.ndarray
    pressure: dict[str, float]
    reinforcement: np.ndarray
    adjoint: State


@dataclass(frozen=True)
class NodalJacobian:
    """Derivatives of an objective's k residuals at an equilibrium.

    Attributes
    ----------
    residuals : (k,) array
    X : (k, N, 3) array
        Per mm of node motion, including the change of the equilibrium.
    pressure : (k, C) array
        1/MPa.
    reinforcement : (k, R, 2) array
        Per N/mm and per rad.
    """

    residuals: np.ndarray
    X: np.ndarray
    pressure: np.ndarray
    reinforcement: np.ndarray


def gradient(
    at: Configuration, tangent: Tangent, equilibrium: Equilibrium, objective: Sloped, accuracy: float = EXACT
) -> NodalGradient:
    """Gradient of an objective, or another function of the state, by every node and load: one adjoint solve.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        Factorised at the equilibrium, if its last factorisation is not of a state near it.
    equilibrium : Equilibrium
    objective : Sloped
        The function.
    accuracy : float
        Relative, of the adjoint where the factorisation is of a state nearby (see `Tangent.solve_at`).
    """
    model, state = at.model, equilibrium.state
    value, direct, seed = objective.slope(model, at.X, state)
    solved = tangent.solve_at(at, state, np.where(at.constrained, 0.0, model.vector(seed)), accuracy)
    (solved,), (more,) = with_border(at, tangent, state, solved[None])
    w = model.state(solved)
    ((shape, acting),) = products.pullback(model.potential, at.X, state, at.loads, [w])
    through = dict(zip(model.chambers, by_known(at, -np.asarray(acting.pressure)), strict=True))
    return NodalGradient(
        value=value,
        X=direct - shape + more,
        pressure={chamber: by + objective.by_pressure.get(chamber, 0.0) for chamber, by in through.items()},
        reinforcement=-np.asarray(acting.reinforcement),
        adjoint=w,
    )


def residual_jacobian(
    at: Configuration, tangent: Tangent, equilibrium: Equilibrium, objective: Objective, accuracy: float = EXACT
) -> NodalJacobian:
    """Derivatives of an objective's residuals, from one adjoint for each that moves, all in one call.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        Factorised at the equilibrium, if its last factorisation is of another state (see `Tangent.solve_at`).
    equilibrium : Equilibrium
    objective : Objective
        Of k residuals.
    accuracy : float
        Relative, of the adjoints where the factorisation is one that was lent.
    """
    model, state = at.model, equilibrium.state
    values, direct, seeds = objective.jacobian(model, at.X, state)
    rhs = np.array([np.where(at.constrained, 0.0, model.vector(seed)) for seed in seeds])
    X, pressures = np.zeros(direct.shape), np.zeros((len(values), len(model.chambers)))
    reinforcement = np.zeros((len(values), *np.shape(at.loads.reinforcement)))
    if (own := np.flatnonzero(_moving(rhs, direct))).size:
        solved, more = with_border(at, tangent, state, tangent.solve_at(at, state, rhs[own].T, accuracy).T)
        ws = [model.state(w) for w in solved]
        shapes, acting = zip(*products.pullback(model.potential, at.X, state, at.loads, ws), strict=True)
        X[own] = direct[own] - np.array(shapes) + more
        pressures[own] = [by_known(at, -np.asarray(loads.pressure)) for loads in acting]
        reinforcement[own] = [-np.asarray(loads.reinforcement) for loads in acting]
    return NodalJacobian(values, X, pressures, reinforcement)


def _moving(rhs: np.ndarray, direct: np.ndarray) -> np.ndarray:
    """Which of k residuals (k,) bool change with the state or the shape at all, from these derivatives by them.

    In a part between mirror planes, what would lead out of these is zero for every design.
    """
    sizes = np.array([np.linalg.norm(rhs, axis=1), np.linalg.norm(direct.reshape(len(direct), -1), axis=1)])
    return (sizes > NOTHING * sizes.max(axis=1, keepdims=True, initial=0.0)).any(axis=0)


def with_border(
    at: Configuration, tangent: Tangent, state: State, solved: np.ndarray, by_pressure: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Adjoints (m, n) of the bordered tangent from those of K, and q·∂(V − v)/∂X (m, N, 3); zeros if all is known.

    Parameters
    ----------
    at, tangent, state : an equilibrium, with chambers that may be sealed or filled to a volume.
    solved : (m, n) solutions with K alone.
    by_pressure : (m, k) what unknown pressures change by themselves.
    """
    if at.enclosed is None:
        return solved, np.zeros((len(solved), *at.X.shape))
    border = border_at(at, tangent, state)
    q = np.linalg.solve(border.schur, (by_pressure + solved @ border.push).T).T
    return solved + q @ border.along.T, volumes_by_shape(at, state, q)


def volumes_by_shape(at: Configuration, state: State, q: np.ndarray) -> np.ndarray:
    """q·∂(V − v)/∂X (m, N, 3) for q (m, k), where chambers are sealed or filled to a volume."""
    assert at.enclosed is not None
    model, rows = at.model, at.enclosed.rows(at.model)
    pressure = np.asarray(at.loads.pressure)[rows]
    now, before = (volume_slopes(model, at.X, each)[0][rows] for each in (state, rest(model)))
    by_X = now - at.enclosed.by_rest(pressure)[:, None, None] * before
    return np.tensordot(q, by_X, axes=1)


def by_known(at: Configuration, by_pressure: np.ndarray) -> np.ndarray:
    """Derivatives (C,) by the pressures, without those that are unknown."""
    if at.enclosed is not None:
        by_pressure = by_pressure.copy()
        by_pressure[at.enclosed.rows(at.model)] = 0.0
    return by_pressure
