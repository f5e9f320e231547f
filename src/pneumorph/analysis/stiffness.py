"""How stiff the tip is at a state, what it is blocked with, and what the state takes from the supply."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.mechanics import Configuration, Equilibrium, NoEquilibrium, State, Tangent, Whole, solve
from pneumorph.mechanics.assembly.enclosed import STANDARD
from pneumorph.mechanics.assembly.volumes import volumes_of
from pneumorph.mechanics.solve.balance import evaluate
from pneumorph.results import TipStiffness
from pneumorph.results.records import Vector
from pneumorph.sensitivity import measured_of, response

STEPS, CORRECTIONS = 4, 6
"""A tip that is blocked is brought back in so many steps, each with so many corrections of the force at most."""

NEAR = 1e-4
"""Distance from its place at which a tip counts as blocked there, over how far it moves when it is free."""


@dataclass(frozen=True, eq=False)
class _Body:
    """The whole body, whatever part of it was solved."""

    at: Configuration
    tangent: Tangent
    state: State


def stiffness_at(
    at: Configuration, tangent: Tangent, answer: Equilibrium, whole: Whole | None = None, along: Vector | None = None
) -> TipStiffness:
    """The stiffness of the tip at an equilibrium, from one factorisation of the tangent of the whole body.

    Parameters
    ----------
    at : Configuration
        With the pressures that were found.
    tangent : Tangent
        The linear solver of its model.
    answer : Equilibrium
    whole : Whole, optional
        The whole body, where part of it may have been solved.
    along : (3,) of length 1, optional
        A direction in which the tip is blocked too, which takes a few more solutions.

    Raises
    ------
    ProblemError
        If the tip is to be blocked and is not found there.
    """
    body = _Body(at, tangent, answer.state)
    if whole is not None and at.model is whole.part:
        body = _Body(whole.configuration(at), whole.tangent, whole.state(answer.state))
    found = response(body.at, body.tangent, body.state, measured_of(shift=np.asarray(at.loads.shift)))
    spatial = np.eye(6)
    spatial[3:, 3:] = turns_by_vector(found.values[3:6])
    pressure = dict(zip(at.model.chambers, np.asarray(at.loads.pressure).tolist(), strict=True))
    whole_energy = at.model.copies * evaluate(at, answer.state)[0]
    at_rest = volumes_at_rest(at)
    return TipStiffness(
        compliance=tuple(tuple(map(float, row)) for row in spatial @ found.compliance @ spatial.T),
        energy=whole_energy + sum(pressure[name] * volume for name, volume in answer.volumes.items()),
        air={name: volume * (1 + pressure[name] / STANDARD) - at_rest[name] for name, volume in answer.volumes.items()},
        along=along,
        blocked=None if along is None else blocked_force(body.at, body.tangent, body.state, along),
    )


def volumes_at_rest(at: Configuration) -> dict[str, float]:
    """The volumes of the chambers (mm³) of the whole body, undeformed."""
    volumes = at.model.copies * volumes_of(at.model, at.X, np.zeros_like(at.X), np.asarray(at.loads.shift))
    return dict(zip(at.model.chambers, volumes.tolist(), strict=True))


def turns_by_vector(theta: np.ndarray) -> np.ndarray:
    """T (3, 3): a change δθ of a rotation vector turns a body by T δθ about the axes of space, to first order."""
    angle = float(np.linalg.norm(theta))
    cross = np.array([[0.0, -theta[2], theta[1]], [theta[2], 0.0, -theta[0]], [-theta[1], theta[0], 0.0]])
    if angle < 1e-4:
        return np.eye(3) + cross / 2 + cross @ cross / 6
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * cross + (angle - np.sin(angle)) / angle**3 * cross @ cross


def blocked_force(at: Configuration, tangent: Tangent, state: State, along: Vector) -> float:
    """The force (N) with which the plate presses where it cannot move along a direction, and all else is free.

    The force −f n on the plate, by which n·c = 0 for its translation c, is found by Newton's method with the exact
    compliance, while the plate is brought back in steps.

    Parameters
    ----------
    at, tangent, state : an equilibrium of the whole body, where the plate is free.
    along : (3,) of length 1.

    Raises
    ------
    ProblemError
        If there is no plate, or no stable state on the way.
    """
    if not at.model.plate:
        raise ProblemError('blocked: a free tip has no plate to press with; set kind = "plate" in [end_effector]')
    n, measured = np.array([*along, 0.0, 0.0, 0.0]), measured_of(shift=np.asarray(at.loads.shift))
    own, force, now = np.asarray(at.loads.wrench), 0.0, (at, state)
    free = float(n @ state.plate)
    for left in free * np.arange(STEPS - 1, -1, -1) / STEPS:
        for _ in range(CORRECTIONS):
            found = response(now[0], tangent, now[1], measured)
            away = float(n @ found.values[:6]) - left
            soft = float(n @ found.compliance @ n)
            if abs(away) <= NEAR * abs(free) or soft <= 0.0:
                break
            force += away / soft
            there = replace(at, loads=at.loads._replace(wrench=own - force * n))
            answer = solve(there, tangent, None, since=now)
            if isinstance(answer, NoEquilibrium) or not answer.stable:
                raise ProblemError("blocked: no stable state was found on the way; try --block with a motion")
            now = there, answer.state
    return force


def direction(text: str) -> Vector:
    """A direction (3,) of length 1 from "x", "-z" or "1,0,1".

    Raises
    ------
    ProblemError
        If it is none.
    """
    axes: dict[str, np.ndarray] = dict(zip(("x", "y", "z", "-x", "-y", "-z"), [*np.eye(3), *-np.eye(3)], strict=True))
    try:
        vector = axes[text.strip()] if text.strip() in axes else np.array([float(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    length = np.linalg.norm(vector)
    if vector.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise ProblemError(f'blocked-along: "{text}" is no direction; write x, -z or 1,0,1')
    return cast(Vector, tuple((vector / length).tolist()))
