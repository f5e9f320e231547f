"""What is possible in a problem but hardly meant, in sentences for the commands to print."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.problem.acting import acting
from pneumorph.problem.materials import materials
from pneumorph.problem.regions import REST
from pneumorph.problem.stiffness import HARD
from pneumorph.problem.tables import Tables


def doubts(problem: Tables) -> Iterator[str]:
    """A sentence for each."""
    for name, material in materials(problem).items():
        young = 3.0 * material.initial_shear_modulus
        if young > HARD:
            where = "" if name == REST else f' of region "{name}"'
            yield (
                f"the rubber{where} has a Young's modulus of about {young:.3g} MPa, hundreds of times that of the "
                "silicones of soft robots; air pressure hardly deforms it"
            )
    for name in unmoved(problem):
        yield (
            f"in task {name} no chamber has a pressure and no load acts, so nothing moves; give it a pressure, e.g. "
            f'pressure = {{ {problem.body.chamber[0].name} = "60 kPa" }}'
        )


def unmoved(problem: Tables) -> list[str]:
    """The names of tasks about a motion in which nothing moves the body: no pressure, volume, gas, load or obstacle."""
    if any(chamber.gas is not None for chamber in problem.body.chamber):
        return []
    return [
        task.name
        for task in problem.task
        if not task.objective.beyond_motion
        and not any(pressure.free or pressure.start for pressure in task.pressure.values())
        and not any(task.volumes.values())
        and not acting(problem, task).moves
        and not any(any(pose) for pose in task.poses.values())
    ]
