"""What proposals are compared by beside their tasks: as little mass, air, pressure or stretch, or as much force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pneumorph.analysis import Curve, prepare_simulation
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body
from pneumorph.output.front import undominated
from pneumorph.problem import Problem
from pneumorph.problem.components import MOTIONS
from pneumorph.proposals.making import rubber_volume
from pneumorph.results import HistoryEntry, TaskResult

HEADINGS: Mapping[str, str] = {
    "mass": "mass (g)",
    "air": "air (ml)",
    "pressure": "pressure (kPa)",
    "stretch": "largest stretch",
    "-force": "blocked force (N)",
}
"""Words for the amounts, with units."""

MOVES = 0.1
"""Motion of the tip (mm) from which on it has a direction in which it can press."""


def amount(wish: str, problem: Problem, body: Body, entry: HistoryEntry) -> float:
    """An amount of a design, in the unit of `HEADINGS`; NaN where it has none.

    The mass is that of the rubber. Of the tasks the largest air, pressure or stretch counts, and the smallest force
    with which the tip presses where it is kept from moving along x, y or z, whichever the task moves it along most.

    Parameters
    ----------
    wish : of `Target.minimize`.
    problem, body, entry : the design and its results.
    """
    results = [entry.tasks[task.name] for task in problem.task]
    match wish:
        case "mass":
            return 1e6 * problem.material.density * rubber_volume(body)
        case "air":
            return 1e-3 * max(sum(result.volumes.values()) for result in results)
        case "pressure":
            return 1e3 * max(abs(pressure) for result in results for pressure in result.pressures.values())
        case "stretch":
            return max(result.max_stretch for result in results)
    return min((_blocked(problem, body, entry, task.name) for task in problem.task), default=np.nan)


def minimised(wish: str, value: float) -> float:
    """What is to be small of an amount; infinite where there is none."""
    return np.inf if np.isnan(value) else -value if wish.startswith("-") else value


def best_of(wishes: Sequence[str], found: Sequence[Mapping[str, float]]) -> tuple[np.ndarray, list[list[str]]]:
    """Which of k designs (k,) no other one beats, and the wishes that each wins.

    Parameters
    ----------
    wishes : to compare by.
    found : the amounts of each design.
    """
    values = np.array([[minimised(wish, each[wish]) for wish in wishes] for each in found])
    least = values.min(axis=0)
    wins = [
        [wish for wish, value, best in zip(wishes, row, least, strict=True) if value == best and np.isfinite(value)]
        for row in values
    ]
    return undominated(values), wins


def pushing(result: TaskResult) -> str | None:
    """The motion along x, y or z that is the largest of a tip, as objectives name it; None where it hardly moves."""
    number = int(np.argmax(np.abs(result.translation)))
    if abs(result.translation[number]) < MOVES:
        return None
    return ("-" if result.translation[number] < 0.0 else "") + MOTIONS[number]


def _blocked(problem: Problem, body: Body, entry: HistoryEntry, task: str) -> float:
    """The blocked force (N) of a task; NaN where its tip moves nowhere or no state is found."""
    result = entry.tasks[task]
    motion = pushing(result)
    if motion is None:
        return np.nan
    along = motion.replace(motion.lstrip("-"), "xyz"[MOTIONS.index(motion.lstrip("-"))])
    curves: list[Curve] = []
    try:
        steps = list(prepare_simulation(problem, body, {task: result.pressures}, {}, along=along).run(curves))
    except (ComputationError, ProblemError):
        return np.nan
    found = [step.stiffness.blocked for step in steps if step.stiffness is not None]
    return np.nan if not found or found[-1] is None else found[-1]
