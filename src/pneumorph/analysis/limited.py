"""Motions of the tip, its stiffness and its sensitivity to pressure as limits have them: sizes, and linear rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import State
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.objective import COMPONENTS, LIMITED
from pneumorph.sensitivity import (
    gradient,
    pressure_rates,
    rate_slopes,
    residual_jacobian,
    tip_stiffness,
    tip_stiffness_slope,
)

SIDES = 16
"""Directions in which a vector of two components is limited, beside its own: designs that turn it are expected to be
longer by up to 2 % than they are allowed, and are rejected if they are."""


def motion_sizes(disc: Discretisation, analysis: Analysis, name: str, tasks: Iterable[str]) -> dict[str, float]:
    """How large a motion of the tip is in tasks, in mm or degrees; see `objective.limited`.

    Parameters
    ----------
    disc, analysis : the mesh of the design, and its analysis.
    name : str
        Of the motion, a key of `LIMITED`.
    tasks : iterable of str
        Their names.
    """
    # Its square is the sum of the squared components.
    return {
        task: float(np.sqrt(LIMITED[name].at(disc.model, analysis.configurations[task].X, _state(analysis, task))))
        for task in tasks
    }


def motion_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str, tasks: Iterable[str]
) -> tuple[np.ndarray, np.ndarray]:
    """The same as what is limited (k,), with derivatives (k, n) by Φ: its vector's components in directions all round.

    Parameters
    ----------
    space, disc, analysis : the design space, the mesh of the design, and its analysis.
    name : of the motion.
    tasks : names of the tasks.
    """
    rows = []
    for task in tasks:
        at, equilibrium = analysis.configurations[task], analysis.equilibria[task]
        jacobian = residual_jacobian(at, disc.tangents[task], equilibrium, LIMITED[name])
        slopes = [
            space.pullback(disc.morph.pullback(X), {task: dict(zip(disc.model.chambers, by_p, strict=True))}, by_data)
            for X, by_p, by_data in zip(jacobian.X, jacobian.pressure, jacobian.reinforcement, strict=True)
        ]
        rows.append(all_round(jacobian.residuals, np.array(slopes)))
    return _joined(rows)


def least_motions(
    disc: Discretisation, analysis: Analysis, name: str, directions: Mapping[str, float]
) -> dict[str, float]:
    """A motion of the tip in tasks, in mm or degrees, in the direction of each (1.0 or -1.0).

    Parameters
    ----------
    disc, analysis : the mesh of the design, and its analysis.
    name : of the motion, a key of `COMPONENTS`.
    directions : by task.
    """
    return {
        task: sign * COMPONENTS[name].at(disc.model, analysis.configurations[task].X, _state(analysis, task))
        for task, sign in directions.items()
    }


def least_motion_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str, directions: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """The same (k,), with derivatives (k, n) by Φ.

    Parameters
    ----------
    space, disc, analysis : the design space, the mesh of the design, and its analysis.
    name : of the motion.
    directions : by task.
    """
    values, rows = [], []
    for task, sign in directions.items():
        at, equilibrium = analysis.configurations[task], analysis.equilibria[task]
        found = gradient(at, disc.tangents[task], equilibrium, COMPONENTS[name])
        values.append(sign * found.value)
        rows.append(sign * space.pullback(disc.morph.pullback(found.X), {task: found.pressure}, found.reinforcement))
    return np.array(values), np.array(rows)


def stiffnesses(disc: Discretisation, analysis: Analysis, name: str, tasks: Iterable[str]) -> dict[str, float]:
    """The stiffness of the tip against a motion in tasks, in N/mm or N·mm/rad.

    Parameters
    ----------
    disc, analysis : the mesh of the design, and its analysis.
    name : of the motion.
    tasks : their names.
    """
    return {
        task: tip_stiffness(analysis.configurations[task], disc.tangents[task], _state(analysis, task), name)
        for task in tasks
    }


def stiffness_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, name: str, tasks: Iterable[str]
) -> tuple[np.ndarray, np.ndarray]:
    """The same (k,), with derivatives (k, n) by Φ.

    Parameters
    ----------
    space, disc, analysis : the design space, the mesh of the design, and its analysis.
    name : of the motion.
    tasks : names of the tasks.
    """
    values, rows = [], []
    for task in tasks:
        at, tangent, state = analysis.configurations[task], disc.tangents[task], _state(analysis, task)
        found = tip_stiffness_slope(at, tangent, state, name, EXACT)
        values.append(found.value)
        rows.append(space.pullback(disc.morph.pullback(found.X), {task: found.pressure}, found.reinforcement))
    return np.array(values), np.array(rows)


def all_round(vector: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What limits the length of a vector (1 or 2,) with derivatives (1 or 2, n): its components in directions."""
    if len(vector) == 1:
        return np.concatenate([vector, -vector]), np.concatenate([slopes, -slopes])
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    directions, length = np.column_stack([np.cos(angles), np.sin(angles)]), np.linalg.norm(vector)
    if length > 0.0:
        directions = np.concatenate([vector[None] / length, directions])
    return directions @ vector, directions @ slopes


def sensitivities(disc: Discretisation, analysis: Analysis, motions: Mapping[str, Iterable[str]]) -> dict[str, float]:
    """The largest change of given motions with the pressure of any chamber, by task, in mm/MPa or °/MPa.

    Parameters
    ----------
    disc, analysis : the mesh of the design, and its analysis.
    motions : by task.
    """
    largest = {}
    for task, names in motions.items():
        at, tangent, state = analysis.configurations[task], disc.tangents[task], _state(analysis, task)
        rates = [
            abs(rate) for name in names for rate in pressure_rates(at, tangent, state, COMPONENTS[name], EXACT).values()
        ]
        largest[task] = max(rates, default=0.0)
    return largest


def sensitivity_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, motions: Mapping[str, Iterable[str]]
) -> tuple[np.ndarray, np.ndarray]:
    """The same as what is limited (k,), with derivatives (k, n) by Φ.

    Parameters
    ----------
    space, disc, analysis : the design space, the mesh of the design, and its analysis.
    motions : by task.
    """
    rows = []
    for task, names in motions.items():
        at, tangent, state = analysis.configurations[task], disc.tangents[task], _state(analysis, task)
        for name in names:
            for rate in rate_slopes(at, tangent, state, COMPONENTS[name], EXACT).values():
                slope = space.pullback(disc.morph.pullback(rate.X), {task: rate.pressure}, rate.reinforcement)
                rows.append(all_round(np.array([rate.value]), slope[None]))
    return _joined(rows)


def _joined(rows: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    values, slopes = zip(*rows, strict=True)
    return np.concatenate(values), np.concatenate(slopes)


def _state(analysis: Analysis, task: str) -> State:
    return analysis.equilibria[task].state
