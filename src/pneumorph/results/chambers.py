"""What each of several chambers does in the tasks of a design: which are idle, and which have the same pressures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.problem import Problem
from pneumorph.problem.objectives import Reach
from pneumorph.results.records import IDLE, ChamberUse, MotionRates, TaskResult


def chamber_uses(
    problem: Problem, tasks: Mapping[str, TaskResult], rates: Mapping[str, MotionRates]
) -> dict[str, ChamberUse]:
    """What each chamber does; nothing of a single one, or where no chamber has a pressure.

    Of chambers that are filled or sealed nothing is said: their pressure follows.

    Parameters
    ----------
    problem : with its tasks.
    tasks : the results of a design, by task.
    rates : of the tip's motions, by task; of tasks without any, nothing is known of motions.
    """
    found = {chamber.name for chamber in problem.body.chamber if chamber.gas is not None}
    found.update(name for task in problem.task for name in task.volumes)
    names = [chamber.name for chamber in problem.body.chamber if chamber.name not in found]
    pressures = {name: np.array([tasks[task.name].pressures[name] for task in problem.task]) for name in names}
    largest = max((float(np.abs(each).max()) for each in pressures.values()), default=0.0)
    if len(problem.body.chamber) == 1 or not largest:
        return {}
    uses = {
        name: ChamberUse(float(np.abs(own).max()) / largest, _motion(problem, tasks, rates, name))
        for name, own in pressures.items()
    }
    working = [name for name in names if not uses[name].idle]
    for place, name in enumerate(working):
        alike = (other for other in working[:place] if _equal(pressures[name], pressures[other]))
        uses[name] = ChamberUse(uses[name].pressure, uses[name].motion, next(alike, ""))
    return uses


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether pressures differ in no task by more than `IDLE` of the largest of both."""
    return float(np.abs(one - other).max()) <= IDLE * float(max(np.abs(one).max(), np.abs(other).max()))


def _motion(
    problem: Problem, tasks: Mapping[str, TaskResult], rates: Mapping[str, MotionRates], chamber: str
) -> float | None:
    """See `ChamberUse.motion`."""
    parts = []
    for task in problem.task:
        result, rate = tasks[task.name], rates.get(task.name)
        if (
            rate is None
            or chamber not in rate.by_pressure
            or not (task.objective.tip_motions or isinstance(task.objective, Reach))
        ):
            return None
        scale = np.repeat([1.0, problem.body.length], 3)
        motion = float(np.linalg.norm(scale * [*result.translation, *result.rotation]))
        made = float(np.linalg.norm(scale * rate.by_pressure[chamber])) * abs(result.pressures[chamber])
        if made:
            parts.append(made / max(motion, 1e-12))
    return max(parts, default=0.0)
