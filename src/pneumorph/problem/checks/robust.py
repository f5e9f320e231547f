"""Checks of the table [robust]: rubber that is stiffer is that under smaller loads, if it alone bears them."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.problem.tables import Tables


def check_robust(problem: Tables) -> Iterator[tuple[str, str]]:
    """Designs are robust without what bears loads beside one rubber."""
    if problem.robust is None:
        return
    beside = {
        "contact and obstacles": problem.contact is not None or problem.obstacle,
        "several rubbers": problem.region,
        "sealed or filled chambers": any(each.gas is not None for each in problem.body.chamber)
        or any(task.volumes for task in problem.task),
        "objectives of stiffness, force or stretch": any(task.objective.beyond_motion for task in problem.task),
    }
    for what, there in beside.items():
        if there:
            yield "robust", f"is not possible with {what} yet; leave it out"
    if problem.robust.wall >= problem.limits.wall / 2:
        yield (
            "robust.wall",
            f"{problem.robust.wall:g} mm is half of limits.wall = {problem.limits.wall:g} mm or more; make it smaller",
        )
