"""Checks of what a task asks of its tip: not where the tip is held, and not farther than limits let it go."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneumorph.problem.acting import acting
from pneumorph.problem.components import MOTION_OF, MOTIONS, is_turn
from pneumorph.problem.models import Task
from pneumorph.problem.objectives import TargetMotion
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables


def check_contradictions(problem: Tables) -> Iterator[tuple[str, str]]:
    """Motions that are asked for, and held at another value or limited to less."""
    for index, task in enumerate(problem.task):
        held = {MOTION_OF.get(name, name): value for name, value in acting(problem, task).hold.values.items()}
        for key, motion, value in _asked(problem, index, task):
            of_all = key.startswith("limits.")
            if motion in held and not of_all and abs(held[motion] - value) > ROUNDING:
                at = f" at {_amount(motion, held[motion])}" if held[motion] else ""
                yield key, f"{motion} is held{at}, so it does not change; leave it out here, or in hold"
            for where, limit, most in _limited(problem, index, task, motion):
                if abs(value) > most * (1.0 + ROUNDING):
                    asked, bound = _amount(motion, abs(value)), _amount(motion, most)
                    yield key, f"asks for {asked}, and {where}.motion.{limit} = {bound} allows less; change one of them"


def _asked(problem: Tables, index: int, task: Task) -> Iterator[tuple[str, str, float]]:
    """Keys of the motions of which a task says how far they are to go, the motions, and how far (mm or rad)."""
    if isinstance(task.objective, TargetMotion):
        for motion, (key, value) in task.objective.asked_motions.items():
            yield f"task[{index}].objective.{key}", motion, value
    for motion in MOTIONS:
        for where, limits in ((f"task[{index}].limits", task.limits), ("limits", problem.limits)):
            value = None if limits is None or limits.at_least is None else getattr(limits.at_least, motion)
            if value is not None:
                yield f"{where}.at_least.{motion}", motion, value
                break


def _limited(problem: Tables, index: int, task: Task, motion: str) -> Iterator[tuple[str, str, float]]:
    """The limits on how far a motion goes in a task, its own before those of all: where they are, names, and bounds."""
    for limit in (motion, *(("shift",) if motion.startswith("shift") else ())):
        for where, limits in ((f"task[{index}].limits", task.limits), ("limits", problem.limits)):
            bound = None if limits is None or limits.motion is None else getattr(limits.motion, limit)
            if bound is not None:
                yield where, limit, bound
                break


def _amount(motion: str, value: float) -> str:
    return f"{math.degrees(value):g} deg" if is_turn(motion) else f"{value:g} mm"
