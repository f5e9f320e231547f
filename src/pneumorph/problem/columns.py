"""How many control points are around each tube of a body."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.symmetry.operations import Symmetry, operations

if TYPE_CHECKING:
    from pneumorph.problem.body import BodySpec


def columns_multiple(symmetry: Symmetry) -> int:
    """The number of control points around a tube must be a multiple of this for their images to be control points."""
    turns = [np.arctan2(matrix[1, 0], matrix[0, 0]) / (2.0 * np.pi) for matrix in operations(symmetry)]
    return lcm(*(Fraction(turn).limit_denominator(100).denominator for turn in turns))


def columns(radius: float, density: float, multiple: int = 1) -> int:
    """Number of control points around a tube of a mean radius, at least 8.

    It is the multiple of `multiple` that is nearest to the density (1/mm).
    """
    least = -(-8 // multiple)
    return multiple * max(least, round(density * 2.0 * np.pi * radius / multiple))


def adjusted_columns(spec: BodySpec) -> list[str]:
    """A sentence for every surface whose number of control points around was changed to suit the symmetry."""
    multiple = columns_multiple(spec.symmetry)
    tubes = [("the exterior", spec.mean_radius), *((f'chamber "{c.name}"', c.mean_radius) for c in spec.chamber)]
    counts = [
        (name, *(columns(radius, spec.control_density, each) for each in (1, multiple))) for name, radius in tubes
    ]
    return [
        f"{name} has {fitting} control points around instead of {plain}: the symmetry needs a multiple of {multiple}"
        for name, plain, fitting in counts
        if plain != fitting
    ]
