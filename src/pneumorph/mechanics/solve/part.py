"""What of a body is solved: the smallest part from which symmetry gives the rest."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pneumorph.mechanics.solve.mirror import Pressures, applied_pressures, keeps_asked, mirrors_of
from pneumorph.problem import Problem
from pneumorph.problem.acting import Acting, acting_in
from pneumorph.problem.designed import reinforcements, surrounds
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import operations
from pneumorph.symmetry.part import MOST_TURNS, Part, beginning_of, images_of, onwards, sector

AXIAL = (-1.0, -1.0, 1.0)
"""Signs that half a turn about z gives the components of vectors and of rotations: what has none of the first two is
the same after any turn."""


def part_of(
    problem: Problem, pressures: Iterable[Pressures] | None = None, under: Iterable[Acting] | None = None
) -> Part:
    """What of a body is solved: the part between its mirror planes or, where that is smaller, a sector.

    Parameters
    ----------
    problem : Problem
    pressures : iterable of {chamber: MPa}, optional
        See `mirrors_of`.
    under : iterable of Acting, optional
        See `mirrors_of`.
    """
    applied = applied_pressures(problem, pressures)
    loads = list(acting_in(problem).values() if under is None else under)
    mirrors, turns = mirrors_of(problem, applied, loads), turns_of_problem(problem, applied, loads)
    return (sector(turns),) if turns > len(images_of(mirrors)) else mirrors


def turns_of_problem(problem: Problem, applied: list[Pressures], under: list[Acting]) -> int:
    """The largest number of turns about z after which shape, loads and objectives are all the same; 1 if there is none.

    Each chamber beside the axis has to lie within one of the sectors.
    """
    apart = problem.obstacle or problem.region or problem.solid is not None
    if apart or not _along_axis(problem, under) or not surrounds(problem):
        return 1
    group = operations(problem.body.symmetry)
    for turns in range(MOST_TURNS, 1, -1):
        rotation = onwards(turns)
        same = any(np.allclose(operation, rotation) for operation in group)
        if same and _turns_chambers(problem, rotation, applied) and _within_sectors(problem, turns):
            return turns
    return 1


def _along_axis(problem: Problem, under: list[Acting]) -> bool:
    """Whether weight, plate loads and objectives have nothing across the axis."""
    across = any(loads.breaking(np.diag(AXIAL)) for loads in under)
    return not across and keeps_asked(problem, AXIAL, AXIAL)


def _turns_chambers(problem: Problem, rotation: np.ndarray, applied: list[Pressures]) -> bool:
    """Whether a rotation turns every chamber to itself or to one with the same pressures, and with the same sheets."""
    chambers = problem.tubes.chamber
    for number, chamber in enumerate(chambers):
        other = image(chambers, number, rotation, problem.body.length)
        if other is None:
            return False
        name = chambers[other].name
        if other != number and any(given.get(chamber.name, 0.0) != given.get(name, 0.0) for given in applied):
            return False
        reinforced = reinforcements(problem)
        if any((chamber.name in each.surfaces) != (name in each.surfaces) for each in reinforced):
            return False
    return True


def _within_sectors(problem: Problem, turns: int) -> bool:
    """Whether the cuts between sectors are away from the chambers beside the axis, by half the size of an element."""
    beside = [chamber for chamber in problem.tubes.chamber if np.hypot(*chamber.center) > 0.0]
    begin = beginning_of(np.array([chamber.center for chamber in beside]).reshape(-1, 2), turns)
    cuts = 2.0 * np.pi * (begin + np.arange(turns) / turns)
    for chamber in beside:
        x, y = chamber.center
        distance, angle = np.hypot(x, y), np.arctan2(y, x)
        away = np.abs((angle - cuts + np.pi) % (2.0 * np.pi) - np.pi).min()
        if distance * np.sin(min(away, np.pi / 2.0)) < chamber.radius + problem.mesh.size / 2.0:
            return False
    return True
