"""Checks of the table [robust]: rubber that is stiffer is that under smaller loads, if it alone bears them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneumorph.problem.tables import Tables


def check_robust(problem: Tables) -> Iterator[tuple[str, str]]:
    """Designs are robust without what bears loads beside one rubber, and in motions alone."""
    if problem.robust is None:
        return
    beside = {
        "contact and obstacles": problem.contact is not None or problem.obstacle,
        "several rubbers": problem.region,
        "sealed or filled chambers": any(each.gas is not None for each in problem.body.chamber)
        or any(task.volumes for task in problem.task),
    }
    for what, there in beside.items():
        if there:
            yield "robust", f"is not possible with {what} yet; leave it out"
    for task in problem.task:
        if task.objective.beyond_motion:
            kind = f'the objective "{task.objective.kind}" of the task "{task.name}"'
            yield "robust", f"is not possible with {kind} yet, only with motions; leave one of them out"
    half = f"half of limits.wall = {problem.limits.wall:g} mm or more"
    for key, moved in (("wall", problem.robust.wall), ("shift", problem.robust.shift)):
        if moved >= problem.limits.wall / 2:
            yield f"robust.{key}", f"{moved:g} mm is {half}; make it smaller"
    if not problem.solid:
        longest = max(end - start for start, end in (each.span for each in problem.tubes.chamber))
        if (moved := longest * math.tan(min(problem.robust.tilt, 1.0))) >= problem.limits.wall / 2:
            tilt = math.degrees(problem.robust.tilt)
            yield "robust.tilt", f"{tilt:g} deg moves the end of a core by {moved:.3g} mm, {half}; make it smaller"
