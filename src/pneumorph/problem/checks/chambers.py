"""Checks of chambers: whether they are inside the body, apart, and far enough from its ends."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from pneumorph.problem.body import BodySpec, ChamberSpec
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables

THIN = 1 / 100
"""Thinnest wall across the axis, over the size of elements: in a thinner one no element has a sound shape."""


TOO_THIN = "less than a hundredth of mesh.size, which cannot be meshed; move or shrink the chamber"


def check_chambers(problem: Tables) -> Iterator[tuple[str, str]]:
    body = problem.tubes
    for index, chamber in enumerate(body.chamber):
        key, (start, end) = f"body.chamber[{index}]", chamber.span
        if start >= end:
            yield f"{key}.span", f"runs from {start:g} mm to {end:g} mm; put the lower end first"
        elif start < 0 or end > body.length:
            yield (
                f"{key}.span",
                f"runs from {start:g} to {end:g} mm, beyond the body (0 to {body.length:g} mm); make it shorter",
            )
        elif chamber.ends == "pole" and end - start < 2 * chamber.mean_radius - ROUNDING:
            yield (
                f"{key}.span",
                f"is shorter than its two hemispherical ends, {2 * chamber.mean_radius:g} mm; make it longer",
            )
        yield from _out_of_the_body(body, chamber, key, THIN * problem.mesh.size)
    for (i, one), (j, other) in combinations(enumerate(body.chamber), 2):
        across, along = _gaps(one, other)
        if max(across, along) <= 0:
            yield (
                f"body.chamber[{j}]",
                f'"{other.name}" overlaps "{one.name}" (body.chamber[{i}]); move one of them or make it smaller',
            )
        elif max(across, along) < THIN * problem.mesh.size:
            yield f"body.chamber[{j}]", f'leaves a wall of {max(across, along):.3g} mm to "{one.name}", {TOO_THIN}'


def _out_of_the_body(body: BodySpec, chamber: ChamberSpec, key: str, thin: float) -> Iterator[tuple[str, str]]:
    """Whether the cross-sections of a chamber are inside those of the body, with walls that are not too thin."""
    if body.round and chamber.round:
        reach = math.hypot(*chamber.center) + chamber.radius
        if 0.0 < body.radius - reach < thin and body.taper == chamber.taper == 1.0:
            yield f"{key}.{_across(chamber)}", f"leaves a wall of {body.radius - reach:.3g} mm, {TOO_THIN}"
        if reach >= body.radius:
            yield (
                f"{key}.{_across(chamber)}",
                f"reaches {reach:g} mm from the axis, outside the body of radius {body.radius:g} mm; "
                "make the chamber thinner or move it inwards",
            )
        return
    for height, size in zip(chamber.span, (1.0, chamber.taper), strict=True):
        outside = body.outline.scaled(1.0 + (body.taper - 1.0) * height / body.length)
        wall = outside.clearance(chamber.outline.scaled(size).moved(*chamber.center))
        if 0.0 < wall < thin:
            yield f"{key}.{_across(chamber)}", f"leaves a wall of {wall:.3g} mm, {TOO_THIN}"
            return
        if wall <= 0.0:
            yield (
                f"{key}.{_across(chamber)}",
                f"puts part of the chamber's section outside the body's at z = {height:g} mm; make the chamber smaller "
                "or move it inwards",
            )
            return


def check_walls(problem: Tables) -> Iterator[tuple[str, str]]:
    """Check wall thickness along the axis only: the design loop thickens walls across it but does not move the ends."""
    body, wall = problem.tubes, problem.limits.wall
    fix = f"thinner than limits.wall = {wall:g} mm at the start; move or shrink the chamber, or lower the limit"
    for index, chamber in enumerate(body.chamber):
        end = min(chamber.span[0], body.length - chamber.span[1])
        if end < wall - ROUNDING:
            yield f"body.chamber[{index}].span", f"leaves a wall of {end:g} mm at an end of the body, {fix}"
    for (i, one), (j, other) in combinations(enumerate(body.chamber), 2):
        across, along = _gaps(one, other)
        if across <= 0.0 and along < wall - ROUNDING:
            yield f"body.chamber[{j}]", f'leaves a wall of {along:g} mm to "{one.name}" (body.chamber[{i}]), {fix}'


def _across(chamber: ChamberSpec) -> str:
    """The key to name when a chamber reaches out of the body."""
    return "center" if any(chamber.center) else "section" if chamber.section else "radius"


def _gaps(one: ChamberSpec, other: ChamberSpec) -> tuple[float, float]:
    """Distances (mm) between two chambers across and along z; negative if they overlap. Domes count as flat ends."""
    if one.round and other.round:
        across = math.dist(one.center, other.center) - one.radius - other.radius
    else:
        first, second = (each.outline.scaled(max(1.0, each.taper)).moved(*each.center) for each in (one, other))
        across = first.gap(second)
    along = max(other.span[0] - one.span[1], one.span[0] - other.span[1])
    return across, along
