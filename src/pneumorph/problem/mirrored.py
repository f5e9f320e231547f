"""Whether a mirror plane maps the regions, sheets and fibres of a problem to themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pneumorph.problem.designed import reinforcements
from pneumorph.problem.reinforcement import EXTERIOR
from pneumorph.problem.whole import Problem
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import MIRRORS, NORMALS


def keeps_regions(problem: Problem, plane: str) -> bool:
    """Whether the mirror plane "xz" or "yz" maps every region to itself."""
    parts = ((each.within or (each.layer.angles if each.layer else None), each.sleeve) for each in problem.region)
    return all(_keeps(problem, plane, angles, sleeve.chambers if sleeve else ()) for angles, sleeve in parts)


def keeps_reinforcements(problem: Problem, plane: str) -> bool:
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
