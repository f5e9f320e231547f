"""First derivatives of the objective with respect to the design variables: one adjoint for each task or residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.analyse import DESIGN_ACCURACY, Analysis, Discretisation
from pneumorph.analysis.castings import TaskState
from pneumorph.analysis.workspace import axes_of, workspace_slope
from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Softest
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.objective import Gap, StrainShare
from pneumorph.problem import Problem
from pneumorph.sensitivity import gradient, lateral_slope, objective_slope, residual_jacobian

NEAR = 0.7
"""Part of the bound on strains below which no step leads beyond it: steps are told of it above only."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """First derivatives of the objective of an analysed design with respect to Φ.

    Attributes
    ----------
    total : (n,) dJ/dΦ.
    rest : (n,) the part of dJ/dΦ from tasks whose objective is not a sum of squares.
    factors : (k, n) W, with WᵀW the Gauss–Newton Hessian of the tasks whose objective is a sum of squares.
    """

    total: np.ndarray
    rest: np.ndarray
    factors: np.ndarray


def design_slopes(problem: Problem, space: DesignSpace, disc: Discretisation, analysis: Analysis) -> Slopes:
    """Derivatives of an analysed design as the loop needs them, by one adjoint for each task or residual.

    Those of the discrete problem, to `DESIGN_ACCURACY`.

    Parameters
    ----------
    problem, space, disc : the problem, its design space and the mesh of the design.
    analysis : of the design.

    Raises
    ------
    ComputationError
        If an objective has no derivative at this design.
    """
    rest, squares, factors = np.zeros(space.n), np.zeros(space.n), [np.zeros((0, space.n))]
    spanning = axes_of(disc.objectives)
    rest += _workspace_gradient(problem, space, disc, analysis, DESIGN_ACCURACY)
    for task in problem.task:
        if task.name in spanning:
            continue
        states = analysis.states(disc, task.name)
        weight, objective = task.weight / len(states), disc.objectives[task.name]
        with doing(f"task {task.name}"):
            for each in states:
                if objective.residuals is None:
                    rest += weight * _gradient(space, disc, task.name, each, DESIGN_ACCURACY)
                    continue
                residuals, jacobian = _jacobian(space, disc, task.name, each)
                squares += 2.0 * weight * residuals @ jacobian
                factors.append(np.sqrt(2.0 * weight) * jacobian[jacobian.any(axis=1)])
    return Slopes(rest + squares, rest, np.concatenate(factors))


def design_gradient(problem: Problem, space: DesignSpace, disc: Discretisation, analysis: Analysis) -> np.ndarray:
    """dJ/dΦ (n,) of an analysed design, exact, by one adjoint for each task; as `design_slopes`.

    Parameters
    ----------
    problem, space, disc : the problem, its design space and the mesh of the design.
    analysis : of the design.

    Raises
    ------
    ComputationError
        If an objective has no derivative at this design.
    """
    parts, spanning = [_workspace_gradient(problem, space, disc, analysis, EXACT)], axes_of(disc.objectives)
    for task in problem.task:
        if task.name in spanning:
            continue
        states = analysis.states(disc, task.name)
        parts += [task.weight / len(states) * _gradient(space, disc, task.name, each, EXACT) for each in states]
    return sum(parts, np.zeros(space.n))


def strain_shares(disc: Discretisation, analysis: Analysis) -> dict[str, float]:
    """The largest stretch of every task over the stated range of its rubber, see `objective.strain`."""
    return {
        name: StrainShare().at(disc.model, at.X, analysis.equilibria[name].state)
        for name, at in analysis.configurations.items()
    }


def strain_slopes(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, bound: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same for all tasks (k,), and the derivatives (k, n) with respect to Φ, by one adjoint each; 0 far from it.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    bound : of the limit.
    """
    values, rows = [], []
    for name, share in strain_shares(disc, analysis).items():
        at = analysis.configurations[name]
        if share < NEAR * bound:
            values.append(share)
            rows.append(np.zeros(space.n))
            continue
        derivatives = gradient(at, disc.tangents[name], analysis.equilibria[name], StrainShare(), DESIGN_ACCURACY)
        values.append(derivatives.value)
        rows.append(
            space.pullback(disc.morph.pullback(derivatives.X), {name: derivatives.pressure}, derivatives.reinforcement)
        )
    return np.array(values), np.array(rows)


def gap_slope(space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str, gap: Gap) -> np.ndarray:
    """Derivatives (n,) with respect to Φ of a gap in the state of a task.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    name : of the task.
    gap : on that mesh.
    """
    at = analysis.configurations[name]
    found = gradient(at, disc.tangents[name], analysis.equilibria[name], gap, DESIGN_ACCURACY)
    return space.pullback(disc.morph.pullback(found.X), {name: found.pressure}, found.reinforcement)


def lateral_slope_of(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str, softest: Softest
) -> np.ndarray:
    """Derivatives (n,) with respect to Φ of the stiffness against a lateral motion in the state of a task.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    name : of the task.
    softest : the motion.
    """
    at, tangent, state = analysis.configurations[name], disc.tangents[name], analysis.equilibria[name].state
    by_X, by_pressure, by_reinforcement = lateral_slope(at, tangent, state, softest, DESIGN_ACCURACY)
    return space.pullback(disc.morph.pullback(by_X), {name: by_pressure}, by_reinforcement)


def _workspace_gradient(
    problem: Problem, space: DesignSpace, disc: Discretisation, analysis: Analysis, accuracy: float
) -> np.ndarray:
    """Derivatives (n,) of what the tasks of a workspace add to J; 0 without one."""
    spanning = axes_of(disc.objectives)
    if not spanning:
        return np.zeros(space.n)
    weight = sum(task.weight for task in problem.task if task.name in spanning)
    states = disc.objectives, analysis.configurations, analysis.equilibria
    with doing("workspace"):
        return -weight * workspace_slope(space, disc.morph, *states, disc.tangents, accuracy)


def _gradient(space: DesignSpace, disc: Discretisation, name: str, state: TaskState, accuracy: float) -> np.ndarray:
    """Derivatives (n,) of the objective of a task in a state of it, with respect to Φ."""
    derivatives = objective_slope(state.at, state.tangent, state.equilibrium, disc.objectives[name], accuracy)
    if not np.isfinite(derivatives.X).all():
        raise ComputationError(
            f"the objective of task {name} has no derivative here, like a root or a norm at zero; write it with squares"
        )
    pressure, reinforcement = state.by_design(derivatives.pressure, derivatives.reinforcement)
    return space.pullback(disc.morph.pullback(derivatives.X), {name: pressure}, reinforcement)


def _jacobian(space: DesignSpace, disc: Discretisation, name: str, state: TaskState) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (k,) of a task in a state of it, and their derivatives (k, n) with respect to Φ."""
    derivatives = residual_jacobian(state.at, state.tangent, state.equilibrium, disc.objectives[name], DESIGN_ACCURACY)
    rows = np.zeros((len(derivatives.residuals), space.n))
    for row, X, pressure, reinforcement in zip(
        rows, derivatives.X, derivatives.pressure, derivatives.reinforcement, strict=True
    ):
        if X.any() or pressure.any() or reinforcement.any():
            by_chamber, by_data = state.by_design(dict(zip(disc.model.chambers, pressure, strict=True)), reinforcement)
            row[:] = space.pullback(disc.morph.pullback(X), {name: by_chamber}, by_data)
    return derivatives.residuals, rows
