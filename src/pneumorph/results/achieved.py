"""What a design achieves in a task, as one quantity: a motion, a force, the distance from a target or the objective."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pneumorph.problem import ContactArea, Custom, MatchCurve, MatchSections, Maximize, Press, TargetMotion, Task
from pneumorph.results.records import TaskResult

WORDS = {
    "shift_x": "shift along x",
    "shift_y": "shift along y",
    "extension": "extension",
    "bending_x": "bending about x",
    "bending_y": "bending about y",
    "twist": "twist",
}
"""Motions of the tip in words, along and about x, y, z."""


class Motion(NamedTuple):
    """What a design achieves in a task: value, unit ("mm", "°", "N", "mm²" or ""), and the word for it."""

    value: float
    unit: str
    word: str

    def __str__(self) -> str:
        if not self.unit:
            return f"{self.value:.4g}"
        if self.unit == "N":
            return f"{self.value:.3g} N"
        # Rounded before it is written, so that no -0.00 is shown.
        return f"{round(self.value, 2) + 0.0:.2f}{'' if self.unit == '°' else ' '}{self.unit}"


def motion_of(task: Task, found: TaskResult) -> Motion:
    """The quantity that a task is about, from its result: a motion, the distance from a target, or the objective."""
    match task.objective:
        case Maximize() as asked:
            return _motion(asked.component, asked.sign, found)
        case TargetMotion() as asked if len(asked.targets) == 1:
            (name,) = asked.targets
            done = _motion(name, 1.0, found)
            wanted = float(np.degrees(asked.targets[name])) if done.unit == "°" else asked.targets[name]
            return _aimed(done, wanted)
        case Press() as asked:
            return _aimed(_pressing(asked, found), asked.force)
        case ContactArea() as asked:
            return _aimed(
                Motion(found.contact_area[asked.obstacle], "mm²", f"contact with {asked.obstacle}"), asked.area
            )
        case Custom():
            return Motion(found.objective, "", "objective")
    errors = errors_of(task, found.errors)
    # Of a shape it is the orientation that counts, unless it has no weight; of a place the distance.
    shape = isinstance(task.objective, MatchSections) or (
        isinstance(task.objective, MatchCurve) and task.objective.orientation_weight > 0.0
    )
    return errors[-1 if shape else 0]


def errors_of(task: Task, errors: Mapping[str, float]) -> list[Motion]:
    """The distances from a task's target, in mm and °; none for objectives without one."""
    place, turn = {
        MatchCurve: ("distance from the curve", "error of the sections"),
        MatchSections: ("", "error of the sections"),
    }.get(type(task.objective), ("distance from the target", "angle from the target"))
    found = []
    if "position_mm" in errors:
        found.append(Motion(errors["position_mm"], "mm", place))
    if "orientation_rad" in errors:
        found.append(Motion(float(np.degrees(errors["orientation_rad"])), "°", turn))
    if "force_N" in errors:
        found.append(Motion(errors["force_N"], "N", "from the target force"))
    if "area_mm2" in errors:
        found.append(Motion(errors["area_mm2"], "mm²", "from the target area"))
    return found


def _pressing(asked: Press, found: TaskResult) -> Motion:
    """The force of a task on its obstacle."""
    if asked.direction is None:
        return Motion(found.contact_normal[asked.obstacle], "N", f"normal force on {asked.obstacle}")
    value = float(np.dot(found.contact[asked.obstacle], asked.direction))
    return Motion(value, "N", f"force on {asked.obstacle}")


def _aimed(done: Motion, wanted: float | None) -> Motion:
    """What is achieved, with the target in its words if there is one."""
    return done if wanted is None else done._replace(word=f"{done.word}, target {done._replace(value=wanted)}")


def _motion(name: str, sign: float, found: TaskResult) -> Motion:
    word, number = ("−" if sign < 0 else "") + WORDS[name], list(WORDS).index(name)
    if number < 3:
        return Motion(sign * found.translation[number], "mm", word)
    return Motion(sign * float(np.degrees(found.rotation[number - 3])), "°", word)
