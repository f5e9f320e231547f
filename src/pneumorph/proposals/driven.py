"""Proposals designed for a wish: as little as possible of it, while the motions that tasks ask for are held."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pneumorph.problem import Maximize, Problem, TargetMotion, Task
from pneumorph.problem.components import MOTIONS, is_turn
from pneumorph.results import TaskResult

OBJECTIVES = ("mass", "air", "pressure", "stretch")
"""Wishes that are objectives too."""

BEYOND = 0.03
"""How far beyond its target a motion may go, relative to it: as far as a mesh of the usual size is too stiff."""

ROUNDING = 1e-4
"""Of bounds, relative: a design is within those that it is at."""


def driven(problem: Problem, results: Mapping[str, TaskResult], wish: str) -> Problem | None:
    """The problem of having as little as possible of a wish, with the motions that a design has reached.

    Each motion stays at least what was asked for or, where that was not reached, what was; beyond a target it goes by
    at most `BEYOND`. Of several tasks the sum counts.

    Parameters
    ----------
    problem : whose tasks ask for one motion each.
    results : of the design, by task.
    wish : of `Target.minimize`.

    Returns
    -------
    Problem or None
        None for wishes that are no objectives, and for tasks that ask for anything else.
    """
    if wish not in OBJECTIVES:
        return None
    changes: dict[str, Any] = {}
    for index, task in enumerate(problem.task):
        held = _held(task, results[task.name])
        if held is None:
            return None
        own: dict[str, Any] = {} if task.limits is None else task.limits.model_dump(mode="json", exclude_none=True)
        changes[f"task[{index}].limits"] = own | {key: {**own.get(key, {}), **motions} for key, motions in held.items()}
        changes[f"task[{index}].objective"] = {"kind": "minimize", "of": wish}
    return problem.with_changes(changes)


def _held(task: Task, result: TaskResult) -> dict[str, dict[str, str]] | None:
    """The limits that hold the motion of a task; None if it asks for anything else than one motion."""
    asked = task.objective.asked_motions
    if not isinstance(task.objective, Maximize | TargetMotion) or len(task.objective.tip_motions) != 1 or not asked:
        return None
    [(motion, (_, value))] = asked.items()
    done = float(np.array([*result.translation, *result.rotation])[MOTIONS.index(motion)])
    if done * value <= 0.0:
        return None
    if isinstance(task.objective, Maximize):
        return {"at_least": {motion: _told(motion, done * (1.0 - ROUNDING))}}
    least = np.sign(value) * min(abs(value), abs(done)) * (1.0 - ROUNDING)
    most = max(abs(value) * (1.0 + BEYOND), abs(done) * (1.0 + ROUNDING))
    return {"at_least": {motion: _told(motion, least)}, "motion": {motion: _told(motion, most)}}


def _told(motion: str, value: float) -> str:
    """A motion as it is written in a file."""
    return f"{np.degrees(value):.9g} deg" if is_turn(motion) else f"{value:.9g} mm"
