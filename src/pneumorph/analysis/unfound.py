"""Why a start has no state, in the words of the problem file: the keys of its pressures, and what to write there."""

from __future__ import annotations

from dataclasses import replace

from pneumorph.mechanics import NoEquilibrium
from pneumorph.problem import Pressure, Problem

LOWER = 0.8
"""The pressure that is proposed, over the one up to which there are states."""


def explained(problem: Problem, index: int, failure: NoEquilibrium) -> NoEquilibrium:
    """The failure of a task by its index, with the key at fault and a remedy.

    `fraction` of the failure is that of the starting pressures up to which there are states.
    """
    task = problem.task[index]
    acting = {name: pressure for name, pressure in task.pressure.items() if pressure.start}
    if not acting:
        return replace(failure, reason=f"task {task.name}: {failure.reason}")
    key = f"task[{index}].pressure" + (f".{next(iter(acting))}" if len(acting) == 1 else "")
    reach = failure.fraction
    if not 0.0 < reach < 1.0:
        return replace(failure, reason=f"{key}: {failure.reason}")
    free = {name: pressure for name, pressure in acting.items() if pressure.free}
    beyond = [name for name, each in free.items() if abs(_mildest(each)) > reach * abs(each.start)]
    lower = {name: each.quantity.write(float(f"{LOWER * reach * each.start:.2g}")) for name, each in acting.items()}
    if beyond:
        name, each = beyond[0], free[beyond[0]]
        least, most = map(each.quantity.write, (each.min, each.max))
        remedy = (
            f"the whole range of {name}, from {least} to {most}, is beyond it; lower it, make walls thicker, or take a "
            "stiffer rubber"
        )
    elif free:
        remedy = "begin lower, with start = " + ", ".join(
            f'"{lower[name]}"' + (f" of {name}" if len(free) > 1 else "") for name in free
        )
    else:
        # Whether designs at other pressures are of use is for the user to say.
        ranges = ", ".join(f"{name} = {_range(lower[name], each)}" for name, each in acting.items())
        remedy = (
            "lower the pressure, make walls thicker, take a stiffer rubber, or have the pressure designed, so that the "
            f"run begins where there is a state and designs may raise it: {ranges}"
        )
    return replace(failure, reason=f"{key}: {failure.reason}; {remedy}")


def _range(start: float | str, pressure: Pressure) -> str:
    """What to write for a pressure that designs are to raise from a milder start to the one that was given."""
    least, most = (pressure.quantity.write(each) for each in sorted((0.0, pressure.start)))
    return f'{{ start = "{start}", min = "{least}", max = "{most}" }}'


def _mildest(pressure: Pressure) -> float:
    """The pressure of a range that is nearest to none, on the side of its start, MPa."""
    return max(pressure.min, 0.0) if pressure.start > 0.0 else min(pressure.max, 0.0)
