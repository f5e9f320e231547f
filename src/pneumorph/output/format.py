"""Format results for users: motions in millimetres and degrees, pressures in kPa."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pneumorph.analysis import TaskResult
from pneumorph.mechanics import Rubber
from pneumorph.problem import MatchCurve, MatchSections, Maximize, Reach, Task

WORDS = {"extension": "extension", "bending_x": "bending about x", "bending_y": "bending about y", "twist": "twist"}


class Motion(NamedTuple):
    """What a design achieves in a task: value, unit ("mm", "°" or ""), and the word for it."""

    value: float
    unit: str
    word: str

    def __str__(self) -> str:
        if not self.unit:
            return f"{self.value:.4g}"
        # Rounded before it is written, so that no -0.00 is shown.
        return f"{round(self.value, 2) + 0.0:.2f}{'' if self.unit == '°' else ' '}{self.unit}"


def motion_of(task: Task, found: TaskResult) -> Motion:
    """The quantity that a task is about, from its result: a motion, the distance from a target, or the objective."""
    match task.objective:
        case Maximize() as asked:
            return _motion(asked, found)
        case MatchCurve(orientation_weight=0.0):
            return Motion(found.errors["position_mm"], "mm", "distance from the curve")
        case MatchCurve() | MatchSections():
            return Motion(float(np.degrees(found.errors["orientation_rad"])), "°", "error of the sections")
        case Reach(position=None):
            return Motion(float(np.degrees(found.errors["orientation_rad"])), "°", "angle from the target")
        case Reach():
            return Motion(found.errors["position_mm"], "mm", "distance from the target")
    return Motion(found.objective, "", "objective")


def _motion(asked: Maximize, found: TaskResult) -> Motion:
    name, sign = asked.component, asked.sign
    word = ("−" if sign < 0 else "") + WORDS[name]
    if name == "extension":
        return Motion(sign * found.translation[2], "mm", word)
    axis = ("bending_x", "bending_y", "twist").index(name)
    return Motion(sign * float(np.degrees(found.rotation[axis])), "°", word)


def format_pressures(by_chamber: Mapping[str, float]) -> str:
    """Chamber pressures in MPa as "60 kPa" or, in the order of their names, "A 60, B 0 kPa"."""
    if len(by_chamber) == 1:
        return f"{1e3 * next(iter(by_chamber.values())):.3g} kPa"
    return ", ".join(f"{name} {1e3 * value:.3g}" for name, value in sorted(by_chamber.items())) + " kPa"


def validity_warning(rubber: Rubber, max_stretch: float) -> str:
    """A warning if a stretch is beyond the range of the rubber's parameters; else empty."""
    if not rubber.beyond(max_stretch):
        return ""
    return (
        f"the rubber is stretched to {max_stretch:.2f}, but its parameters are valid up to {rubber.valid_stretch:.3g} "
        "only: the motion is extrapolated"
    )


def format_duration(seconds: float) -> str:
    """Seconds as "48 s", "3:05 min" or "1:02 h"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60}:{whole % 60:02d} min"
    return f"{whole // 3600}:{whole % 3600 // 60:02d} h"


def mirror_note(mirror: str | None) -> str:
    """A note that half the body is modelled, to be appended to the size of the model; empty for a whole body."""
    return "" if mirror is None else f", half the body on one side of the plane {mirror}"
