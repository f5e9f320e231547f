"""First-order prediction of how an equilibrium changes with nodes, pressures and other loads."""

from __future__ import annotations

from dataclasses import replace

import jax
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


def predict_change(at: Configuration, tangent: Tangent, state: State, there: Configuration) -> State:
    """The state after loads and nodes become those of `there`, to first order. Surfaces may meet in it."""
    model = at.model
    change = jax.tree.map(lambda new, old: np.asarray(new) - np.asarray(old), there.loads, at.loads)
    push = -model.vector(kernels.load_product(model.potential, at.X, state, at.loads, change))
    if there.X is not at.X:
        push = push - model.vector(kernels.shape_product(model.potential, at.X, state, at.loads, there.X - at.X))
    return model.state(model.vector(state) + tangent.solve_at(at, state, supported(at, push)))
