"""Regions within an angle around the axis: the half-planes at which they end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pneumorph.problem.body import BodySpec, ChamberSpec
from pneumorph.problem.regions import Region
from pneumorph.problem.table import ROUNDING
from pneumorph.symmetry.operations import operations

_TURN = 2.0 * math.pi


def edges(spec: BodySpec, regions: Sequence[Region], images: bool = False) -> tuple[float, ...]:
    """Angles of all half-planes at which regions end, from 0 to 2π, also those of their images under the symmetry."""
    angles: list[float] = []
    for matrix in operations(spec.symmetry) if images else [np.eye(3)]:
        for angle in (angle for region in regions for angle in region.within or ()):
            x, y, _ = matrix @ [math.cos(angle), math.sin(angle), 0.0]
            turned = math.atan2(y, x) % _TURN
            if all(angle_between(turned, other) > ROUNDING for other in angles):
                angles.append(turned)
    return tuple(sorted(angles))


def gaps(angles: Sequence[float]) -> list[tuple[float, float]]:
    """From where to where each part between neighbouring half-planes reaches; the last one passes 2π."""
    return list(pairwise([*angles, angles[0] + _TURN]))


def gap_around(angles: Sequence[float], place: Sequence[float], across: bool = True) -> tuple[float, float]:
    """From where to where the part reaches in which a place (x, y) off the axis is.

    Of a part of more than half a turn, if `across` is false, only the half that the place is deepest in.
    """
    angle = math.atan2(place[1], place[0])
    start, end = next((a, b) for a, b in gaps(angles) if (angle - a) % _TURN < b - a)
    angle = start + (angle - start) % _TURN
    if across or end - start <= math.pi + ROUNDING:
        return start, end
    first = min(max(angle - math.pi / 2.0, start), end - math.pi)
    return first, first + math.pi


def crosses(chamber: ChamberSpec) -> bool:
    """Whether a chamber is cut by all half-planes: it is on the axis."""
    return math.hypot(*chamber.center) <= ROUNDING


def angle_between(one: float, other: float) -> float:
    """Distance of two angles."""
    return abs((one - other + math.pi) % _TURN - math.pi)
