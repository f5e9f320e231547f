"""What a held component d of the plate is pushed with, r = −∂Π/∂d = −eᵀR with e for that component, and its adjoint.

With K w = f q − K e where unknowns are free, r changes by −(e + w)ᵀ∂R + q·∂(V − v). There f = ∂V/∂u, and q belongs to
chambers whose pressure is unknown (`adjoint.py`); their pressures change r by eᵀf too.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.enclosed import volume_slopes
from pneumorph.mechanics.solve.balance import evaluate, supported
from pneumorph.objective import HeldForce
from pneumorph.sensitivity.adjoint import with_border


def held_force_value(at: Configuration, state: State, force: HeldForce) -> float:
    """The force (N) or moment (N·mm) at an equilibrium, with its sign, of the whole body."""
    _, forces = evaluate(at, state)
    return -_factor(at, force) * float(forces[-6 + force.number])


def held_force(
    at: Configuration, tangent: Tangent, state: State, force: HeldForce, accuracy: float
) -> tuple[float, np.ndarray, np.ndarray]:
    """The same; its adjoint a (n,), with which it changes by −aᵀ∂R; and what unknown pressures add to that (N, 3).

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    force : HeldForce
    accuracy : float
        Of the solution, see `Tangent.solve_at`.
    """
    model, factor = at.model, _factor(at, force)
    unit = np.zeros(model.size)
    unit[-6 + force.number] = 1.0
    pushed = products.tangent_product(model.potential, at.X, state, at.loads, model.state(unit))
    solved = -tangent.solve_at(at, state, supported(at, model.vector(pushed)), accuracy)
    by_pressure = np.zeros((1, 0))
    if at.enclosed is not None:
        by_pressure = volume_slopes(model, at.X, state)[1][at.enclosed.rows(model)][:, [-6 + force.number]].T
    (solved,), (more,) = with_border(at, tangent, state, solved[None], by_pressure)
    return held_force_value(at, state, force), factor * (unit + solved), factor * more


def _factor(at: Configuration, force: HeldForce) -> float:
    """By which the force on the plate of what is meshed is multiplied; 0 where it vanishes by symmetry."""
    return 0.0 if at.model.odd[force.number] else force.sign * at.model.copies
