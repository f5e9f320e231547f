"""How what is measured at an equilibrium responds to pressures, and the tip to forces: exact, from one factorisation.

With f_c = ∂V_c/∂x a pressure moves the state by K⁻¹f_c, and a force that does the work δy on a measured y by K⁻¹s with
s = ∂y/∂x. So the derivatives by pressures are sᵀK⁻¹f, and the compliance of the tip is sᵀK⁻¹s, which is symmetric. The
residual is linear in the loads, so that the forces of any other change of them are a difference of two residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics import Configuration, Loads, State, Tangent
from pneumorph.mechanics.solve.balance import evaluate, supported
from pneumorph.mechanics.solve.border import border_at
from pneumorph.objective import Objective
from pneumorph.objective.features import NO_SLABS, Features, Slabs
from pneumorph.objective.objective import squares
from pneumorph.objective.rotations import rotation_logarithm
from pneumorph.sensitivity.adjoint import by_known


@dataclass(frozen=True)
class Response:
    """The response of an equilibrium.

    Attributes
    ----------
    values : (k,)
        The tip's translation (mm) and rotation vector (rad), the volumes of the C chambers (mm³), and then positions
        (mm) and rotation vectors (rad) of sections.
    by_pressure : (k, C)
        Per MPa of each chamber; 0 of those whose pressure is found with the state.
    compliance : (6, 6)
        What the tip's motions change by per N and N·mm of the forces that do work on them.
    moved : (C + m, n)
        What the unknowns change by per MPa of each chamber, and by these changes.
    by_change : (k, m)
        By the changes of loads that were given.
    """

    values: np.ndarray
    by_pressure: np.ndarray
    compliance: np.ndarray
    moved: np.ndarray
    by_change: np.ndarray


def measured_of(slabs: Slabs = NO_SLABS, shift: np.ndarray | None = None) -> Objective:
    """What `response` measures, to be made once for many states.

    Parameters
    ----------
    slabs : Slabs
        The sections.
    shift : (K, 6) array, optional
        Poses of the obstacles.
    """

    def values(f: Features) -> jnp.ndarray:
        turns = [rotation_logarithm(turn) for turn in f.section_rotation]
        sections = [part for pair in zip(f.section_position, turns, strict=True) for part in pair]
        # By name, since dictionaries of compiled functions come back in that order.
        volumes = jnp.array([f.volume[name] for name in sorted(f.volume)])
        return jnp.concatenate([f.translation, f.rotation, volumes, *sections])

    measured = squares([(1.0, values)], {}, slabs)
    return Objective(measured.value, slabs, {}, measured.residuals, shift)


def response(
    at: Configuration, tangent: Tangent, state: State, measured: Objective, changes: Sequence[Loads] = ()
) -> Response:
    """The response at an equilibrium; of a part of a body, to forces that have its symmetry.

    Parameters
    ----------
    at, tangent, state : the equilibrium, with the pressures that were found.
    measured : by `measured_of`.
    changes : other loads
        Whose differences from those of the equilibrium are changes by which there are derivatives too; they may differ
        in pressures, weight and what acts on the plate.
    """
    model, chambers = at.model, len(at.model.chambers)
    values, _, seeds = measured.jacobian(model, at.X, state)
    rows = np.array([supported(at, model.vector(seed)) for seed in seeds])
    order = np.arange(len(rows))
    order[6 : 6 + chambers] = 6 + np.argsort(np.argsort(model.chambers))
    values, rows = values[order], rows[order]
    pushed = rows[: 6 + chambers] / model.copies
    if changes:
        own = evaluate(at, state)[1]
        more = [supported(at, own - evaluate(replace(at, loads=other), state)[1]) for other in changes]
        pushed = np.vstack([pushed, more])
    moved = tangent.solve_at(at, state, pushed.T).T
    if at.enclosed is not None:
        border = border_at(at, tangent, state)
        moved = moved + np.linalg.solve(border.schur, border.push.T @ moved.T).T @ border.along.T
    by_pressure = np.array([by_known(at, each) for each in rows @ moved[6 : 6 + chambers].T])
    compliance = rows[:6] @ moved[:6].T
    by_change = rows @ moved[6 + chambers :].T
    return Response(values, by_pressure, 0.5 * (compliance + compliance.T), moved[6:], by_change)
