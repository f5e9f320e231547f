"""The border of the tangent that chambers of unknown pressure add to it (`assembly/enclosed.py`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.enclosed import Enclosed, volume_slopes, volumes_of
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.balance import supported


def with_pressures(at: Configuration, given: Enclosed, pressure: np.ndarray) -> Configuration:
    """The configuration where enclosed chambers have these pressures (k,) in MPa."""
    every = np.array(at.loads.pressure, dtype=float)
    every[given.rows(at.model)] = pressure
    return replace(at, loads=at.loads._replace(pressure=every))


def enclosed_in(at: Configuration) -> Enclosed:
    assert at.enclosed is not None
    return at.enclosed


def pushes(at: Configuration, given: Enclosed, state: State) -> np.ndarray:
    """f (n, k) of what is meshed: by the unknowns, zero where they are constrained."""
    by = volume_slopes(at.model, at.X, state)[1][given.rows(at.model)]
    return np.array([supported(at, each) for each in by]).reshape(len(given.chambers), -1).T


@dataclass(frozen=True, eq=False)
class Border:
    """The border of the tangent at an equilibrium: K⁻¹f (n, k), S (k, k) and V₀ (k,) in mm³."""

    along: np.ndarray
    schur: np.ndarray
    rest: np.ndarray
    push: np.ndarray

    def solution(self, x: np.ndarray, below: np.ndarray | float = 0.0) -> np.ndarray:
        """x and q (n + k,) with K x − f q = a and −fᵀx + v′q = b, from K⁻¹a (n,) and b (k,)."""
        q = np.linalg.solve(self.schur, below + self.push.T @ x)
        return np.concatenate([x + self.along @ q, q])


def given_pressures(at: Configuration) -> np.ndarray:
    """The pressures (C,) in MPa of the chambers that have a given one; 0 of the others."""
    pressure = np.array(at.loads.pressure, dtype=float)
    if at.enclosed is not None:
        pressure[at.enclosed.rows(at.model)] = 0.0
    return pressure


def volume_at_rest(at: Configuration) -> float:
    """The largest volume at rest of the enclosed chambers, as far as they are meshed, mm³; 0 without any."""
    if at.enclosed is None:
        return 0.0
    rows = at.enclosed.rows(at.model)
    return float(volumes_of(at.model, at.X, at.model.state(np.zeros(at.model.size)))[rows].max())


def missing_volumes(at: Configuration, state: State) -> np.ndarray:
    """v − V (k,) in mm³ of what is meshed, at the pressures of a configuration with enclosed chambers."""
    model, given = at.model, enclosed_in(at)
    rows = given.rows(model)
    rest, now = (volumes_of(model, at.X, each)[rows] for each in (model.state(np.zeros(model.size)), state))
    return given.volumes(model.copies * rest, np.asarray(at.loads.pressure)[rows]) / model.copies - now


def border_at(at: Configuration, tangent: Tangent, state: State, last: bool = False) -> Border:
    """The border at an equilibrium, of which the tangent is factorised if it is not yet.

    Parameters
    ----------
    at : Configuration
        With enclosed chambers and their pressures.
    tangent : Tangent
        The linear solver of its model.
    state : State
        The equilibrium.
    last : bool
        Whether the last factorisation takes the place of the tangent.
    """
    model, given = at.model, enclosed_in(at)
    rows, push = given.rows(model), pushes(at, given, state)
    rest = model.copies * volumes_of(model, at.X, model.state(np.zeros(model.size)))[rows]
    along = np.where(at.constrained[:, None], 0.0, tangent.precondition(push)) if last else None
    along = tangent.solve_at(at, state, push) if along is None else along
    slopes = given.slopes(rest, np.asarray(at.loads.pressure)[rows]) / model.copies
    return Border(along, np.diag(slopes) - push.T @ along, rest, push)


def negative_motions(at: Configuration, tangent: Tangent, state: State) -> int:
    """Negative pivots of the tangent with what enclosed chambers add to it, see `assembly/enclosed.py`."""
    pivots = tangent.pivots_at(at, state)
    if at.enclosed is None:
        return pivots
    schur = border_at(at, tangent, state).schur
    return pivots + int(np.count_nonzero(np.linalg.eigvalsh(schur) < 0.0)) - len(schur)
