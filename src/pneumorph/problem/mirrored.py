"""Whether a mirror plane maps the regions, sheets and fibres of a problem to themselves."""

from __future__ import annotations

import math

import numpy as np

from pneumorph.problem.designed import reinforcements
from pneumorph.problem.reinforcement import EXTERIOR
from pneumorph.problem.whole import Problem
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import MIRRORS, NORMALS


def keeps_regions(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every region to itself."""
    matrix = np.diag(np.array(MIRRORS[plane], float))
    chambers, length = problem.tubes.chamber, problem.body.length
    names = [chamber.name for chamber in chambers]
    for region in problem.region:
        angles = region.within or (region.layer.angles if region.layer else None)
        if angles is not None:
            middle = sum(angles) / 2.0
            # The middle of the region lies in the plane.
            if abs((math.cos, math.sin)[NORMALS[plane]](middle)) > 1e-6:
                return False
        lined = region.sleeve.chambers if region.sleeve else ()
        images = [image(chambers, names.index(name), matrix, length) for name in lined]
        if any(number is None or names[number] not in lined for number in images):
            return False
    return True


def keeps_reinforcements(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every reinforcement to itself."""
    matrix = np.diag(np.array(MIRRORS[plane], float))
    chambers, length = problem.tubes.chamber, problem.body.length
    names = [chamber.name for chamber in chambers]
    for each in reinforcements(problem):
        if each.handed:
            return False
        # The middle of the part lies in the plane through the axis of its surface.
        if each.angles is not None and abs((math.cos, math.sin)[NORMALS[plane]](sum(each.angles) / 2.0)) > 1e-6:
            return False
        on = [name for name in each.surfaces if name != EXTERIOR]
        images = [image(chambers, names.index(name), matrix, length) for name in on]
        if any(number is None or names[number] not in on for number in images):
            return False
    return True
