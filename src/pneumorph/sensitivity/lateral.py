"""Derivatives of the stiffness of a body against lateral motions, see `mechanics.solve.lateral`.

λ = wᵀK w / wᵀM w is stationary in w, so its derivatives are those with w held; the masses M are held too, for λ does
not depend on them where it is 0. wᵀK w is the second derivative of Π along w: what it changes by is found from exact
first derivatives at two states beside the given one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.solve.lateral import Softest
from pneumorph.sensitivity.adjoint import by_known, with_border

BESIDE = 1e-3
"""How far beside, in multiples of the motion, whose largest displacement is 1 mm: the error is about 1e-6."""


def lateral_slope(
    at: Configuration, tangent: Tangent, state: State, softest: Softest, accuracy: float
) -> tuple[np.ndarray, dict[str, float], np.ndarray]:
    """dλ/dX (N, 3), dλ/dp by chamber (1/MPa), and by sheets and fibres (R, 2), by one adjoint solve.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        The equilibrium of the part, with its symmetric motions.
    softest : Softest
        Its softest lateral motion.
    accuracy : float
        Of the adjoint, see `Tangent.solve_at`.
    """
    model, potential, motion = at.model, at.model.potential, softest.motion

    def across(function: Callable[[State], Any]) -> Any:
        """The derivative of a function of the state along the motion, over wᵀM w."""
        ahead, behind = (
            function(jax.tree.map(lambda there, along, step=step: there + step * along, state, motion))
            for step in (BESIDE, -BESIDE)
        )
        return jax.tree.map(lambda one, other: np.subtract(one, other) / (2.0 * BESIDE * softest.size), ahead, behind)

    ((direct, acting),) = across(lambda there: products.pullback(potential, at.X, there, at.loads, [motion]))
    by_state = across(lambda there: products.tangent_product(potential, at.X, there, at.loads, motion))
    seed = np.where(at.constrained, 0.0, model.vector(by_state))
    (solved,), (more,) = with_border(at, tangent, state, tangent.solve_at(at, state, seed, accuracy)[None])
    w = model.state(solved)
    ((shape, through),) = products.pullback(potential, at.X, state, at.loads, [w])
    by_pressure = by_known(at, acting.pressure - np.asarray(through.pressure))
    by_reinforcement = acting.reinforcement - np.asarray(through.reinforcement)
    return direct - shape + more, dict(zip(model.chambers, map(float, by_pressure), strict=True)), by_reinforcement
