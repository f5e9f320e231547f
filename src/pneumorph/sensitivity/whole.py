"""The value of an objective with all that it is made of, and its exact derivatives.

Most are functions of a state. The stiffness of the tip is 1/c with its compliance c (`rate.py`). What a held component
of the plate is pushed with is in `held.py`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.mechanics import Configuration, Equilibrium, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.objective import TIP_MOTIONS, HeldForce, Objective, TipStiffness, Workspace
from pneumorph.sensitivity.adjoint import gradient
from pneumorph.sensitivity.held import held_force, held_force_value
from pneumorph.sensitivity.rate import Rate, compliance, compliance_slope, scaled


def objective_value(at: Configuration, tangent: Tangent, state: State, objective: Objective) -> float:
    """J at an equilibrium, with what it has of given pressures.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium, with the pressures that were found.
    objective : Objective
    """
    match objective.instead:
        case None:
            pressures = dict(zip(at.model.chambers, np.asarray(at.loads.pressure).tolist(), strict=True))
            return objective.at(at.model, at.X, state) + objective.of_pressures(pressures)
        case TipStiffness(motion, sign):
            return sign * tip_stiffness(at, tangent, state, motion)
        case HeldForce() as force:
            return held_force_value(at, state, force)
        case Workspace():
            # What a tip spans by itself.
            return 0.0
        case function:
            return function.at(at.model, at.X, state)


def objective_slope(
    at: Configuration, tangent: Tangent, equilibrium: Equilibrium, objective: Objective, accuracy: float = EXACT
) -> Rate:
    """J with its derivatives, by one adjoint, or two for a stiffness.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        See `gradient`.
    equilibrium : Equilibrium
    objective : Objective
    accuracy : float
        Relative, of the adjoints, see `Tangent.solve_at`.
    """
    assert not isinstance(objective.instead, Workspace)
    match objective.instead:
        case TipStiffness(motion, sign):
            return scaled(tip_stiffness_slope(at, tangent, equilibrium.state, motion, accuracy), sign)
        case HeldForce() as force:
            return _held_force_slope(at, tangent, equilibrium.state, force, accuracy)
        case function:
            found = gradient(at, tangent, equilibrium, objective if function is None else function, accuracy)
            return Rate(found.value, found.X, found.pressure, found.reinforcement)


def tip_stiffness(at: Configuration, tangent: Tangent, state: State, motion: str) -> float:
    """The stiffness of the tip against a motion, one of `MOTIONS`, in N/mm or N·mm/rad."""
    return 1.0 / compliance(at, tangent, state, TIP_MOTIONS[motion], EXACT)


def tip_stiffness_slope(at: Configuration, tangent: Tangent, state: State, motion: str, accuracy: float) -> Rate:
    """The same with its derivatives.

    Parameters
    ----------
    at, tangent, state : Configuration, Tangent and State
        Of the equilibrium.
    motion : str
        One of `MOTIONS`.
    accuracy : float
        Of the solutions, see `Tangent.solve_at`.
    """
    soft = compliance_slope(at, tangent, state, TIP_MOTIONS[motion], accuracy)
    return replace(scaled(soft, -(soft.value**-2)), value=1.0 / soft.value)


def _held_force_slope(at: Configuration, tangent: Tangent, state: State, force: HeldForce, accuracy: float) -> Rate:
    model = at.model
    value, adjoint, more = held_force(at, tangent, state, force, accuracy)
    ((shape, acting),) = products.pullback(model.potential, at.X, state, at.loads, [model.state(adjoint)])
    by_pressure = dict(zip(model.chambers, (-np.asarray(acting.pressure)).tolist(), strict=True))
    return Rate(value, more - shape, by_pressure, -np.asarray(acting.reinforcement))
