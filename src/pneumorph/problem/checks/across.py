"""Checks across keys: whether the parts of a problem are consistent with each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from pneumorph.cad.stl import MOST_TRIANGLES
from pneumorph.problem.acting import acting, faults_of_loads, has_weight
from pneumorph.problem.body import BodySpec, ChamberSpec
from pneumorph.problem.checks.enclosed import check_enclosed
from pneumorph.problem.checks.prospects import check_motions, check_states
from pneumorph.problem.checks.regions import check_regions
from pneumorph.problem.checks.reinforcement import check_reinforcements
from pneumorph.problem.checks.room import check_envelope, check_obstacles
from pneumorph.problem.checks.solid import LARGEST, MAX_CONTROL_POINTS, MAX_ELEMENTS, SMALLEST, check_solid
from pneumorph.problem.contact import TriangulatedSpec
from pneumorph.problem.material import ArrudaBoyce, Gent
from pneumorph.problem.materials import materials
from pneumorph.problem.models import Task
from pneumorph.problem.regions import REST
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables
from pneumorph.problem.task_limits import TaskLimits
from pneumorph.symmetry.images import WITHIN, image, place, placed
from pneumorph.symmetry.operations import operations

Fault = tuple[str, str]


def inconsistencies(problem: Tables) -> list[Fault]:
    """Key and reason of every inconsistency, the most basic ones first.

    Checks that rely on others are left out if these have found something.
    """
    if problem.solid:
        together = (
            *(_names, check_solid, _tasks, check_enclosed, _ranges),
            *(_sensitivities, check_states, _contact, check_obstacles),
        )
        return [fault for check in together for fault in check(problem)]
    found = [*_names(problem), *_chambers_in_body(problem), *_no_lattice(problem)]
    relying = () if found else (_symmetry, check_motions, _walls, check_envelope, check_regions, check_reinforcements)
    for check in (
        *relying,
        _tasks,
        check_enclosed,
        _ranges,
        _sensitivities,
        check_states,
        _limits,
        _contact,
        check_obstacles,
        _resolution,
    ):
        found += check(problem)
    return found


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


def _chambers_in_body(problem: Tables) -> Iterator[Fault]:
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


THIN = 1 / 100
"""Thinnest wall across the axis, over the size of elements: in a thinner one no element has a sound shape."""

TOO_THIN = "less than a hundredth of mesh.size, which cannot be meshed; move or shrink the chamber"


def _out_of_the_body(body: BodySpec, chamber: ChamberSpec, key: str, thin: float) -> Iterator[Fault]:
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


def _symmetry(problem: Tables) -> Iterator[Fault]:
    """Check that chambers and ripples are symmetric, and that the symmetry does not rule an objective out."""
    body = problem.tubes
    group = operations(body.symmetry)
    reflecting = [matrix for matrix in group if np.linalg.det(matrix) < 0]
    if body.ripple and body.ripple.lobes:
        if reflecting:
            yield (
                "body.ripple.lobes",
                "a helix is not its own mirror image; use lobes = 0, or leave out body.symmetry.mirror and point",
            )
        if body.ripple.lobes % body.symmetry.rotation:
            yield (
                "body.ripple.lobes",
                f"is not a multiple of body.symmetry.rotation = {body.symmetry.rotation}; make it one",
            )
        if body.symmetry.half_turn == "y" and body.ripple.lobes % 2:
            yield (
                "body.ripple.lobes",
                'is odd, which suits only a half turn about x; use half_turn = "x"',
            )
    missing = list(_unlike_images(body, group)) or list(_missing_images(body, group))
    if missing:
        yield from missing
        return
    for matrix in group:
        for index in range(len(body.chamber)):
            fault = _fault_of_ripple(body, index, matrix)
            if fault:
                yield fault
                return
    twisting = [index for index, task in enumerate(problem.task) if task.objective.twist_key]
    count = len(body.chamber) if twisting else 0
    images = [[image(body.chamber, index, matrix, body.length) or 0 for index in range(count)] for matrix in reflecting]
    handed = any(fibres.handed for fibres in problem.fibres)
    for index in twisting:
        task = problem.task[index]
        alike = zip(reflecting, images, strict=True)
        loads = acting(problem, task)
        if not handed and any(_same_pressures(problem, task, to) and not loads.breaking(by) for by, to in alike):
            yield (
                f"task[{index}].objective.{task.objective.twist_key}",
                "a mirror-symmetric or point-symmetric body does not twist under equally symmetric pressures and loads"
                '; leave out body.symmetry.mirror and point (half_turn = "x" also keeps both halves alike)',
            )


def _unlike_images(body: BodySpec, group: list[np.ndarray]) -> Iterator[Fault]:
    """Sections and tapers that the symmetry does not keep."""
    if body.section and not all(body.outline.is_image_of(body.outline, matrix) for matrix in group):
        yield "body.section", "is not its own image under body.symmetry; turn it, or ask for less symmetry"
    if body.taper != 1.0 and any(matrix[2, 2] < 0.0 for matrix in group):
        yield "body.taper", "makes the two halves along the axis unlike, but body.symmetry maps one to the other"
    places = np.array([place(chamber) for chamber in body.chamber])
    for index, chamber in enumerate(body.chamber):
        for matrix in group:
            there = np.abs(places - placed(places[index], matrix, body.length)).max(axis=1) <= WITHIN
            if there.any() and image(body.chamber, index, matrix, body.length) is None:
                yield (
                    f"body.chamber[{index}]",
                    f'"{chamber.name}" and "{body.chamber[int(there.argmax())].name}", in the place of its image under '
                    "body.symmetry, have unlike sections, tapers or ends; make them images of each other",
                )
                return


def _missing_images(body: BodySpec, group: list[np.ndarray]) -> Iterator[Fault]:
    """Every place where a chamber should be, for the first chamber of which an image is missing."""
    for index, chamber in enumerate(body.chamber):
        there = np.zeros((0, 5))
        for matrix in group:
            if image(body.chamber, index, matrix, body.length) is not None:
                continue
            wanted = placed(place(chamber), matrix, body.length)
            if np.any(np.all(np.abs(there - wanted) <= WITHIN, axis=1)):
                continue
            there = np.vstack([there, wanted])
        turns = body.symmetry.rotation
        only = turns > 1 and len(group) == turns and len(there) == turns - 1 and math.hypot(*chamber.center) > WITHIN
        for x, y, start, end, _ in there:
            yield (
                f"body.chamber[{index}]",
                f'"{chamber.name}" has no image under body.symmetry; put one like it at '
                f'center = ["{_mm(x)}", "{_mm(y)}"], span = ["{_mm(start)}", "{_mm(end)}"]'
                + (f", or give it copies = {turns}" if only else "")
                + ", or ask for less symmetry",
            )
        if len(there):
            return


def _mm(value: float) -> str:
    """A length as it can be written in a file; rounding is far below `WITHIN`."""
    return f"{round(value, 5) + 0.0:g} mm" if abs(value) < 1.0 else f"{value:.6g} mm"


def _fault_of_ripple(body: BodySpec, index: int, matrix: np.ndarray) -> Fault | None:
    """The fault in the ripple of a chamber's image, if there is one."""
    chamber, number = body.chamber[index], image(body.chamber, index, matrix, body.length)
    assert number is not None, "chambers without an image are reported before"
    if chamber.ripple is None and body.chamber[number].ripple is None:
        return None
    own, other = body.ripple_of(chamber), body.ripple_of(body.chamber[number])
    lobes = 0 if own is None else own.lobes
    # cos(k z − l θ) becomes cos(k z' ∓ l (θ' − α)), with the plus sign for a reflection.
    turns = lobes * math.atan2(matrix[1, 0], matrix[0, 0]) / (2.0 * math.pi)
    wanted = own if own is None else own.model_copy(update={"lobes": round(np.linalg.det(matrix)) * lobes})
    if other != wanted or abs(turns - round(turns)) > ROUNDING:
        return (
            f"body.chamber[{index}].ripple",
            f'is not the image of that of "{body.chamber[number].name}"; give both the same amplitude and period, and '
            "mirror images lobes of opposite sign (an even number for the mirror yz)",
        )
    return None


def _same_pressures(problem: Tables, task: Task, images: list[int]) -> bool:
    """Whether chambers and their images have the same pressures in a task, and keep them during the design."""
    names = [chamber.name for chamber in problem.body.chamber]
    pairs = [(name, names[image]) for name, image in zip(names, images, strict=True)]
    given = [(one, task.pressure.get(one), task.pressure.get(other)) for one, other in pairs if one != other]
    return all(one == other and not (one is not None and one.free) for _, one, other in given)


def _tasks(problem: Tables) -> Iterator[Fault]:
    names = [chamber.name for chamber in problem.body.chamber]
    obstacles = [obstacle.name for obstacle in problem.obstacle]
    known = f"the obstacles are {', '.join(obstacles)}" if obstacles else "add a table [[obstacle]]"
    masses = {part.name: part.free.mass for part in problem.obstacle if part.free}
    free = list(masses)
    for number, obstacle in enumerate(problem.obstacle):
        if masses.get(obstacle.name) and not has_weight(problem):
            yield (
                f"obstacle[{number}].free.mass",
                "has no weight without gravity; add a table [gravity], or leave mass out",
            )
    yield from faults_of_loads(problem)
    for index, task in enumerate(problem.task):
        for name in task.pressure:
            if name not in names:
                yield (
                    f"task[{index}].pressure.{name}",
                    f'there is no chamber "{name}"; the chambers are {", ".join(names)}',
                )
        for key, given in (("move", task.moves), ("turn", task.turns)):
            for name in given:
                if name not in obstacles:
                    yield f"task[{index}].{key}.{name}", f'there is no obstacle "{name}"; {known}'
        for key, reason in task.objective.inconsistencies(obstacles, free, problem.end_effector.kind == "plate"):
            yield f"task[{index}].objective.{key}", reason


def _walls(problem: Tables) -> Iterator[Fault]:
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


_BEYOND = 3.0
"""Largest ratio of the starting curvature to its limit; from below it the design loop can reach the limit."""


def _limits_on_states(problem: Tables) -> Iterator[tuple[str, TaskLimits, tuple[Task, ...]]]:
    """The tables of limits on states: their keys, and the tasks that they are for."""
    yield "limits", problem.limits, problem.task
    for index, task in enumerate(problem.task):
        if task.limits is not None:
            yield f"task[{index}].limits", task.limits, (task,)


def _sensitivities(problem: Tables) -> Iterator[Fault]:
    """A limit on the sensitivity is for tasks whose objectives are motions of that kind, at given pressures."""
    units = {"angle": ("a rotation", "mm/kPa"), "length": ("a translation", "deg/kPa")}
    sealed = any(chamber.gas is not None for chamber in problem.body.chamber)
    for key, limits, tasks in _limits_on_states(problem):
        if limits.sensitivity is not None and (sealed or any(task.volumes for task in tasks)):
            yield (
                f"{key}.sensitivity",
                "is not possible with chambers that are sealed or filled to a volume; leave it out, or give pressures",
            )
        for kind, (word, other) in units.items():
            given = limits.sensitivity is not None and getattr(limits.sensitivity, kind) is not None
            if given and not any(task.objective.motions_of(kind) for task in tasks):
                yield (
                    f"{key}.sensitivity",
                    f"is for {word} of the tip, which no objective is about here; give it in {other}, or leave it out",
                )


def _ranges(problem: Tables) -> Iterator[Fault]:
    """A limit on strain is relative to the stated range of every rubber; two models state it by their limits."""
    for name, material in materials(problem).items():
        stated = material.valid_stretch is not None or isinstance(material, (ArrudaBoyce, Gent))
        if problem.limits.strain not in (None, "off") and not stated:
            where = "material" if name == REST else f'the material of region "{name}"'
            yield (
                "limits.strain",
                f"needs the stretch up to which {where} is valid; give it as valid_stretch, or leave the limit out",
            )


def _limits(problem: Tables) -> Iterator[Fault]:
    body, limits = problem.tubes, problem.limits
    tubes = [("the exterior", body.least_radius, "flat", body.ripple, "body.ripple.amplitude")]
    for index, chamber in enumerate(body.chamber):
        key = f"body.chamber[{index}].ripple.amplitude" if chamber.ripple else "body.ripple.amplitude"
        tubes.append((f'chamber "{chamber.name}"', chamber.least_radius, chamber.ends, body.ripple_of(chamber), key))
    for name, radius, _, ripple, key in tubes:
        if ripple and ripple.amplitude >= radius:
            yield key, f"is not smaller than the least radius of {name}; make it smaller"
            return
    if limits.envelope and not limits.envelope.symmetric(operations(body.symmetry), body.length):
        yield (
            "limits.envelope",
            "is not symmetric as the body is by body.symmetry, about the middle of its axis; add the images of its "
            "planes, or leave out the symmetry",
        )
    if limits.envelope and limits.envelope.radius is not None and limits.envelope.radius <= limits.wall:
        yield (
            "limits.envelope.radius",
            f"{limits.envelope.radius:g} mm leaves no room for a chamber between walls of limits.wall = "
            f"{limits.wall:g} mm; make it larger",
        )
    if limits.fold.neighbourhood <= limits.fold.distance:
        yield (
            "limits.fold.neighbourhood",
            f"{limits.fold.neighbourhood:g} mm is not larger than limits.fold.distance = {limits.fold.distance:g} "
            "mm, so even a flat surface would be too close to itself; make it larger",
        )
    for name, radius, ends, ripple, _ in tubes:
        amplitude, wave = (ripple.amplitude, 2 * math.pi / ripple.period) if ripple else (0.0, 0.0)
        # h₁ = ½(k₁² + k₂²): on the tube at the ripple's crests, and on a hemisphere.
        tube = 0.5 * ((radius - amplitude) ** -2 + (amplitude * wave**2) ** 2)
        bend = max(tube, radius**-2 if ends == "pole" else 0.0)
        if bend > _BEYOND * limits.curvature:
            yield (
                "limits.curvature",
                f"{name} starts with a curvature of {bend:.3g} /mm^2, too far above the limit of {limits.curvature:g} "
                "/mm^2; raise the limit, make radii or corners larger, or the ripple flatter",
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
    elements = 6 * volume / size**3
    if elements > MAX_ELEMENTS:
        yield (
            "mesh.size",
            f"{size:g} mm gives about {elements:.0g} elements, more than {MAX_ELEMENTS}; make it larger",
        )


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
