"""Checks of chambers whose pressure is not given: sealed with gas, or filled to a volume."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.problem.tables import Tables


def check_enclosed(problem: Tables) -> Iterator[tuple[str, str]]:
    """Chambers have one of a pressure, a volume and a gas; friction, and obstacles that close ports, need pressures."""
    names = [chamber.name for chamber in problem.body.chamber]
    sealed = {chamber.name for chamber in problem.body.chamber if chamber.gas is not None}
    rubbing = problem.contact is not None and problem.contact.friction > 0.0
    if rubbing and (sealed or any(task.volumes for task in problem.task)):
        yield (
            "contact.friction",
            "is not possible with chambers that are sealed or filled to a volume; leave it out, or give pressures",
        )
    for number, chamber in enumerate(problem.body.chamber):
        if chamber.gas is not None and getattr(chamber, "seal", None) is not None:
            yield f"body.chamber[{number}].gas", "is closed by an obstacle; leave gas or seal out, or give pressures"
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
