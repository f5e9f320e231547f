"""How far ahead the limit point of a path is, estimated from the path's first two derivatives where it is now.

Near a limit point the state is x* − a √(λ* − λ), so the ratio of its second derivative by λ to the first is
1 / 2(λ* − λ). Strains (Green's) are compared rather than displacements: a body that bends far turns most of its nodes,
but what balloons stretches. They are compared where they grow most, since one chamber may balloon alone.

The derivatives are x' = K⁻¹f and x" = −K⁻¹r" with the second derivative r" of the residual along x', a difference
quotient: two back-solves with the tangent's factorisation, and three residuals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pneumorph.interrupts import stop_if_asked
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State, deformation_gradients
from pneumorph.mechanics.solve.balance import places, pressure_force, residual_at, supported
from pneumorph.mechanics.solve.border import border_at, given_pressures, missing_volumes
from pneumorph.mechanics.solve.prediction import ENOUGH

STEP = 1e-5
"""Of the difference quotients: the largest motion of a node, relative to the diagonal of the body."""

FARTHEST = 1e3
"""Where pressures have to grow by more than this factor for such a motion, no limit point is near."""


def limit_ahead(at: Configuration, tangent: Tangent, state: State) -> float:
    """Estimate the factor λ of the pressures at which the path has its next limit point; infinite where none is ahead.

    Parameters
    ----------
    at : Configuration
        With the pressures that are scaled; all other loads stay.
    tangent : Tangent
        With the last factorisation, if there is one.
    state : State
        Its equilibrium.
    """
    vector, size = at.model.vector(state), at.model.size
    border = None if at.enclosed is None else border_at(at, tangent, state)
    along = tangent.solve_at(at, state, supported(at, pressure_force(at, state, given_pressures(at))), ENOUGH)
    # By λ, what the pressures change by: those of enclosed chambers follow.
    rise = given_pressures(at)
    if border is not None and at.enclosed is not None:
        along = border.solution(along)
        rise[at.enclosed.rows(at.model)] = along[size:]
        along = along[:size]
    small = _small(at, vector, along)
    if small > FARTHEST:
        return math.inf

    def there(share: float) -> Configuration:
        return replace(at, loads=at.loads._replace(pressure=np.asarray(at.loads.pressure) + share * rise))

    def second(of: Callable[[float], np.ndarray]) -> np.ndarray:
        return (of(small) - 2.0 * of(0.0) + of(-small)) / small**2

    bent = second(lambda share: residual_at(there(share), vector + share * along))
    curved = tangent.solve_at(at, state, supported(at, -bent), ENOUGH)
    if border is not None:
        short = second(lambda share: missing_volumes(there(share), at.model.state(vector + share * along)))
        curved = border.solution(curved, -short)[:size]
    before, here, after = (
        _strains(at, vector + share * along + 0.5 * share**2 * curved) for share in (-small, 0.0, small)
    )
    rate, growth = (after - before) / (2.0 * small), (after - 2.0 * here + before) / small**2
    faster = _where_most(rate, growth)
    return 1.0 + 0.5 / faster if faster > 0.0 else math.inf


def _small(at: Configuration, vector: np.ndarray, along: np.ndarray) -> float:
    """The share of a direction (n,) along which nodes move by `STEP`."""
    far = np.abs(places(at, vector + along) - places(at, vector)).max()
    return STEP * float(np.linalg.norm(np.ptp(at.X, axis=0))) / max(float(far), 1e-300)


def _strains(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """Green's strains (3, 3, 4, M) at the quadrature points."""
    stop_if_asked()
    tets = at.model.tets.nodes[: at.model.elements]
    F = deformation_gradients(tets, at.X, displacement(at.model.tip, at.X, at.model.state(vector)))
    return 0.5 * (np.einsum("ki...,kj...->ij...", F, F) - np.eye(3)[:, :, None, None])


def _where_most(rate: np.ndarray, growth: np.ndarray) -> float:
    """The growth of strains per λ over their rate, at the points where they grow most.

    Points where they slow down do not count: what begins to touch a wall does so faster than anything balloons.
    """
    along = (rate * growth).sum(axis=(0, 1))
    weight = np.where(along > 0.0, (growth * growth).sum(axis=(0, 1)), 0.0)
    steady = float((weight * (rate * rate).sum(axis=(0, 1))).sum())
    return float((weight * along).sum()) / steady if steady > 0.0 else 0.0
