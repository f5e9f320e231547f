"""When half or a quarter of a body is enough, since all is symmetric about mirror planes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from pneumorph.problem import Problem
from pneumorph.problem.acting import Acting, acting_in
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.designed import reinforcements
from pneumorph.problem.mirrored_solid import chamber_images, cut_twice, keeps_solid
from pneumorph.problem.reinforcement import EXTERIOR
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import MIRRORS, NORMALS, operations

Pressures = Mapping[str, float | str]
"""Of chambers, MPa; of one whose pressure is not known yet, the name of the chamber that has the supply."""


def mirrors_of(
    problem: Problem, pressures: Iterable[Pressures] | None = None, under: Iterable[Acting] | None = None
) -> tuple[str, ...]:
    """The planes, of "xz" and "yz" in this order, about which a problem is symmetric in shape, loads and objectives.

    There are none where anything may touch: a part of a body does not see its other parts.

    Parameters
    ----------
    problem : Problem
    pressures : iterable of {chamber: MPa}, optional
        All that will be applied; by default those of the tasks, where free ones may become unequal in two chambers.
    under : iterable of Acting, optional
        All weights and loads of the plate that will act; by default those of the tasks.
    """
    if problem.contact is not None or problem.obstacle:
        return ()
    applied = applied_pressures(problem, pressures)
    loads = list(acting_in(problem).values() if under is None else under)
    planes = tuple(plane for plane in ("xz", "yz") if _is_symmetric(problem, plane, applied, loads))
    return planes[:1] if len(planes) == 2 and problem.solid is not None and cut_twice(problem.solid) else planes


def applied_pressures(problem: Problem, pressures: Iterable[Pressures] | None) -> list[Pressures]:
    """The given pressures, or those of the tasks, where one that is free or unknown is like those of its supply."""
    if pressures is not None:
        return list(pressures)
    return [
        {
            name: (pressure.same_as or name) if pressure.free else pressure.start
            for name, pressure in task.pressure.items()
        }
        | {name: name for name in (*task.volumes, *sealed(problem))}
        for task in problem.task
    ]


def sealed(problem: Problem) -> list[str]:
    """The chambers that are sealed with gas."""
    return [chamber.name for chamber in problem.body.chamber if chamber.gas is not None]


def breaking_loads(problem: Problem) -> dict[str, list[str]]:
    """The loads because of which a body with mirror planes is not solved in part, by the planes that they break."""
    words: dict[str, list[str]] = {}
    if problem.contact is not None or problem.obstacle:
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
        and _keeps_body(problem, plane)
        and not any(loads.breaking(np.diag(mirror)) for loads in under)
        and keeps_asked(problem, mirror.tolist(), axial.tolist())
        and all(
            pressure.get(one, 0.0) == pressure.get(other, 0.0)
            for one, other in _pairs(problem, plane)
            for pressure in applied
        )
    )


def keeps_asked(problem: Problem, polar: Sequence[float], axial: Sequence[float]) -> bool:
    """Whether a symmetry keeps the objectives, and the motions against which the tip has to be stiff.

    Parameters
    ----------
    problem : with its tasks and limits.
    polar, axial : (3,) signs that it gives the components of vectors, and of rotation vectors.
    """
    kept = dict(zip(MOTIONS, (*polar, *axial), strict=True))
    limits = [problem.limits, *(task.limits for task in problem.task if task.limits is not None)]
    stiff = [name for each in limits if each.stiffness is not None for name in each.stiffness.motions]
    return all(kept[name] > 0 for name in stiff) and all(task.objective.keeps(polar, axial) for task in problem.task)


def _keeps_body(problem: Problem, plane: str) -> bool:
    """Whether regions, sheets and fibres are their own images, and a half of the body can be meshed."""
    if problem.solid is not None:
        return keeps_solid(problem, problem.solid, plane)
    return _keeps_regions(problem, plane) and _keeps_reinforcements(problem, plane)


def _pairs(problem: Problem, plane: str) -> Iterator[tuple[str, str]]:
    """Chambers off the plane, each with its mirror image."""
    if problem.solid is not None:
        images = chamber_images(problem.solid, plane) or {}
        yield from (pair for pair in images.items() if pair[0] != pair[1])
        return
    mirror = np.array(MIRRORS[plane])
    for one in problem.tubes.chamber:
        there = mirror[:2] * one.center
        if np.allclose(there, one.center):
            continue
        for other in problem.tubes.chamber:
            if np.allclose([*there, *one.span], [*other.center, *other.span]):
                yield one.name, other.name


def _keeps_regions(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every region to itself."""
    parts = ((each.within or (each.layer.angles if each.layer else None), each.sleeve) for each in problem.region)
    return all(_keeps(problem, plane, angles, sleeve.chambers if sleeve else ()) for angles, sleeve in parts)


def _keeps_reinforcements(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every reinforcement to itself."""
    return all(
        not each.handed and _keeps(problem, plane, each.angles, [name for name in each.surfaces if name != EXTERIOR])
        for each in reinforcements(problem)
    )


def _keeps(problem: Problem, plane: str, angles: tuple[float, float] | None, on: Sequence[str]) -> bool:
    """Whether a mirror plane maps a part between angles around the axis, on some chambers, to itself."""
    # The middle of the part lies in the plane through the axis.
    if angles is not None and abs((math.cos, math.sin)[NORMALS[plane]](sum(angles) / 2.0)) > 1e-6:
        return False
    chambers, matrix = problem.tubes.chamber, np.diag(np.array(MIRRORS[plane], float))
    names = [chamber.name for chamber in chambers]
    images = [image(chambers, names.index(name), matrix, problem.body.length) for name in on]
    return all(number is not None and names[number] in on for number in images)
