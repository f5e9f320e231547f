"""Checks of chambers whose pressure is not given: sealed with gas, or filled to a volume."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.problem.tables import Tables


def check_enclosed(problem: Tables) -> Iterator[tuple[str, str]]:
    """Chambers have one of a pressure, a volume and a gas; nothing presses on what holds a volume."""
    names = [chamber.name for chamber in problem.body.chamber]
    sealed = {chamber.name for chamber in problem.body.chamber if chamber.gas is not None}
    touching = problem.contact is not None or bool(problem.obstacle)
    if touching and (sealed or any(task.volumes for task in problem.task)):
        key = "contact" if problem.contact is not None else "obstacle"
        yield (
            key,
            "is not possible with chambers that are sealed or filled to a volume; leave it out, or give pressures",
        )
    for index, task in enumerate(problem.task):
        for name in task.volumes:
            key = f"task[{index}].volume.{name}"
            if name not in names:
                yield key, f'there is no chamber "{name}"; the chambers are {", ".join(names)}'
            elif name in sealed:
                yield key, f'chamber "{name}" is sealed with gas; leave out one of both'
        for name, pressure in task.pressure.items():
            if (name in sealed or name in task.volumes) and (pressure.free or pressure.start):
                what = "is sealed with gas" if name in sealed else "is filled to a volume"
                yield f"task[{index}].pressure.{name}", f'chamber "{name}" {what}: its pressure follows; leave it out'
