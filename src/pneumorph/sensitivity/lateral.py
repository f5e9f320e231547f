"""Derivatives of the stiffness that a body has left against motions to a side, see `mechanics.solve.lateral`.

r = wᵀK w / wᵀK₀ w is stationary in w, so its derivatives are those with w held. wᵀK w is the second derivative of Π
along w; what it changes by is found from exact first derivatives at two states beside the given one.
"""

from __future__ import annotations

import jax
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent, rest
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.terms import Loads
from pneumorph.mechanics.solve.balance import unloaded
from pneumorph.mechanics.solve.lateral import Softest, without_pressure

BESIDE = 1e-3
"""How far beside, in multiples of the motion, whose largest displacement is 1 mm: the error is about 1e-6."""


def lateral_slope(
    at: Configuration, tangent: Tangent, state: State, found: Softest, accuracy: float
) -> tuple[np.ndarray, dict[str, float], np.ndarray]:
    """dr/dX (N, 3), dr/dp by chamber (1/MPa), and by what is laid on (R, 2), by one adjoint solve.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        The equilibrium of the part, with its symmetric motions.
    found : Softest
        Its softest motion to a side.
    accuracy : float
        Of the adjoint, see `Tangent.solve_at`.
    """
    model, motion, still = found.at.model, found.motion, unloaded(found.at)
    bare, start = without_pressure(motion), rest(model)
    stiff = kernels.tangent_product(model.potential, at.X, start, still.loads, bare)
    size = float(model.vector(bare) @ np.where(found.at.constrained, 0.0, model.vector(stiff)))
    direct, acting = _change(found.at, state, motion)
    at_rest, laid = _change(still, start, bare)
    ahead, behind = (
        kernels.tangent_product(model.potential, at.X, _beside(state, motion, sign), at.loads, motion)
        for sign in (1.0, -1.0)
    )
    seed = (model.vector(ahead) - model.vector(behind)) / (2.0 * BESIDE * size)
    w = at.model.state(tangent.solve_at(at, state, np.where(at.constrained, 0.0, seed), accuracy))
    ((shape, through),) = kernels.pullback(at.model.potential, at.X, state, at.loads, [w])
    by_X = (direct - found.ratio * at_rest) / size - shape
    by_pressure = np.asarray(acting.pressure) / size - np.asarray(through.pressure)
    by_laid = (np.asarray(acting.laid) - found.ratio * np.asarray(laid.laid)) / size - np.asarray(through.laid)
    return by_X, dict(zip(model.chambers, map(float, by_pressure), strict=True)), by_laid


def _change(at: Configuration, state: State, motion: State) -> tuple[np.ndarray, Loads]:
    """Derivatives of wᵀK w by the nodes (N, 3) and by the loads, for a motion w."""
    (ahead,), (behind,) = (
        kernels.pullback(at.model.potential, at.X, _beside(state, motion, sign), at.loads, [motion])
        for sign in (1.0, -1.0)
    )
    return jax.tree.map(lambda one, other: (np.asarray(one) - np.asarray(other)) / (2.0 * BESIDE), ahead, behind)


def _beside(state: State, motion: State, sign: float) -> State:
    return jax.tree.map(lambda there, along: there + sign * BESIDE * along, state, motion)
