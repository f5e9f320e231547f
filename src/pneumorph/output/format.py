"""Format results for users: motions in millimetres and degrees, pressures in kPa."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pneumorph.analysis import SweepStep, TaskResult
from pneumorph.mechanics import Rubber
from pneumorph.problem import ContactArea, Custom, MatchCurve, MatchSections, Maximize, Press, TargetMotion, Task
from pneumorph.problem.regions import REST
from pneumorph.symmetry.part import Part, turns_of

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


def format_pressures(by_chamber: Mapping[str, float]) -> str:
    """Chamber pressures in MPa as "60 kPa" or, in the order of their names, "A 60, B 0 kPa"."""
    if len(by_chamber) == 1:
        return f"{1e3 * next(iter(by_chamber.values())):.3g} kPa"
    return ", ".join(f"{name} {1e3 * value:.3g}" for name, value in sorted(by_chamber.items())) + " kPa"


def format_data(reinforcements: Mapping[str, Mapping[str, float]]) -> str:
    """What is designed of sheets and fibres, in N/mm, 1 and rad, as "braid: winding 41.3°, stiffness 12 N/mm"."""

    def words(key: str, value: float) -> str:
        if key == "coverage":
            return f"{key} {value:.3g}"
        return f"{key} {np.degrees(value):.1f}°" if key == "winding" else f"{key} {value:.3g} N/mm"

    return "; ".join(
        f"{name}: {', '.join(words(key, value) for key, value in data.items())}"
        for name, data in reinforcements.items()
    )


THROUGH_ITSELF = "the deformed body goes through itself; a table [contact] in the problem file keeps it from that"


def warnings_of(rubbers: Mapping[str, Rubber], found: TaskResult | SweepStep) -> list[str]:
    """Sentences, without a full stop, that say why a result cannot be trusted."""
    return [
        *_beyond_validity(rubbers, found),
        *([] if found.stable else ["the state is not stable: the body buckles out of it"]),
        *([THROUGH_ITSELF] if found.self_intersecting else []),
    ]


def _beyond_validity(rubbers: Mapping[str, Rubber], found: TaskResult | SweepStep) -> list[str]:
    """A warning if a stretch is beyond the range of the parameters of its rubber."""
    stretches = found.region_stretches or dict.fromkeys([REST], found.max_stretch)
    beyond = [
        (f"the rubber of {name}" if name != REST else "the rubber")
        + f" is stretched to {stretch:.2f}, but its parameters are valid up to {rubbers[name].valid_stretch:.3g} only"
        for name, stretch in stretches.items()
        if name in rubbers and rubbers[name].beyond(stretch)
    ]
    return [f"{', and '.join(beyond)}: the motion is extrapolated"] if beyond else []


def format_duration(seconds: float) -> str:
    """Seconds as "48 s", "3:05 min" or "1:02 h"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60}:{whole % 60:02d} min"
    return f"{whole // 3600}:{whole % 3600 // 60:02d} h"


def part_note(part: Part) -> str:
    """A note that part of the body is modelled, to be appended to the size of the model; empty for a whole body."""
    match part:
        case ():
            return ""
        case (_,) if (turns := turns_of(part)) > 1:
            return f", one of {turns} equal sectors of the body"
        case (plane,):
            return f", half the body on one side of the plane {plane}"
        case _:
            return f", a quarter of the body between the planes {' and '.join(part)}"
