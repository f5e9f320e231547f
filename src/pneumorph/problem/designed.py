"""What is designed of a problem beside its shape: pressures, and data of sheets and fibres."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneumorph.problem.reinforcement import Reinforcement, data_of
from pneumorph.problem.variable import Variable
from pneumorph.problem.whole import Problem


def reinforcements(problem: Problem) -> tuple[Reinforcement, ...]:
    """All of a problem."""
    return (*problem.membrane, *problem.fibres)


def designed(problem: Problem) -> dict[str, dict[str, Variable]]:
    """What is designed of the reinforcements of a problem: by their names, then by key."""
    free = {
        each.name: {key: datum for key, datum in data_of(each).items() if datum.free}
        for each in reinforcements(problem)
    }
    return {name: data for name, data in free.items() if data}


def starting_from(problem: Problem, values: Mapping[str, Mapping[str, float]]) -> Problem:
    """The problem with other values at the start of what is designed, by name and key, in N/mm, rad and 1."""

    def changed(each: Any) -> Any:
        data = data_of(each)
        return each.model_copy(
            update={
                key: data[key].model_copy(update={"start": value}) for key, value in values.get(each.name, {}).items()
            }
        )

    return problem.model_copy(
        update={"membrane": tuple(map(changed, problem.membrane)), "fibres": tuple(map(changed, problem.fibres))}
    )


def starting_at(problem: Problem, pressures: Mapping[str, Mapping[str, float]]) -> Problem:
    """The problem with the pressures of a design as its starting pressures."""
    tasks = [
        task.model_copy(
            update={
                "pressure": {
                    name: pressure.model_copy(update={"start": pressures[task.name][name]})
                    for name, pressure in task.pressure.items()
                }
            }
        )
        for task in problem.task
    ]
    return problem.model_copy(update={"task": tuple(tasks)})


def surrounds(problem: Problem) -> bool:
    """Whether every reinforcement goes all the way around."""
    return all(each.angles is None for each in reinforcements(problem))
