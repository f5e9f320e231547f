"""What chambers do in the tasks of a design, in sentences: those that nothing needs, and those that could be one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from pneumorph.results import ChamberUse
from pneumorph.results.records import IDLE


def of_chambers(uses: Mapping[str, ChamberUse]) -> Iterator[str]:
    """A sentence for each chamber that is idle, and for each group with the same pressures in all tasks."""
    for name, use in uses.items():
        if not use.idle:
            continue
        if use.pressure <= IDLE:
            share = f"at most {100.0 * use.pressure:.2g} % of the largest" if use.pressure else "0 in every task"
            yield f"chamber {name} is idle: its pressure is {share}"
        else:
            assert use.motion is not None, "chambers are idle by their pressure or by their motion"
            yield f"chamber {name} is idle: it makes at most {100.0 * use.motion:.2g} % of the motion of any task"
    groups: dict[str, list[str]] = {}
    for name, use in uses.items():
        if use.same_as:
            groups.setdefault(use.same_as, []).append(name)
    for first, others in groups.items():
        yield f"chambers {', '.join([first, *others])} have the same pressures in all tasks: one supply does for them"
