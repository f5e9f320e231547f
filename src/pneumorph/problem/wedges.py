"""Regions within an angle around the axis: the half-planes at which they end, and what is wrong with them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.symmetry.operations import columns, columns_multiple, operations

if TYPE_CHECKING:
    from pneumorph.problem.models import BodySpec, ChamberSpec, Ripple
    from pneumorph.problem.regions import Region
    from pneumorph.problem.whole import Problem

LEAST = math.radians(60.0)
"""Smallest angle of a region and of what is between two of them: the coarsest rings of a mesh have eight vertices."""

STEEPEST = math.radians(80.0)
"""Largest angle between a half-plane and the columns of control points on which the line in it depends."""

FEWEST = 14
"""Control points around a surface of which a part reaches around the axis by more than half a turn.

Any four in a row, each within 45° of its place, are then on one side of some plane through the axis that has the
half-planes on the other (`geometry/tube/wedge.py`).
"""

_EPS = 1e-9
_TURN = 2.0 * math.pi


def edges(spec: BodySpec, regions: Sequence[Region], images: bool = False) -> tuple[float, ...]:
    """Angles of all half-planes at which regions end, from 0 to 2π, also those of their images under the symmetry."""
    found: list[float] = []
    for matrix in operations(spec.symmetry) if images else [np.eye(3)]:
        for angle in (angle for region in regions for angle in region.within or ()):
            x, y, _ = matrix @ [math.cos(angle), math.sin(angle), 0.0]
            turned = math.atan2(y, x) % _TURN
            if all(_away(turned, other) > _EPS for other in found):
                found.append(turned)
    return tuple(sorted(found))


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
    if across or end - start <= math.pi + _EPS:
        return start, end
    first = min(max(angle - math.pi / 2.0, start), end - math.pi)
    return first, first + math.pi


def crosses(chamber: ChamberSpec) -> bool:
    """Whether a chamber is cut by all half-planes: it is on the axis."""
    return math.hypot(*chamber.center) <= _EPS


def faults(problem: Problem) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with regions within angles."""
    own = [(f"region[{index}].within", region) for index, region in enumerate(problem.region) if region.within]
    if not own:
        return
    key, body = own[0][0], problem.body
    found = [*_others(problem, own), *_ripples(problem)]
    if not found:
        angles = edges(body, problem.region, images=True)
        found = [*_columns(body, key, angles), *_chambers(problem, key, angles)]
    yield from found


def _others(problem: Problem, own: list[tuple[str, Region]]) -> Iterator[tuple[str, str]]:
    """Faults of regions beside each other."""
    for other in problem.region:
        if not other.within:
            yield (
                own[0][0],
                f'cannot be combined with the shape of "{other.name}" yet; leave out one of the regions',
            )
            return
    if sum(region.within[1] - region.within[0] for _, region in own if region.within) > _TURN - 1e-6:
        yield own[-1][0], "and the other angles leave nothing of the rubber of [material]; leave out one of the regions"
        return
    for number, (key, region) in enumerate(own):
        start, end = region.within or (0.0, 0.0)
        if min(end - start, _TURN - end + start) < LEAST - _EPS:
            yield key, f"covers or leaves less than {math.degrees(LEAST):g} deg; change the angles"
        for _, other in own[:number]:
            first, last = other.within or (0.0, 0.0)
            between = (first - end) % _TURN, (start - last) % _TURN
            apart = [0.0 if _away(each, 0.0) < _EPS else each for each in between]
            if abs(sum(apart) + end - start + last - first - _TURN) > 1e-6:
                yield key, f'overlaps that of "{other.name}"; change the angles'
            elif any(0.0 < each < LEAST - _EPS for each in apart):
                yield (
                    key,
                    f'leaves less than {math.degrees(LEAST):g} deg to "{other.name}"; let them meet, or move them',
                )


def _ripples(problem: Problem) -> Iterator[tuple[str, str]]:
    body = problem.body
    rippled: list[tuple[str, Ripple | None]] = [("body.ripple", body.ripple)]
    for index, chamber in enumerate(body.chamber):
        if chamber.ripple and crosses(chamber):
            rippled.append((f"body.chamber[{index}].ripple", chamber.ripple))
    for key, ripple in rippled:
        if ripple and ripple.lobes:
            yield (
                f"{key}.lobes",
                "wind around the axis, so no line along it is in the half-planes of a region within angles; use "
                "lobes = 0 or another shape of region",
            )


def _columns(body: BodySpec, key: str, angles: Sequence[float]) -> Iterator[tuple[str, str]]:
    """Whether every surface that is cut has columns of control points of its own for each half-plane."""
    multiple = columns_multiple(body.symmetry)
    tubes = [("the exterior", body.radius), *((f'"{c.name}"', c.radius) for c in body.chamber if crosses(c))]
    for name, radius in tubes:
        count = columns(radius, body.control_density, multiple)
        enough = next((n for n in range(count, 1000 * multiple, multiple) if _enough(n, angles)), None)
        if enough is None:
            yield key, "and the images under body.symmetry leave no angle between them; change the angles"
            return
        if enough > count:
            density = enough / (2.0 * math.pi * radius)
            yield (
                key,
                f"needs {enough} control points around {name}, which has {count}; raise body.control_density to "
                f"{math.ceil(100.0 * density) / 100.0:g} /mm or change the angles",
            )


def _enough(count: int, angles: Sequence[float]) -> bool:
    if count < FEWEST and max(end - start for start, end in gaps(angles)) > math.pi + 1e-6:
        return False
    held: list[int] = []
    for angle in angles:
        place = angle / _TURN * count
        middle = round(place)
        own = range(middle - 1, middle + 2) if abs(place - middle) < 1e-6 else range(int(place) - 1, int(place) + 3)
        if max(abs(each - place) for each in own) * _TURN / count > STEEPEST:
            return False
        held += [each % count for each in own]
    return len(set(held)) == len(held)


def _chambers(problem: Problem, key: str, angles: Sequence[float]) -> Iterator[tuple[str, str]]:
    body, wall = problem.body, problem.limits.wall
    for chamber in body.chamber:
        if crosses(chamber):
            continue
        start, end = gap_around(angles, chamber.center, across=False)
        reach, ripple = chamber.radius, body.ripple_of(chamber)
        count = columns(chamber.radius, body.control_density, columns_multiple(body.symmetry))
        # Its control points are that much farther out than itself.
        reach = (reach + (ripple.amplitude if ripple else 0.0)) / float(np.sinc(1.0 / count)) ** 4
        away = min(_depth(chamber.center, start), -_depth(chamber.center, end))
        if away < reach + wall:
            place = math.atan2(chamber.center[1], chamber.center[0])
            edge = min(angles, key=lambda angle, place=place: _away(angle, place))
            yield (
                key,
                f'lets the half-plane at {math.degrees(edge):.4g} deg come nearer to chamber "{chamber.name}" '
                f"than limits.wall = {wall:g} mm, its control points counted; move the chamber away by "
                f"{math.ceil(100.0 * (reach + wall - away)) / 100.0:g} mm or onto the axis, or change the angles",
            )


def _depth(place: Sequence[float] | NDArray[np.float64], angle: float) -> float:
    """Distance of a place (x, y) to the left of the plane through the axis in a direction."""
    return place[1] * math.cos(angle) - place[0] * math.sin(angle)


def _away(one: float, other: float) -> float:
    """Distance of two angles."""
    return abs((one - other + math.pi) % _TURN - math.pi)
