"""What no single key can tell: whether the parts of a problem fit together at the start."""

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from pneumorph.problem.models import ChamberSpec, Problem
from pneumorph.problem.symmetry import operations

MOST_CONTROL_POINTS = 100_000
MOST_ELEMENTS = 1_000_000
_EPS = 1e-9  # mm; lengths that are meant to be equal may differ in the last bit

Fault = tuple[str, str]


def faults(problem: Problem) -> list[Fault]:
    """Key and reason of everything that does not fit together, the most basic first.

    Later checks suppose what earlier ones found sound, so the list ends with the first group that has a fault.
    """
    for check in (_names, _chambers_in_body, _symmetry, _tasks, _walls, _limits, _resolution):
        found = list(check(problem))
        if found:
            return found
    return []


def _names(problem: Problem) -> Iterator[Fault]:
    for key, parts in (("body.chamber", problem.body.chamber), ("task", problem.task)):
        names = [part.name for part in parts]
        for index, name in enumerate(names):
            if name in names[:index]:
                yield f"{key}[{index}].name", f'"{name}" is taken already; give every one a name of its own'


def _chambers_in_body(problem: Problem) -> Iterator[Fault]:
    body = problem.body
    for index, chamber in enumerate(body.chamber):
        key, (start, end) = f"body.chamber[{index}]", chamber.span
        reach = math.hypot(*chamber.center) + chamber.radius
        if start >= end:
            yield f"{key}.span", f"runs from {start:g} mm to {end:g} mm; put the lower end first"
        elif start < 0 or end > body.length:
            yield (
                f"{key}.span",
                f"runs from {start:g} to {end:g} mm, outside the body (0 to {body.length:g} mm); shorten it",
            )
        elif chamber.ends == "pole" and end - start < 2 * chamber.radius - _EPS:
            yield (
                f"{key}.span",
                f"is shorter than the two hemispheres of its ends, {2 * chamber.radius:g} mm; lengthen it",
            )
        if reach >= body.radius:
            yield (
                f"{key}.{_across(chamber)}",
                f"reaches {reach:g} mm from the axis, outside the body of radius {body.radius:g} mm; "
                "make the chamber thinner or move it inward",
            )
    for (i, one), (j, other) in combinations(enumerate(body.chamber), 2):
        across, along = _gaps(one, other)
        if max(across, along) <= 0:
            yield (
                f"body.chamber[{j}]",
                f'"{other.name}" overlaps "{one.name}" (body.chamber[{i}]); move one of them or make it smaller',
            )


def _symmetry(problem: Problem) -> Iterator[Fault]:
    """Every chamber has its image under every symmetry, the ripple is symmetric, and no objective is zero for all."""
    body = problem.body
    middle = body.length / 2.0
    group = operations(body.symmetry)
    reflecting = any(np.linalg.det(matrix) < 0 for matrix in group)
    for index, task in enumerate(problem.task):
        if reflecting and task.objective.component == "twist":
            yield (
                f"task[{index}].objective.motion",
                "a body that is its own mirror image, or point symmetric, does not twist; leave body.symmetry.mirror "
                'and point out, half_turn = "x" keeps both halves alike',
            )
    if body.ripple and body.ripple.lobes:
        if reflecting:
            yield "body.ripple.lobes", "a helix is no mirror image of itself; take lobes = 0 or no mirror and no point"
        if body.ripple.lobes % body.symmetry.rotation:
            yield (
                "body.ripple.lobes",
                f"is no multiple of body.symmetry.rotation = {body.symmetry.rotation}; make it one",
            )
        if body.symmetry.half_turn == "y" and body.ripple.lobes % 2:
            yield "body.ripple.lobes", 'is odd, which fits a half turn about x; take half_turn = "x"'
    for matrix in group:
        for index, chamber in enumerate(body.chamber):
            x, y, _ = (float(part) for part in matrix @ [*chamber.center, 0.0])
            start, end = sorted(middle + matrix[2, 2] * (z - middle) for z in chamber.span)
            if not any(
                other.ends == chamber.ends
                and all(
                    abs(a - b) < 1e-6
                    for a, b in zip(
                        (x, y, start, end, chamber.radius), (*other.center, *other.span, other.radius), strict=True
                    )
                )
                for other in body.chamber
            ):
                yield (
                    f"body.chamber[{index}]",
                    f'"{chamber.name}" has no image under body.symmetry: put one like it at center = ["{x:.6g} mm", '
                    f'"{y:.6g} mm"], span = ["{start:.6g} mm", "{end:.6g} mm"], or ask for less symmetry',
                )
                return


def _tasks(problem: Problem) -> Iterator[Fault]:
    names = [chamber.name for chamber in problem.body.chamber]
    for index, task in enumerate(problem.task):
        for name in task.pressure:
            if name not in names:
                yield (
                    f"task[{index}].pressure.{name}",
                    f'there is no chamber "{name}"; the chambers are {", ".join(names)}',
                )


def _walls(problem: Problem) -> Iterator[Fault]:
    body, wall = problem.body, problem.limits.wall
    mend = f"thinner than limits.wall = {wall:g} mm at the start; move or shrink the chamber, or lower the limit"
    for index, chamber in enumerate(body.chamber):
        key = f"body.chamber[{index}]"
        side = body.radius - math.hypot(*chamber.center) - chamber.radius
        if side < wall - _EPS:
            yield f"{key}.{_across(chamber)}", f"leaves {side:g} mm of wall to the exterior, {mend}"
        end = min(chamber.span[0], body.length - chamber.span[1])
        if end < wall - _EPS:
            yield f"{key}.span", f"leaves {end:g} mm of wall at an end of the body, {mend}"
    for (i, one), (j, other) in combinations(enumerate(body.chamber), 2):
        between = math.hypot(*(max(gap, 0.0) for gap in _gaps(one, other)))
        if between < wall - _EPS:
            yield f"body.chamber[{j}]", f'leaves {between:g} mm of wall to "{one.name}" (body.chamber[{i}]), {mend}'


def _limits(problem: Problem) -> Iterator[Fault]:
    body, limits = problem.body, problem.limits
    amplitude, wave = (body.ripple.amplitude, 2 * math.pi / body.ripple.period) if body.ripple else (0.0, 0.0)
    tubes = [("the exterior", body.radius, "flat")]
    tubes += [(f'chamber "{chamber.name}"', chamber.radius, chamber.ends) for chamber in body.chamber]
    if amplitude >= min(radius for _, radius, _ in tubes):
        yield "body.ripple.amplitude", "is not below the radius of every surface; make it smaller"
        return
    if limits.envelope and body.radius + amplitude > limits.envelope.radius + _EPS:
        yield (
            "limits.envelope.radius",
            f"the body starts with {body.radius + amplitude:g} mm (ripple included), outside the envelope of "
            f"{limits.envelope.radius:g} mm; widen the envelope or make the body thinner",
        )
    if limits.fold.neighbourhood <= limits.fold.distance:
        yield (
            "limits.fold.neighbourhood",
            f"{limits.fold.neighbourhood:g} mm is not above the distance {limits.fold.distance:g} mm, so that even a "
            "flat surface would be too close to itself; make it larger",
        )
    for name, radius, ends in tubes:
        # h₁ = ½(k₁² + k₂²): on the tube with the ripple's crests, on a hemisphere.
        tube = 0.5 * ((radius - amplitude) ** -2 + (amplitude * wave**2) ** 2)
        bend = max(tube, radius**-2 if ends == "pole" else 0.0)
        if bend > limits.curvature:
            yield (
                "limits.curvature",
                f"{name} starts with {bend:.3g} /mm^2, above the limit of {limits.curvature:g} /mm^2; raise the "
                "limit, or make the radius larger or the ripple flatter",
            )
        half_turn = min(limits.fold.neighbourhood / (2 * radius), math.pi / 2)
        if 2 * radius * math.sin(half_turn) < limits.fold.distance - _EPS:
            yield (
                "limits.fold.distance",
                f"{name} starts closer to itself than {limits.fold.distance:g} mm; lower the distance or make the "
                "neighbourhood or the radius larger",
            )


def _resolution(problem: Problem) -> Iterator[Fault]:
    body, density, size = problem.body, problem.body.control_density, problem.mesh.size
    tubes = [(body.radius, body.length)] + [(c.radius, c.span[1] - c.span[0]) for c in body.chamber]
    if density * body.length < 4:
        yield (
            "body.control_density",
            f"{density:g} /mm gives the body fewer than 4 control points along its length; raise it, 0.6 /mm is usual",
        )
    points = sum(2 * math.pi * radius * length * density**2 for radius, length in tubes)
    if points > MOST_CONTROL_POINTS:
        yield (
            "body.control_density",
            f"{density:g} /mm gives about {points:.0g} control points, above {MOST_CONTROL_POINTS}; lower it, "
            "0.6 /mm is usual",
        )
    if body.ripple and body.ripple.period * density < 3:
        yield (
            "body.ripple.period",
            f"{body.ripple.period:g} mm is shorter than three control points; lengthen it or raise control_density",
        )
    if size > body.radius:
        yield "mesh.size", f"{size:g} mm is above the body's radius of {body.radius:g} mm; make it smaller"
    volume = math.pi * (tubes[0][0] ** 2 * tubes[0][1] - sum(r**2 * length for r, length in tubes[1:]))
    elements = 6 * volume / size**3
    if elements > MOST_ELEMENTS:
        yield (
            "mesh.size",
            f"{size:g} mm gives about {elements:.0g} elements, above {MOST_ELEMENTS}; make it larger",
        )


def _across(chamber: ChamberSpec) -> str:
    """The key to blame when a chamber reaches too far across the body."""
    return "center" if any(chamber.center) else "radius"


def _gaps(one: ChamberSpec, other: ChamberSpec) -> tuple[float, float]:
    """Distance of two chambers across and along z; negative where they overlap. Rounded ends count as flat."""
    across = math.dist(one.center, other.center) - one.radius - other.radius
    along = max(other.span[0] - one.span[1], one.span[0] - other.span[1])
    return across, along
