"""First-order prediction of how an equilibrium changes with nodes and pressures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.solve.balance import apart, free_share, pressure_force, supported


def predict(at: Configuration, tangent: Tangent, state: State, dX: np.ndarray, dp: np.ndarray) -> State:
    """The state after nodes move by dX (N, 3) mm and pressures by dp (C,) MPa: K du = −∂R/∂X dX − ∂R/∂p dp.

    K is the tangent at `state` in the configuration `at`; it is factorised again if something else was.
    """
    model = at.model
    push = -model.vector(kernels.shape_product(model.potential, at.X, state, at.loads, dX))
    if np.any(dp):
        push = push + pressure_force(at, state, dp)
    vector, change = model.vector(state), tangent.solve_at(at, state, supported(at, push))
    moved = replace(at, X=at.X + dX)
    # Shortened where surfaces would meet on the way, if they do not where the nodes have moved.
    return model.state(vector + (free_share(moved, vector, change) if apart(moved, vector) else 1.0) * change)
