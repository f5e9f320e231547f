"""Limits on the states of tasks: their words and bounds. Values and derivatives need equilibria: `optimize.states`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.limits.limit import Limit
from pneumorph.problem.components import MOTIONS as COMPONENTS
from pneumorph.problem.components import is_turn
from pneumorph.problem.objectives.words import Amount, Result, motion_amount

if TYPE_CHECKING:
    from pneumorph.problem import Limits, Problem, Task, TaskLimits


def _strain(limits: Limits) -> float | None:
    return None if limits.strain == "off" else limits.strain


def _margin(limits: Limits) -> float | None:
    # The pressure of an equilibrium is below that of the limit point ahead in any case.
    return None if limits.margin == 1.0 else limits.margin


STRAIN = Limit("strain", "strain", "", False, 0.005, "strain", _strain)
MARGIN = Limit("margin", "margin", "", True, 0.005, "margin", _margin)


def _size(unit: str) -> float:
    """The size of a motion in mm or rad in its unit, mm or degrees."""
    return 1.0 if unit == "mm" else float(np.degrees(1.0))


def _motion(name: str, unit: str) -> Limit:
    """The limit on a motion of the tip, in mm or degrees."""

    def read(limits: TaskLimits) -> float | None:
        bound = None if limits.motion is None else getattr(limits.motion, name)
        return None if bound is None else _size(unit) * bound

    return Limit(f"motion.{name}", name, unit, False, 0.005, f"{name}_{'mm' if unit == 'mm' else 'deg'}", read)


def _least(name: str, unit: str) -> Limit:
    """The least motion of the tip, in mm or degrees, in the direction that `direction` tells."""

    def read(limits: TaskLimits) -> float | None:
        bound = None if limits.at_least is None else getattr(limits.at_least, name)
        return None if bound is None else abs(_size(unit) * bound)

    key = f"least_{name}_{'mm' if unit == 'mm' else 'deg'}"
    return Limit(f"at_least.{name}", f"least {name}", unit, True, 0.005, key, read)


def _stiffness(name: str, unit: str) -> Limit:
    """The least stiffness of the tip against a motion, in N/mm or N·mm/rad."""

    def read(limits: TaskLimits) -> float | None:
        return None if limits.stiffness is None else getattr(limits.stiffness, name)

    return Limit(f"stiffness.{name}", f"stiffness {name}", unit, True, 0.005, f"stiffness_{name}", read)


def _sensitivity(name: str, unit: str, size: float) -> Limit:
    """The limit on the sensitivity of motions that are angles or lengths, whose bound is so large per unit."""

    def read(limits: TaskLimits) -> float | None:
        bound = None if limits.sensitivity is None else getattr(limits.sensitivity, name)
        return None if bound is None else size * bound

    return Limit(f"sensitivity.{name}", "sensitivity", f"{unit}/kPa", False, 0.005, f"sensitivity_of_{name}", read)


_UNITS = {name: "°" if is_turn(name) else "mm" for name in COMPONENTS}

MOTIONS: Mapping[str, Limit] = {
    name: _motion(name, unit) for name, unit in ({"tilt": "°", "shift": "mm"} | _UNITS).items()
}
"""By the keys of `problem.task_limits.MotionLimits`."""

LEAST: Mapping[str, Limit] = {name: _least(name, unit) for name, unit in _UNITS.items()}
"""By the keys of `problem.task_limits.LeastMotions`."""

STIFFNESSES: Mapping[str, Limit] = {
    name: _stiffness(name, "N·mm/rad" if is_turn(name) else "N/mm") for name in COMPONENTS
}
"""By the keys of `problem.task_limits.LeastStiffness`."""

PER_KPA = 1e-3
"""MPa."""

SENSITIVITIES: Mapping[str, Limit] = {
    "angle": _sensitivity("angle", "°", PER_KPA * float(np.degrees(1.0))),
    "length": _sensitivity("length", "mm", PER_KPA),
}
"""By the keys of `problem.task_limits.SensitivityLimits`."""

OF_STATES = (STRAIN, MARGIN, *MOTIONS.values(), *LEAST.values(), *STIFFNESSES.values(), *SENSITIVITIES.values())
"""All of them, see `optimize.states`."""


def bound_of(limit: Limit, problem: Problem, task: Task) -> float | None:
    """The bound of a limit in a task: its own, or that of the table [limits]; None if it has none."""
    if limit in SENSITIVITIES.values():
        (kind,) = (kind for kind, each in SENSITIVITIES.items() if each is limit)
        if not task.objective.motions_of(kind):
            return None
    of_task = task.limits is not None and limit not in (STRAIN, MARGIN)
    own = limit.read(task.limits) if of_task else None
    return limit.read(problem.limits) if own is None else own


def direction(name: str, problem: Problem, task: Task) -> float:
    """1.0, or -1.0 where the least motion of a task is negative."""
    own = None if task.limits is None or task.limits.at_least is None else getattr(task.limits.at_least, name)
    if own is None:
        own = getattr(problem.limits.at_least, name)
    return float(np.sign(own))


def of_tasks(limit: Limit, problem: Problem) -> list[tuple[Limit, float, tuple[str, ...]]]:
    """A limit with its bound and the tasks that have it: once if the bounds are the same, else for every task."""
    bounds = {task.name: bound_of(limit, problem, task) for task in problem.task}
    given = {name: bound for name, bound in bounds.items() if bound is not None}
    told = {task.name: _told(limit, problem, task) for task in problem.task if task.name in given}
    if len({(given[name], told[name]) for name in given}) == 1:
        (first, *_) = given
        shown = limit if told[first] == limit.told else replace(limit, told=told[first])
        return [(shown, given[first], tuple(given))]
    return [
        (
            replace(
                limit,
                name=f"{limit.name} of {name}",
                word=f"{limit.word} of {name}",
                key=f"{limit.key} of {name}",
                told=told[name],
            ),
            bound,
            (name,),
        )
        for name, bound in given.items()
    ]


def _told(limit: Limit, problem: Problem, task: Task) -> float:
    """1.0, or -1.0 where the values of a limit are shown with the other sign: those of a negative least motion."""
    for name, least in LEAST.items():
        if least is limit:
            return direction(name, problem, task)
    return 1.0


def is_least(limit: Limit) -> bool:
    """Whether it is on a least motion, of all tasks or of one."""
    return limit.name.startswith("at_least.")


def least_motions(problem: Problem, task: Task, result: Result) -> list[tuple[Amount, str]]:
    """Motions that a task must have at least, and is not judged by anyway: each as it is, and what it must be.

    The targets of the amounts are these least motions.
    """
    own, found = task.objective.achieved(result).word, []
    for name, limit in LEAST.items():
        amount, bound = motion_amount(name, 1.0, result), bound_of(limit, problem, task)
        if bound is not None and amount.word != own:
            told = replace(limit, told=direction(name, problem, task))
            found.append((amount._replace(target=told.told * bound), told.asked(bound)))
    return found


def beside(problem: Problem, task: Task, result: Result) -> str:
    """The same as it follows what a task achieves: ", bending about y 30.05° (at least 30°)"; empty without any."""
    return "".join(f", {amount.word} {amount} ({asked})" for amount, asked in least_motions(problem, task, result))
