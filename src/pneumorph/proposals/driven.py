"""Proposals designed for a wish: as little as possible of it, while the motions that tasks ask for are held."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pneumorph.problem import Maximize, Problem, TargetMotion, Task
from pneumorph.problem.acting import acting
from pneumorph.problem.components import MOTIONS, component_of, is_turn
from pneumorph.proposals.wishes import pushing
from pneumorph.results import TaskResult
from pneumorph.results.targets import LEAST

OBJECTIVES = ("mass", "air", "pressure", "stretch")
"""Wishes that are objectives of the tasks themselves; the force is one of further tasks."""

BEYOND = 0.03
"""How far beyond its target a motion may go, relative to it: as far as a mesh of the usual size is too stiff."""

ROUNDING = 1e-4
"""Of bounds, relative: a design is within those that it is at."""

NOTHING = 1e-6
"""Weight of tasks whose motions are held while others are designed for the force."""

LOADS = ("force", "moment", "spring", "gravity")
"""Keys of a task with loads of its own."""


def driven(problem: Problem, results: Mapping[str, TaskResult], wish: str) -> Problem | None:
    """The problem of having as little as possible of a wish, with the motions that a design has reached.

    Each motion stays at least what was asked for or, where that was not reached, what was; beyond a target it goes by
    at most `BEYOND`, and one that is to be zero becomes no larger. Of several tasks the sum counts. For the force every
    task is followed by one at the same pressures, in which the tip is held against its motion.

    Parameters
    ----------
    problem : whose tasks ask for motions.
    results : of the design, by task.
    wish : of `Target.minimize`.

    Returns
    -------
    Problem or None
        None for tasks that ask for anything but motions, and for the force where a tip does not move.
    """
    objective, changes = {"kind": "minimize", "of": wish if wish in OBJECTIVES else "mass"}, dict[str, Any]()
    for index, task in enumerate(problem.task):
        held = _held(task, results[task.name])
        if held is None:
            return None
        own: dict[str, Any] = {} if task.limits is None else task.limits.model_dump(mode="json", exclude_none=True)
        changes[f"task[{index}].limits"] = own | {key: {**own.get(key, {}), **motions} for key, motions in held.items()}
        changes[f"task[{index}].objective"] = objective
        if wish not in OBJECTIVES:
            changes[f"task[{index}].weight"] = NOTHING
    if wish in OBJECTIVES:
        return problem.with_changes(changes)
    pressing = list(_pressing(problem, results))
    if len(pressing) < len(problem.task):
        return None
    table = problem.with_changes(changes).model_dump(mode="json", exclude_none=True)
    return Problem.model_validate(table | {"task": [*table["task"], *pressing]})


def _held(task: Task, result: TaskResult) -> dict[str, dict[str, str]] | None:
    """The limits that hold the motions of a task; None if it asks for anything else, or one goes the other way."""
    if not isinstance(task.objective, Maximize | TargetMotion):
        return None
    done: dict[str, float] = dict(zip(MOTIONS, (*result.translation, *result.rotation), strict=True))
    if isinstance(task.objective, Maximize):
        motion, sign = task.objective.component, task.objective.sign
        if sign * done[motion] <= 0.0:
            return None
        return {"at_least": {motion: _told(motion, done[motion] * (1.0 - ROUNDING))}}
    least, most = {}, {}
    for motion, value in task.objective.targets.items():
        if task.objective.weight_of(motion) == 0.0:
            continue
        if value:
            if done[motion] * value <= 0.0:
                return None
            least[motion] = _told(motion, np.sign(value) * min(abs(value), abs(done[motion])) * (1.0 - ROUNDING))
        none = LEAST["rad" if is_turn(motion) else "mm"]
        largest = max(abs(value) * (1.0 + BEYOND), abs(done[motion]) * (1.0 + ROUNDING), none)
        most[motion] = _told(motion, largest)
    return {key: motions for key, motions in (("at_least", least), ("motion", most)) if motions}


def _pressing(problem: Problem, results: Mapping[str, TaskResult]) -> Iterator[dict[str, Any]]:
    """For every task whose tip moves a task in which it presses, held at rest against that motion."""
    table = problem.model_dump(mode="json", exclude_none=True)["task"]
    for task, written in zip(problem.task, table, strict=True):
        motion = pushing(results[task.name])
        if motion is None:
            continue
        held = acting(problem, task).hold.model_dump(mode="json", exclude_none=True)
        yield {
            "name": f"{task.name}-force",
            "pressures_of": task.pressures_of or task.name,
            "hold": held | {component_of(motion.lstrip("-")): "0 mm"},
            "objective": {"kind": "blocked", "motion": motion},
            **{key: written[key] for key in LOADS if key in written},
        }


def _told(motion: str, value: float) -> str:
    """A motion as it is written in a file."""
    return f"{np.degrees(value):.9g} deg" if is_turn(motion) else f"{value:.9g} mm"
