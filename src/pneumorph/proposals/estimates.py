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
    """
    space, pressure = target.space, max(abs(target.pressure.min), abs(target.pressure.max))
    stretch = _largest_stretch(target)
    for index, task in enumerate(target.task):
        key = f"task[{index}].objective"
        asked = task.objective.asked_motions
        if (extension := asked.get("extension")) is not None and extension.value <= -space.length:
            return (
                f"{key}.extension: {-extension.value:g} mm is longer than the body, which fills the space of "
                f"{space.length:g} mm; ask for less, or make space.length larger"
            )
        if stretch is None:
            continue
        force = BEYOND * pressure * space.area * stretch**2
        moment = force * space.reach * stretch
        for motion, needed in _opposed(target, task, {name: each.value for name, each in asked.items()}).items():
            most, unit = (moment, "N·mm") if is_turn(motion) else (force, "N")
            if motion.startswith("shift"):
                lever = math.sqrt(max(space.length**2 - asked[motion].value ** 2, 1e-12))
                most = moment / lever
            if needed > most:
                return (
                    f"{key}.{motion}: needs {needed:.3g} {unit} against springs and loads, and "
                    f"{1e3 * pressure:g} kPa in this space give at most about {most:.3g} {unit}; "
                    "allow more pressure or space, or ask for less"
                )
    return ""


def _largest_stretch(target: Target) -> float | None:
    """The largest stretch that the limits allow in any of the rubbers; None without such a limit."""
    share, ranges = target.limits.strain, [rubber.valid_stretch for rubber in target.material]
    if share == "off" or any(each is None for each in ranges):
        return None
    return max(each for each in ranges if each is not None) * max(1.0, share or 1.0)


def _opposed(target: Target, task: Task, asked: Mapping[str, float]) -> dict[str, float]:
    """Forces (N) and moments (N·mm) that act against the motions that a task states, at their ends."""
    spring = task.spring or target.end_effector.spring
    loads = (*(task.force or target.end_effector.force), *(task.moment or target.end_effector.moment))
    own: dict[str, float] = dict(zip(MOTIONS, loads, strict=True))
    found = {}
    for motion, value in asked.items():
        # Objectives without an end have the value ±1, which is no amount.
        stated = abs(value) if getattr(task.objective, "kind", "") == "motion" else 0.0
        against = abs(own[motion]) if own[motion] * value < 0.0 else 0.0
        found[motion] = getattr(spring, component_of(motion)) * stated + against
    return found


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
