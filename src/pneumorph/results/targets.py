"""Whether designs reach the targets of their tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

from pneumorph.problem import Problem
from pneumorph.results.records import HistoryEntry, TaskResult

REACHED = 0.005
"""Share of its distance from the target at the start below which a design has reached it."""

NEAR = 0.03
"""The same up to which it has reached it as far as a mesh can tell: those of the usual size are 1 to 4 % too stiff."""

LEAST = {"mm": 0.05, "rad": 0.001, "N": 0.01, "mm2": 0.1}
"""Distances that count as none, by the unit in which they are stored."""

_WEIGHTS = {"position_mm": ("position_weight",), "orientation_rad": ("orientation_weight", "rotation_weight")}


class Reached(Enum):
    """How near a design is to a target."""

    YES = "reached"
    NEARLY = "nearly reached"
    NO = "not reached"


def reached(errors: Mapping[str, float], at_start: Mapping[str, float]) -> Reached:
    """How near a task is to its target, by its distances from it now and at the start, with the names of `LEAST`."""

    def within(share: float) -> bool:
        return all(
            value <= max(share * at_start.get(name, 0.0), LEAST[name.rpartition("_")[2]])
            for name, value in errors.items()
        )

    return Reached.YES if within(REACHED) else Reached.NEARLY if within(NEAR) else Reached.NO


def distances(objective: object, result: TaskResult) -> dict[str, float]:
    """The distances of a task from its target that count: those with a weight."""

    def counts(name: str) -> bool:
        return all(getattr(objective, key, 1.0) > 0.0 for key in _WEIGHTS.get(name, ()))

    return {name: value for name, value in result.errors.items() if counts(name)}


def targets_reached(problem: Problem, history: Sequence[HistoryEntry]) -> dict[str, Reached]:
    """How near the last design of a history is to the targets of the tasks that have one."""
    start, last = history[0].tasks, history[-1].tasks
    aimed = {task.name: task.objective for task in problem.task if task.objective.aimed and last[task.name].errors}
    return {
        name: reached(distances(objective, last[name]), distances(objective, start[name]))
        for name, objective in aimed.items()
    }
