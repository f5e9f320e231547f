"""Format results for users: motions in millimetres and degrees, pressures in kPa."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.mechanics import Rubber
from pneumorph.problem.regions import REST
from pneumorph.results import SweepStep, TaskResult
from pneumorph.symmetry.part import Part, turns_of


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


def balloons(pressures: Mapping[str, float], margin: float) -> str:
    """At what pressures a state at these (MPa) would balloon, as "at 63.6 kPa it balloons, 1.07 times the working"."""
    there = format_pressures({name: margin * pressure for name, pressure in pressures.items()})
    working = "working pressure" if len(pressures) == 1 else "working pressures"
    return f"at {there} it balloons, {margin:.2f} times the {working}"


def balloons_perhaps(pressures: Mapping[str, float], followed: float) -> str:
    """That it is not known whether a state at these pressures (MPa) is near ballooning, and how far it was followed."""
    there = format_pressures({name: followed * pressure for name, pressure in pressures.items()})
    return f"whether it is near ballooning is not known: states could be followed to {there} only"


def stretches(rubbers: Mapping[str, Rubber], result: TaskResult) -> str:
    """The largest stretch of every rubber beside the range of its data, where that is stated."""
    by_region = result.region_stretches or dict.fromkeys([REST], result.max_stretch)
    parts = []
    for name, stretch in by_region.items():
        valid = rubbers[name].valid_stretch if name in rubbers else None
        where = f"{name} " if len(by_region) > 1 else ""
        reach = "" if valid is None else f" (the rubber's data reach to {valid:.3g})"
        parts.append(f"{where}{stretch:.2f}{reach}")
    return f"largest stretch {', '.join(parts)}"


SELF_INTERSECTS = "the deformed body self-intersects; a table [contact] in the problem file prevents this"


def warnings_of(rubbers: Mapping[str, Rubber], result: TaskResult | SweepStep) -> list[str]:
    """Sentences, without a full stop, that say why a result cannot be trusted."""
    return [
        *_beyond_validity(rubbers, result),
        *([] if result.stable else ["the state is not stable: the body would buckle"]),
        *([SELF_INTERSECTS] if result.self_intersecting else []),
    ]


def _beyond_validity(rubbers: Mapping[str, Rubber], result: TaskResult | SweepStep) -> list[str]:
    """A warning if a stretch is beyond the range of the parameters of its rubber."""
    stretches = result.region_stretches or dict.fromkeys([REST], result.max_stretch)
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
