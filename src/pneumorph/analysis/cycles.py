"""Sweeps there and back, with the durations of their steps, and the energy that a cycle loses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from pneumorph import units
from pneumorph.analysis.pressures import FILLED, HELD, PressurePath
from pneumorph.errors import ProblemError
from pneumorph.problem import Problem
from pneumorph.problem.components import is_turn
from pneumorph.problem.materials import materials
from pneumorph.results.sweeps import Cycle, SweepStep

MOST_CYCLES = 1000

PARTS = tuple(2.0**k / 31.0 for k in range(5))
"""Of a holding time: each step takes twice as long as the one before, as what relaxes does so ever more slowly."""

Durations = list[list[float]]
"""Of every step of every path, s."""


def timed_paths(
    problem: Problem, paths: Sequence[PressurePath], rate: Any, cycles: int | None, hold: Any = None
) -> tuple[list[PressurePath], Durations | None]:
    """The paths with their cycles, and the durations of their steps if a rubber remembers what was before them.

    A body has rested for long under the first loads of a path.

    Parameters
    ----------
    problem : Problem
    paths : sequence of PressurePath
        From the start to the stop of what is swept.
    rate : "2 kPa/s" or a pint quantity, optional
        Of the first that is swept.
    cycles : int, optional
        How often the path is gone there and back.
    hold : "10 s" or a pint quantity, optional
        How long loads stay at the end of the path, or at both ends of every cycle, in steps of `PARTS`.

    Raises
    ------
    ProblemError
        If there is no sweep, no rubber relaxes with a rate or a holding time, or one does without a rate.
    """
    given = {"rate": rate, "hold": hold, "cycles": cycles}
    key = next((f"{name} {value}" for name, value in given.items() if value is not None), None)
    if key is None:
        return list(paths), None
    rubbers = materials(problem).values()
    relaxes = any(rubber.relaxation for rubber in rubbers)
    if not all(path.swept for path in paths):
        raise ProblemError(f"{key}: nothing is swept; sweep e.g. the pressure A=0:60:5kPa")
    if cycles is not None and not 1 <= cycles <= MOST_CYCLES:
        raise ProblemError(f"cycles {cycles}: is not between 1 and {MOST_CYCLES}; use e.g. 3")
    if not relaxes and (rate is not None or hold is not None):
        raise ProblemError(
            f"{key}: no rubber of the problem relaxes, so that time changes nothing; add to [material] e.g. "
            'relaxation = [{ share = 0.1, time = "10 s" }], or leave it out'
        )
    if rate is None and relaxes:
        raise ProblemError(f"{key}: a rubber of the problem relaxes, so time matters; add a rate, e.g. 2kPa/s")
    pause = 0.0 if hold is None else units.parse_positive("hold", units.text_of(hold), units.TIME)
    gone = [_gone(path, cycles, pause) for path in paths]
    if not any(rubber.remembers for rubber in rubbers):
        return [path for path, _ in gone], None
    return [path for path, _ in gone], [_durations(path, rate, pauses) for path, pauses in gone]


def _gone(path: PressurePath, cycles: int | None, pause: float) -> tuple[PressurePath, list[float]]:
    """A path with its cycles and with pauses in s, and how long loads have stayed at every step."""
    last, parts = len(path.steps) - 1, [pause * part for part in PARTS] if pause else []

    def leg(numbers: range, end: int) -> list[tuple[int, float]]:
        return [*((number, 0.0) for number in numbers), *((end, part) for part in parts)]

    there = leg(range(1, last + 1), last)
    cycle = there if cycles is None else [*there, *leg(range(last - 1, -1, -1), 0)]
    order, pauses = zip((0, 0.0), *(cycle * (cycles or 1)), strict=True)

    def of(steps: list[dict[str, float]]) -> list[dict[str, float]]:
        return [steps[number] for number in order]

    gone = replace(
        path,
        steps=of(path.steps),
        moves=of(path.moves),
        holds=of(path.holds),
        volumes=of(path.volumes),
        per_cycle=0 if cycles is None else len(cycle),
    )
    return gone, list(pauses)


def _durations(path: PressurePath, rate: Any, pauses: Sequence[float]) -> list[float]:
    """Infinite for the first step; zero without a rate, where nothing relaxes."""
    first = path.swept[0]
    values = np.array(
        [_value(first, *each) for each in zip(path.steps, path.moves, path.holds, path.volumes, strict=True)]
    )
    speed = inf if rate is None else units.parse_positive("rate", units.text_of(rate), _kind_of_rate(first, path))
    return [inf, *(float(each) for each in np.abs(np.diff(values)) / speed + np.array(pauses[1:]))]


def _kind_of_rate(name: str, path: PressurePath) -> units.Kind:
    if name in path.steps[0]:
        return units.PRESSURE_RATE
    if name.startswith(FILLED):
        return units.VOLUME_RATE
    turns = is_turn(name.removeprefix(HELD)) if name.startswith(HELD) else ".turn_" in name
    return units.TURN_RATE if turns else units.SPEED


def _value(name: str, *given: Mapping[str, float]) -> float:
    own = name.removeprefix(HELD).removeprefix(FILLED)
    return next(each[own] for each in given if own in each)


def cycles_of(task: str, steps: Sequence[SweepStep], per_cycle: int) -> list[Cycle]:
    """The energy of every whole cycle of a curve: the work of pressures and of held motions of the plate.

    Parameters
    ----------
    task : name of the task.
    steps : of the curve.
    per_cycle : steps there and back; 0 where there are no cycles.
    """
    found = []
    for first in range(0, len(steps) - per_cycle, per_cycle) if per_cycle else ():
        own = steps[first : first + per_cycle + 1]
        if not all(step.converged for step in own):
            break
        works = [_work(*pair) for pair in pairwise(own)]
        there = sum(works[: per_cycle // 2])
        found.append(Cycle(task, len(found) + 1, work=there, lost=sum(works)))
    return found


def _work(before: SweepStep, after: SweepStep) -> float:
    """Σ ∫p dV + Σ ∫f dh between two steps, N·mm, by the trapezoidal rule."""
    volumes = sum(
        0.5 * (before.pressures[name] + after.pressures[name]) * (volume - before.volumes[name])
        for name, volume in after.volumes.items()
    )
    # The plate exerts its reactions on what holds it.
    held = sum(
        -0.5
        * (before.reaction[name] + after.reaction[name])
        * (after.holds.get(name, 0.0) - before.holds.get(name, 0.0))
        for name in {*before.holds, *after.holds}
    )
    return volumes + held
