"""When a run ends: a chain of tests of the current design, and what is said of the last one."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping

import numpy as np

from pneumorph.optimize.iterate import Iterate
from pneumorph.optimize.setup import Setup

TIME_IS_UP = "its time is up"
"""How the reason begins where there was no time for as many designs as were asked for."""


def reason_to_stop(setup: Setup, current: Iterate) -> str | None:
    """Why the run ends with this design, as a sentence; None where it goes on."""
    return next((reason for test in STOPPING_TESTS if (reason := test(setup, current)) is not None), None)


def _all_designs_made(setup: Setup, current: Iterate) -> str | None:
    if current.number >= setup.problem.optimizer.iterations:
        return "the number of designs that was asked for is reached"
    return None


def _time_is_up(setup: Setup, current: Iterate) -> str | None:
    # Another design as long as this one would end later by more than it is early now.
    return TIME_IS_UP if time.time() + current.took / 2.0 > setup.settings.until else None


def _targets_reached(setup: Setup, current: Iterate) -> str | None:
    return "the targets are reached" if reached(setup, current) else None


def reached(setup: Setup, current: Iterate) -> bool:
    """Whether every task has a target, and all are reached as nearly as anybody can tell."""
    return missed_by_less(setup, current, setup.settings.stopping.reached)


def missed_by_less(setup: Setup, current: Iterate, share: float) -> bool:
    """Whether every task has a target, and all are missed by less than a share of what they were missed by at first."""
    objectives = current.learnt.objectives
    if not objectives or not all(task.objective.aimed for task in setup.problem.task):
        return False
    return objectives[-1] <= share**2 * current.learnt.first


def _optimal(setup: Setup, current: Iterate) -> str | None:
    if current.optimality <= setup.settings.stopping.optimality and not current.states.violated:
        left = 100 * current.optimality
        return f"the design is optimal: its limits leave {left:.1f} % of the objective's gradient"
    return None


def _stalled(setup: Setup, current: Iterate) -> str | None:
    settings, objectives = setup.settings.stopping, current.learnt.objectives
    if len(objectives) <= settings.designs:
        return None
    if objectives[-1 - settings.designs] - objectives[-1] < settings.progress * scale(setup, current):
        return f"{settings.designs} designs together improved the objective by less than {100 * settings.progress:g} %"
    return None


STOPPING_TESTS = (_targets_reached, _all_designs_made, _time_is_up, _optimal, _stalled)


def scale(setup: Setup, current: Iterate) -> float:
    """What progress is measured by: the objective, or a small part of the first one."""
    objectives = current.learnt.objectives
    first = setup.settings.stopping.negligible * current.learnt.first if objectives else 0.0
    return max(abs(current.analysis.value), first)


def worthwhile(setup: Setup, current: Iterate) -> float:
    """The least gain that is worth an equilibrium: a design's share of the progress without which a run has stalled."""
    settings = setup.settings.stopping
    return settings.progress / settings.designs * scale(setup, current)


def conclusion(setup: Setup, last: Iterate, reason: str, is_stable: Mapping[str, bool]) -> str:
    """Why the run ended, with what has to be known of its last design.

    Parameters
    ----------
    setup : of the run.
    last : its last design.
    reason : why it ended.
    is_stable : whether the state of each task is stable, against all motions of the whole body.
    """
    if last.optimality > setup.settings.stopping.optimality and not reached(setup, last):
        left = 100 * last.optimality
        reason += f"; more designs may improve it, as the limits leave {left:.0f} % of the objective's gradient"
    if setup.coarse:
        reason += "; its elements are larger than those asked for, with which no design was found"
    if last.states.violated:
        worst = int(last.states.value.argmax())
        reason += f"; it is {100 * last.states.worst():.1f} % beyond limits.{last.states.limits[worst].name}"
    if not reached(setup, last):
        reason += "".join(map(_without_pressure, _at_rest(setup, last)))
    for name, equilibrium in last.analysis.equilibria.items():
        if equilibrium.stable and not is_stable[name]:
            reason += f"; the state of task {name} is stable only against symmetric motions: the body buckles laterally"
    return reason


def _at_rest(setup: Setup, last: Iterate) -> Iterator[str]:
    """The tasks whose pressures are designed and have all ended at 0, where the shape has no influence."""
    for task in setup.problem.task:
        pressures = np.asarray(last.analysis.configurations[task.name].loads.pressure)
        if any(pressure.free for pressure in task.pressure.values()) and not np.any(pressures):
            yield task.name


def _without_pressure(task: str) -> str:
    return (
        f"; the pressures of task {task} have ended at 0 kPa, where no shape moves the body: if it starts the other "
        "way, ask for that or turn it round, or set a min above 0 kPa"
    )
