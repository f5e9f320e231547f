"""First derivatives of the objective with respect to the design variables: one adjoint for each task or residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace
from pneumorph.problem import Problem
from pneumorph.sensitivity import gradient, residual_jacobian


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
    """Derivatives of an analysed design, exact for the discrete problem, by one adjoint for each task or residual.

    Raises
    ------
    ComputationError
        If an objective has no derivative at this design.
    """
    rest, squares, factors = np.zeros(space.n), np.zeros(space.n), [np.zeros((0, space.n))]
    for task in problem.task:
        if disc.objectives[task.name].residuals is None:
            rest += task.weight * _task_gradient(space, disc, analysis, task.name)
            continue
        residuals, jacobian = _task_jacobian(space, disc, analysis, task.name)
        squares += 2.0 * task.weight * residuals @ jacobian
        factors.append(np.sqrt(2.0 * task.weight) * jacobian)
    return Slopes(rest + squares, rest, np.concatenate(factors))


def design_gradient(problem: Problem, space: DesignSpace, disc: Discretisation, analysis: Analysis) -> np.ndarray:
    """dJ/dΦ (n,) of an analysed design, by one adjoint for each task; raises as `design_slopes` does."""
    return sum(
        (task.weight * _task_gradient(space, disc, analysis, task.name) for task in problem.task), np.zeros(space.n)
    )


def _task_gradient(space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str) -> np.ndarray:
    at, equilibrium = analysis.configurations[name], analysis.equilibria[name]
    found = gradient(at, disc.tangents[name], equilibrium, disc.objectives[name])
    if not np.isfinite(found.X).all():
        raise ComputationError(
            f"the objective of task {name} has no derivative here, like a root or a norm at zero; write it with squares"
        )
    return space.pullback(disc.morph.pullback(found.X), {name: found.pressure})


def _task_jacobian(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (k,) of a task and their derivatives (k, n) with respect to Φ."""
    at, equilibrium = analysis.configurations[name], analysis.equilibria[name]
    found = residual_jacobian(at, disc.tangents[name], equilibrium, disc.objectives[name])
    rows = [
        space.pullback(disc.morph.pullback(X), {name: dict(zip(disc.model.chambers, pressure, strict=True))})
        for X, pressure in zip(found.X, found.pressure, strict=True)
    ]
    return found.residuals, np.array(rows)
