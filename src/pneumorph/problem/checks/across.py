"""Checks across keys: whether the parts of a problem are consistent with each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneumorph.cad.stl import MOST_TRIANGLES
from pneumorph.problem.acting import acting, faults_of_loads, has_weight
from pneumorph.problem.checks.axis import check_axis, check_uses
from pneumorph.problem.checks.chambers import check_chambers, check_walls
from pneumorph.problem.checks.contradictions import check_contradictions
from pneumorph.problem.checks.dome import check_dome
from pneumorph.problem.checks.enclosed import check_enclosed
from pneumorph.problem.checks.limits import (
    check_ranges,
    check_sensitivities,
    check_shapes,
    check_states,
    check_stiffnesses,
)
from pneumorph.problem.checks.motions import check_motions
from pneumorph.problem.checks.regions import check_regions
from pneumorph.problem.checks.reinforcement import check_reinforcements
from pneumorph.problem.checks.robust import check_robust
from pneumorph.problem.checks.room import check_envelope, check_obstacles
from pneumorph.problem.checks.solid import LARGEST, MAX_CONTROL_POINTS, SMALLEST, check_solid, too_many_elements
from pneumorph.problem.checks.symmetry import check_symmetry
from pneumorph.problem.components import MOTION_OF
from pneumorph.problem.contact import TriangulatedSpec
from pneumorph.problem.objectives import LargestWorkspace, Minimize
from pneumorph.problem.objectives.table import Known
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables

Fault = tuple[str, str]


def inconsistencies(problem: Tables) -> list[Fault]:
    """Key and reason of every inconsistency, the most basic ones first.

    Checks that rely on others are left out if these have found something.
    """
    limited = (check_ranges, check_sensitivities, check_stiffnesses, check_states)
    states = (_tasks, check_contradictions, _workspace, check_enclosed, *limited, check_robust)
    if problem.solid:
        together = (_names, check_solid, *states, _contact, check_obstacles)
        return [fault for check in together for fault in check(problem)]
    found = [fault for check in (_names, check_chambers, check_axis, _no_lattice) for fault in check(problem)]
    placed = (
        *(check_symmetry, check_motions, check_walls, check_uses),
        *(check_dome, check_envelope, check_regions, check_reinforcements),
    )
    relying = (*(() if found else placed), *states, check_shapes, _contact, check_obstacles, _resolution)
    return found + [fault for check in relying for fault in check(problem)]


def _names(problem: Tables) -> Iterator[Fault]:
    for key, parts in (
        ("body.chamber", problem.body.chamber),
        ("task", problem.task),
        ("obstacle", problem.obstacle),
    ):
        names = [part.name for part in parts]
        for index, name in enumerate(names):
            if name in names[:index]:
                yield f"{key}[{index}].name", f'"{name}" is used twice; give each one a different name'


def _no_lattice(problem: Tables) -> Iterator[Fault]:
    if problem.design is not None:
        yield "design", "is for bodies from files; give body.control_density in its place"
    if problem.limits.scaling is not None:
        yield "limits.scaling", "is for bodies from files; for tubes there are curvature, skew and stretch"
    if problem.limits.bending is not None:
        yield "limits.bending", "is for bodies from files; for tubes there is curvature"
    if problem.limits.volume is not None:
        yield "limits.volume", "is for bodies from files; for tubes leave it out"
    if problem.limits.envelope is not None and problem.limits.envelope.triangles is not None:
        yield "limits.envelope.file", "is for bodies from files; for tubes give a radius, a box or half-spaces"


def _tasks(problem: Tables) -> Iterator[Fault]:
    names = [chamber.name for chamber in problem.body.chamber]
    obstacles = [obstacle.name for obstacle in problem.obstacle]
    these = f"the obstacles are {', '.join(obstacles)}" if obstacles else "add a table [[obstacle]]"
    masses = {part.name: part.free.mass for part in problem.obstacle if part.free}
    known = Known(names, obstacles, list(masses), problem.end_effector.kind == "plate")
    for number, obstacle in enumerate(problem.obstacle):
        if masses.get(obstacle.name) and not has_weight(problem):
            yield (
                f"obstacle[{number}].free.mass",
                "has no weight without gravity; add a table [gravity], or leave mass out",
            )
    yield from faults_of_loads(problem)
    asking = any(
        limits is not None and limits.at_least for limits in (problem.limits, *(t.limits for t in problem.task))
    )
    if not asking and all(isinstance(task.objective, Minimize) for task in problem.task):
        yield (
            "task[0].objective.of",
            "nothing says what the robot has to do with so little; give the task's least motions, as in "
            'limits = { at_least = { bending_y = "30 deg" } }',
        )
    yield from _pressures_of_others(problem)
    for index, task in enumerate(problem.task):
        for name in task.pressure if task.pressures_of is None else ():
            if name not in names:
                yield (
                    f"task[{index}].pressure.{name}",
                    f'there is no chamber "{name}"; the chambers are {", ".join(names)}',
                )
        for key, given in (("move", task.moves), ("turn", task.turns)):
            for name in given:
                if name not in obstacles:
                    yield f"task[{index}].{key}.{name}", f'there is no obstacle "{name}"; {these}'
        designed = [name for name, pressure in task.pressure.items() if pressure.free]
        own = known._replace(
            designed=designed,
            held=[MOTION_OF.get(name, name) for name in acting(problem, task).hold.values],
            enclosed=bool(task.volumes) or any(chamber.gas is not None for chamber in problem.body.chamber),
        )
        for key, reason in task.objective.inconsistencies(own):
            yield f"task[{index}].objective.{key}", reason


def _pressures_of_others(problem: Tables) -> Iterator[Fault]:
    """Tasks that have the pressures of another name one that has its own, and give none."""
    own = {task.name: task.pressure for task in problem.task if task.pressures_of is None}
    for index, task in enumerate(problem.task):
        if task.pressures_of is None:
            continue
        if task.pressures_of not in own:
            others = f"; those are {', '.join(own)}" if own else ""
            yield f"task[{index}].pressures_of", f"names no task with pressures of its own{others}"
        elif task.pressure != own[task.pressures_of]:
            yield (
                f"task[{index}].pressure",
                f"is that of task {task.pressures_of} by pressures_of; leave one out",
            )


def _workspace(problem: Tables) -> Iterator[Fault]:
    """The tasks of a workspace measure it along the same axes, and are enough for it to have a size."""
    spanning = {
        index: task.objective.axes
        for index, task in enumerate(problem.task)
        if isinstance(task.objective, LargestWorkspace)
    }
    if not spanning:
        return
    index, axes = next(iter(spanning.items()))
    if any(each != axes for each in spanning.values()):
        yield f"task[{index}].objective.axes", "is not the same in all tasks of the workspace; give them the same axes"
    if len(spanning) <= len(axes):
        number, sizes = len(spanning), ("length", "area", "volume")
        yield (
            f"task[{index}].objective.kind",
            f"has {number} task{'s' * (number != 1)}, whose tips have no {sizes[len(axes) - 1]}; give {len(axes) + 1} "
            "tasks or more this objective, each with the pressures of a corner",
        )


def _contact(problem: Tables) -> Iterator[Fault]:
    """The activation distance is less than every wall and slot: surfaces at rest are not in contact."""
    distance, limits = problem.contact and problem.contact.distance, problem.limits
    if problem.contact and problem.contact.friction and not problem.obstacle:
        yield "contact.friction", "acts on obstacles alone, and there is none; add a table [[obstacle]] or leave it out"
    total = sum(len(each.surface.triangles) for each in problem.obstacle if isinstance(each, TriangulatedSpec))
    if total > 2 * MOST_TRIANGLES:
        yield (
            "obstacle",
            f"those of kind mesh have {total} triangles together, more than {2 * MOST_TRIANGLES}; make them coarser",
        )
    if distance:
        least, key = min((limits.wall, "wall"), (limits.fold.distance, "fold.distance"))
        if distance > least / 2:
            yield (
                "contact.distance",
                f"{distance:g} mm is more than half of limits.{key} = {least:g} mm, so surfaces would be in contact "
                "at rest; make it smaller",
            )


def _resolution(problem: Tables) -> Iterator[Fault]:
    body, density, size = problem.tubes, problem.tubes.control_density, problem.mesh.size
    if not SMALLEST <= body.length <= LARGEST:
        meant = body.length * (1e3 if body.length < SMALLEST else 1e-3)
        yield (
            "body.length",
            f"{body.length:g} mm is no size of a soft robot, which are {SMALLEST:g} mm to {LARGEST:g} mm long; check "
            f"the unit: {meant:g} mm?",
        )
        return
    tubes = [(body, body.length), *((chamber, chamber.span[1] - chamber.span[0]) for chamber in body.chamber)]
    if density * body.length < 4:
        yield (
            "body.control_density",
            f"{density:g} /mm gives the body fewer than 4 control points along its length; raise it (0.6 /mm is usual)",
        )
    points = sum(2 * math.pi * tube.mean_radius * length * density**2 for tube, length in tubes)
    if points > MAX_CONTROL_POINTS:
        yield (
            "body.control_density",
            f"{density:g} /mm gives about {points:.0g} control points, more than {MAX_CONTROL_POINTS}; lower it "
            "(0.6 /mm is usual)",
        )
    ripples = {"body.ripple": body.ripple} | {
        f"body.chamber[{index}].ripple": chamber.ripple for index, chamber in enumerate(body.chamber)
    }
    for key, ripple in ripples.items():
        if ripple and ripple.period * density < 3:
            yield (
                f"{key}.period",
                f"{ripple.period:g} mm is less than three control points; make it longer or raise body.control_density",
            )
    if size > body.radius:
        yield "mesh.size", f"{size:g} mm is larger than the body's radius of {body.radius:g} mm; make it smaller"
    for index, task in enumerate(problem.task):
        key, count = task.objective.section_count
        if count * size > body.length + ROUNDING:
            yield (
                f"task[{index}].objective.{key}",
                f"{count} sections are thinner than the elements of mesh.size = {size:g} mm; use at most "
                f"{math.floor(body.length / size)} or a finer mesh",
            )
    volume = body.area * body.length - sum(tube.area * length for tube, length in tubes[1:])
    yield from too_many_elements(volume, size)
