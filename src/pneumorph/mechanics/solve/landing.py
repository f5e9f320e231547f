"""Free obstacles on their way to what holds them, and whether something does."""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.tangent import NOTHING, Configuration, Tangent, looseness
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.balance import (
    evaluate,
    free_share,
    held,
    supported,
)

MOST_STEPS = 100
"""Most steps on the way down, each of them shorter than a part of the body: what has met nothing then falls past it."""

UNHELD = (
    'obstacle "{name}" is free, but nothing holds it in some direction; let it rest on the body or a plane, or give it '
    "a spring or hold in [obstacle.free]"
)
LANDED = 1e-3
"""Residual of free obstacles, over what they weigh, at which the body may give way."""

HELD = 1e-2
"""Least stiffness of what holds a free obstacle, over that with which searches hold one (`tangent.LOOSE`)."""


class Unheld(ArithmeticError):
    """A free obstacle falls past everything."""


def landed(at: Configuration, start: State) -> State:
    """The state with the free obstacles that nothing holds let down on the body, which stays as it is.

    They go downhill by Newton steps whose curvatures are made positive.

    Raises
    ------
    Unheld
        If they meet nothing.
    """
    model = at.model
    free, moving = _unknowns(at)
    if not len(moving) or not np.any(_loose(at, start)):
        return start
    own, stiffness = free[moving], looseness(at)[moving]
    lever = np.sqrt(stiffness / stiffness.min())
    vector = held(at, model.vector(start))
    energy, residual = evaluate(at, model.state(vector))
    first = np.linalg.norm(residual[own] / lever)
    for _ in range(MOST_STEPS):
        slope = residual[own] / lever
        if np.linalg.norm(slope) <= LANDED * first:
            break
        stiff = _stiffness(at, model.state(vector))[np.ix_(moving, moving)] / np.outer(lever, lever)
        values, vectors = np.linalg.eigh(stiff)
        step = np.zeros(model.size)
        step[own] = -(vectors @ ((vectors.T @ slope) / np.maximum(np.abs(values), stiffness.min()))) / lever
        share, fall = free_share(at, vector, step), float(residual @ step)
        for _ in range(20):
            trial = vector + share * step
            value, gradient = evaluate(at, model.state(trial))
            if np.isfinite(value) and value <= energy + 1e-4 * share * fall:
                break
            share /= 2
        else:
            break
        vector, energy, residual = trial, value, supported(at, gradient)
    state = model.state(vector)
    falling = np.flatnonzero(_loose(at, state))
    if len(falling) and np.linalg.norm(residual[free[falling]]) > LANDED * first:
        raise Unheld(_words(at, falling[0]))
    return state


def unheld(at: Configuration, tangent: Tangent, state: State) -> str | None:
    """That nothing holds a free obstacle at a state, in words; None if all are held."""
    free, moving = _unknowns(at)
    if at.model.contact is None or not len(moving):
        return None
    loose = np.flatnonzero(_loose(at, state))
    if len(loose):
        return _words(at, loose[0])
    units = np.zeros((at.model.size, len(moving)))
    units[free[moving], np.arange(len(moving))] = 1.0
    scale = np.sqrt(looseness(at)[moving])
    give = tangent.solve_at(at, state, units)[free[moving]] * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(np.nan_to_num(0.5 * (give + give.T), nan=np.inf, posinf=1e300, neginf=-1e300))
    softest = int(np.argmax(np.abs(values)))
    if np.abs(values[softest]) * HELD < 1.0:
        return None
    return _words(at, moving[int(np.argmax(np.abs(vectors[:, softest])))])


def _words(at: Configuration, unknown: int) -> str:
    """That nothing holds the free obstacle with this unknown of theirs."""
    assert at.model.contact is not None
    return UNHELD.format(name=list(at.model.contact.free)[unknown // 6])


def _unknowns(at: Configuration) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns (6J,) of free obstacles, and which of them are not held."""
    free = np.arange(at.model.size)[at.model.object_unknowns]
    return free, np.flatnonzero(~at.constrained[free])


def _stiffness(at: Configuration, state: State) -> np.ndarray:
    """Second derivatives (6J, 6J) of Π by the unknowns of free obstacles, where the body stays as it is."""
    model = at.model
    columns = products.object_columns(model.potential, at.X, state, at.loads)
    return np.array([model.vector(each)[model.object_unknowns] for each in columns]).reshape(len(columns), -1)


def _loose(at: Configuration, state: State) -> np.ndarray:
    """Which unknowns (6J,) of free obstacles nothing resists, but those that are held."""
    free, _ = _unknowns(at)
    nothing = np.abs(np.diag(_stiffness(at, state))) <= NOTHING * looseness(at)
    return nothing & ~at.constrained[free]
