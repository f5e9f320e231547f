"""Checks of regions within angles around the axis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pneumorph.problem.body import BodySpec, Ripple
from pneumorph.problem.columns import columns, columns_multiple
from pneumorph.problem.regions import Region
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables
from pneumorph.problem.wedges import angle_between, crosses, edges, gap_around, gaps

LEAST = math.radians(60.0)
"""Smallest angle of a region and of what is between two of them: the coarsest rings of a mesh have eight vertices."""

STEEPEST = math.radians(80.0)
"""Largest angle between a half-plane and the columns of control points on which the line in it depends."""

FEWEST = 14
"""Control points around a surface of which a part reaches around the axis by more than half a turn.

Any four in a row, each within 45° of its place, are then on one side of some plane through the axis that has the
half-planes on the other (`geometry/tube/wedge.py`).
"""
_TURN = 2.0 * math.pi


def check_wedges(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with regions within angles."""
    own = [(f"region[{index}].within", region) for index, region in enumerate(problem.region) if region.within]
    if not own:
        return
    key, body = own[0][0], problem.tubes
    faults = [*_others(problem, own), *_ripples(problem)]
    if not faults:
        angles = edges(body, problem.region, images=True)
        faults = [*_columns(body, key, angles), *_chambers(problem, key, angles)]
    yield from faults


def _others(problem: Tables, own: list[tuple[str, Region]]) -> Iterator[tuple[str, str]]:
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
        if min(end - start, _TURN - end + start) < LEAST - ROUNDING:
            yield key, f"covers or leaves less than {math.degrees(LEAST):g} deg; change the angles"
        for _, other in own[:number]:
            first, last = other.within or (0.0, 0.0)
            between = (first - end) % _TURN, (start - last) % _TURN
            apart = [0.0 if angle_between(each, 0.0) < ROUNDING else each for each in between]
            if abs(sum(apart) + end - start + last - first - _TURN) > 1e-6:
                yield key, f'overlaps that of "{other.name}"; change the angles'
            elif any(0.0 < each < LEAST - ROUNDING for each in apart):
                yield (
                    key,
                    f'leaves less than {math.degrees(LEAST):g} deg to "{other.name}"; let them meet, or move them',
                )


def _ripples(problem: Tables) -> Iterator[tuple[str, str]]:
    body = problem.tubes
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
    taken: list[int] = []
    for angle in angles:
        place = angle / _TURN * count
        middle = round(place)
        own = range(middle - 1, middle + 2) if abs(place - middle) < 1e-6 else range(int(place) - 1, int(place) + 3)
        if max(abs(each - place) for each in own) * _TURN / count > STEEPEST:
            return False
        taken += [each % count for each in own]
    return len(set(taken)) == len(taken)


def _chambers(problem: Tables, key: str, angles: Sequence[float]) -> Iterator[tuple[str, str]]:
    body, wall = problem.tubes, problem.limits.wall
    for chamber in body.chamber:
        if crosses(chamber):
            continue
        start, end = gap_around(angles, chamber.center, across=False)
        reach, ripple = chamber.radius, body.ripple_of(chamber)
        count = columns(chamber.radius, body.control_density, columns_multiple(body.symmetry))
        # Its control points are that much farther out than itself.
        reach = (reach + (ripple.amplitude if ripple else 0.0)) / float(np.sinc(1.0 / count)) ** 4
        distance = min(_depth(chamber.center, start), -_depth(chamber.center, end))
        if distance < reach + wall:
            place = math.atan2(chamber.center[1], chamber.center[0])
            edge = min(angles, key=lambda angle, place=place: angle_between(angle, place))
            yield (
                key,
                f'lets the half-plane at {math.degrees(edge):.4g} deg come nearer to chamber "{chamber.name}" '
                f"than limits.wall = {wall:g} mm, its control points counted; move the chamber away by "
                f"{math.ceil(100.0 * (reach + wall - distance)) / 100.0:g} mm or onto the axis, or change the angles",
            )


def _depth(place: Sequence[float] | NDArray[np.float64], angle: float) -> float:
    """Distance of a place (x, y) to the left of the plane through the axis in a direction."""
    return place[1] * math.cos(angle) - place[0] * math.sin(angle)
