"""What can be said before a mesh is made: whether forces are out of reach, and when bodies balloon or buckle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from pneumorph.problem import Problem
from pneumorph.problem.beam import column_load
from pneumorph.problem.body import BodySpec
from pneumorph.problem.components import MOTIONS, component_of, is_turn
from pneumorph.problem.material import RubberModel
from pneumorph.problem.models import Task
from pneumorph.proposals.target import Target

BEYOND = 2.0
"""Force or moment over its estimated bound from which on a target is out of reach: the estimate takes sections for
convex, and folded ones open a little farther."""

BUCKLED = 2.0
"""Load over that of Euler's column beyond which a body is not tried: pressure in its chamber straightens it little."""

_BODY: TypeAdapter[BodySpec] = TypeAdapter(BodySpec)


def impossible(target: Target) -> str:
    """Why no body in the space does what a task states, as a sentence with its key; empty if nothing is known.

    A chamber pushes with its pressure times its section. Its section is at most that of the space, widened in both
    directions by the largest stretch that the limits allow. A moment acts with a lever of at most the widened space.
    Loads that do not act against a motion help it as much as they can.
    """
    space, stretch = target.space, _largest_stretch(target)
    for index, task in enumerate(target.task):
        key = f"task[{index}].objective"
        asked = {name: each.value for name, each in task.objective.asked_motions.items()}
        if (extension := asked.get("extension")) is not None and extension <= -space.length:
            return (
                f"{key}.extension: {-extension:g} mm is longer than the body, which fills the space of "
                f"{space.length:g} mm; ask for less, or make space.length larger"
            )
        if stretch is None:
            continue
        for motion, needed in _opposed(target, task, asked).items():
            most, unit = _most(target, task, motion, asked[motion], stretch)
            if needed > most:
                pressure = max(abs(target.pressure.min), abs(target.pressure.max))
                return (
                    f"{key}.{motion}: needs {needed:.3g} {unit} against springs and loads, and "
                    f"{1e3 * pressure:g} kPa in this space give at most about {most:.3g} {unit}; "
                    "allow more pressure or space, or ask for less"
                )
    return ""


def _most(target: Target, task: Task, motion: str, value: float, stretch: float) -> tuple[float, str]:
    """The largest force (N) or moment (N·mm) for a motion of a task, and its unit.

    Parameters
    ----------
    target, task, motion : what is asked.
    value : of the motion, in mm or rad.
    stretch : the largest.
    """
    space, pressure = target.space, max(abs(target.pressure.min), abs(target.pressure.max))
    forces, moments = _helping(target, task, motion, value)
    push = pressure * space.area * stretch**2
    force = BEYOND * (push + forces + moments / space.reach)
    moment = BEYOND * (push * space.reach * stretch + forces * (space.length + space.reach) * stretch + moments)
    if is_turn(motion):
        return moment, "N·mm"
    if motion == "extension":
        # A body that bends into an arc draws its tip back by c where it is √(1.5 c L) beside the axis: a small lever.
        return (force if value > 0.0 else max(force, moment / math.sqrt(1.5 * -value * space.length))), "N"
    # Sideways, a body that curls has at least half of what is left of its length across the line of the force.
    lever = (space.length - abs(value)) / 2.0
    return (moment / lever if lever > 0.0 else math.inf), "N"


def _largest_stretch(target: Target) -> float | None:
    """The largest stretch that the limits allow in any of the rubbers; None without such a limit."""
    share, ranges = target.limits.strain, [rubber.valid_stretch for rubber in target.material]
    if share == "off" or any(each is None for each in ranges):
        return None
    return max(each for each in ranges if each is not None) * max(1.0, share or 1.0)


def _loads(target: Target, task: Task) -> dict[str, float]:
    """Force (N) and moment (N·mm) on the tip, by the motions along and about which they act."""
    loads = (*(task.force or target.end_effector.force), *(task.moment or target.end_effector.moment))
    return dict(zip(MOTIONS, loads, strict=True))


def _opposed(target: Target, task: Task, asked: Mapping[str, float]) -> dict[str, float]:
    """Forces (N) and moments (N·mm) that act against the motions that a task states, at their ends."""
    spring, own = task.spring or target.end_effector.spring, _loads(target, task)
    found = {}
    for motion, value in asked.items():
        # Objectives without an end have the value ±1, which is no amount.
        stated = abs(value) if getattr(task.objective, "kind", "") == "motion" else 0.0
        against = abs(own[motion]) if own[motion] * value < 0.0 else 0.0
        found[motion] = getattr(spring, component_of(motion)) * stated + against
    return found


def _helping(target: Target, task: Task, motion: str, value: float) -> tuple[float, float]:
    """Forces (N) and moments (N·mm) on the tip and the weight of a full space, but the load against the motion."""
    loads = {each: abs(load) for each, load in _loads(target, task).items() if each != motion or load * value > 0.0}
    gravity = task.gravity or target.gravity
    heaviest = max(rubber.density for rubber in target.material)
    weight = heaviest * target.space.area * target.space.length * gravity.acceleration if gravity else 0.0
    turning = sum(load for each, load in loads.items() if is_turn(each))
    return sum(loads.values()) - turning + weight, turning


def ballooning(tables: Mapping[str, Any], rubber: RubberModel) -> float:
    """The pressure (MPa) at which the chambers of a body of tubes balloon, as estimated; infinite for other bodies.

    A long tube of neo-Hookean rubber of radii a and b that keeps its length widens without limit at μ ln(b/a), the
    limit of ∫ (λ² − λ⁻²) μ dr/r through its wall for a large λ. Sheets and fibres prevent it.
    """
    if "chamber" not in tables["body"] or "fibres" in tables:
        return math.inf
    body = _BODY.validate_python(tables["body"])
    ratios = [
        1.0 + max(body.mean_radius - np.hypot(*each.center) - each.mean_radius, 0.0) / each.mean_radius
        for each in body.chamber
    ]
    return rubber.initial_shear_modulus * math.log(min(ratios))


def buckles(problem: Problem) -> str:
    """Why a body of tubes buckles as a column under what presses on its tip, as a sentence; empty if it does not.

    Pressure in a chamber pulls its wall as much as it pushes on its end, so that what counts is the load on the tip:
    the force of the plate, and that of a spring along z at the extension that is stated.
    """
    if problem.solid or problem.fibres or problem.membrane:
        return ""
    critical = column_load(problem)
    for task in problem.task:
        spring, hold = task.spring or problem.end_effector.spring, task.hold or problem.end_effector.hold
        guided = [value for name, value in spring if name in ("shift_x", "shift_y", "bending_x", "bending_y") and value]
        if guided or hold.values:
            continue
        stated = task.objective.asked_motions.get("extension")
        reached = stated.value if stated is not None and getattr(task.objective, "kind", "") == "motion" else 0.0
        pressed = spring.axial * max(reached, 0.0) - (task.force or problem.end_effector.force)[2]
        if pressed > BUCKLED * critical:
            return (
                f"{pressed:.3g} N press on the tip in task {task.name}, and a column of this body buckles at "
                f"{critical:.3g} N"
            )
    return ""
