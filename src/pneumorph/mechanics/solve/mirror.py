"""When half or a quarter of a body is enough, since all is symmetric about mirror planes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import nan

import numpy as np

from pneumorph.problem import Problem
from pneumorph.problem.acting import Acting, acting_in
from pneumorph.problem.mirrored import keeps_regions, keeps_reinforcements
from pneumorph.symmetry.operations import MIRRORS, operations

Pressures = Mapping[str, float]


def mirrors_of(
    problem: Problem, pressures: Iterable[Pressures] | None = None, under: Iterable[Acting] | None = None
) -> tuple[str, ...]:
    """The planes, of "xz" and "yz" in this order, about which a problem is symmetric in shape, loads and objectives.

    There are none where anything may touch: a part of a body does not see its other parts. Bodies from files are meshed
    as a whole.

    Parameters
    ----------
    problem : Problem
    pressures : iterable of {chamber: MPa}, optional
        All that will be applied; by default those of the tasks, where free ones may become unequal in two chambers.
    under : iterable of Acting, optional
        All weights and loads of the plate that will act; by default those of the tasks.
    """
    if problem.contact is not None or problem.obstacle or problem.solid is not None:
        return ()
    applied = applied_pressures(problem, pressures)
    loads = list(acting_in(problem).values() if under is None else under)
    return tuple(plane for plane in ("xz", "yz") if _is_symmetric(problem, plane, applied, loads))


def applied_pressures(problem: Problem, pressures: Iterable[Pressures] | None) -> list[Pressures]:
    """The given pressures, or those of the tasks, where one that is free or unknown is like no other."""
    if pressures is not None:
        return list(pressures)
    return [
        {name: nan if pressure.free else pressure.start for name, pressure in task.pressure.items()}
        | dict.fromkeys([*task.volumes, *sealed(problem)], nan)
        for task in problem.task
    ]


def sealed(problem: Problem) -> list[str]:
    """The chambers that are sealed with gas."""
    return [chamber.name for chamber in problem.body.chamber if chamber.gas is not None]


def breaking_loads(problem: Problem) -> dict[str, list[str]]:
    """The loads because of which a body with mirror planes is not solved in part, by the planes that they break."""
    words: dict[str, list[str]] = {}
    if problem.contact is not None or problem.obstacle or problem.solid is not None:
        return words
    for plane in ("xz", "yz"):
        mirror = np.array(MIRRORS[plane])
        if any(np.allclose(operation, np.diag(mirror)) for operation in operations(problem.body.symmetry)):
            words[plane] = [
                f"{key} of task {name}"
                for name, loads in acting_in(problem).items()
                for key in loads.breaking(np.diag(mirror))
            ]
    return {plane: keys for plane, keys in words.items() if keys}


def _is_symmetric(problem: Problem, plane: str, applied: list[Pressures], under: list[Acting]) -> bool:
    mirror = np.array(MIRRORS[plane])
    # Rotations and moments are axial vectors: a mirror reverses the components that it keeps of other vectors.
    axial = np.prod(mirror) * mirror
    return (
        any(np.allclose(operation, np.diag(mirror)) for operation in operations(problem.body.symmetry))
        and keeps_regions(problem, plane)
        and keeps_reinforcements(problem, plane)
        and not any(loads.breaking(np.diag(mirror)) for loads in under)
        and all(task.objective.keeps(mirror.tolist(), axial.tolist()) for task in problem.task)
        and all(
            pressure.get(one, 0.0) == pressure.get(other, 0.0)
            for one, other in _pairs(problem, mirror)
            for pressure in applied
        )
    )


def _pairs(problem: Problem, mirror: np.ndarray) -> Iterator[tuple[str, str]]:
    """Chambers off the plane, each with its mirror image."""
    for one in problem.tubes.chamber:
        image = mirror[:2] * one.center
        if np.allclose(image, one.center):
            continue
        for other in problem.tubes.chamber:
            if np.allclose([*image, *one.span], [*other.center, *other.span]):
                yield one.name, other.name
