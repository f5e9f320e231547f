"""Checks of limits: whether a design can satisfy them, and whether they are consistent with each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneumorph.problem.acting import acting
from pneumorph.problem.body import BodySpec, ChamberSpec, Ripple
from pneumorph.problem.components import component_of
from pneumorph.problem.materials import materials
from pneumorph.problem.models import Task
from pneumorph.problem.regions import REST
from pneumorph.problem.tables import Tables
from pneumorph.problem.task_limits import TaskLimits
from pneumorph.symmetry.operations import operations

_BEYOND = 3.0
"""Largest ratio of the starting curvature to its limit; from below it the design loop can reach the limit."""


def check_shapes(problem: Tables) -> Iterator[tuple[str, str]]:
    body, limits = problem.tubes, problem.limits
    tubes: list[tuple[str, BodySpec | ChamberSpec, Ripple | None, str]]
    tubes = [("the exterior", body, body.ripple, "body.ripple.amplitude")]
    for index, chamber in enumerate(body.chamber):
        key = f"body.chamber[{index}].ripple.amplitude" if chamber.ripple else "body.ripple.amplitude"
        tubes.append((f'chamber "{chamber.name}"', chamber, body.ripple_of(chamber), key))
    for name, shape, ripple, key in tubes:
        if ripple and ripple.amplitude >= shape.least_radius:
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
    along = {name: 0.0 for name, *_ in tubes}
    if body.bent:
        outlines = [body.outline, *(chamber.outline.moved(*chamber.center) for chamber in body.chamber)]
        along = {name: body.bent.bends(outline) for name, outline in zip(along, outlines, strict=True)}
    for name, shape, ripple, _ in tubes:
        radius = shape.least_radius
        amplitude, wave = (ripple.amplitude, 2 * math.pi / ripple.period) if ripple else (0.0, 0.0)
        # h₁ = ½(k₁² + k₂²): on the tube at the ripple's crests and inside a bend, and on domes.
        tube = 0.5 * ((radius - amplitude) ** -2 + (amplitude * wave**2 + along[name]) ** 2)
        bend = max(tube, shape.bend_of_domes)
        if bend > _BEYOND * limits.curvature:
            yield (
                "limits.curvature",
                f"{name} starts with a curvature of {bend:.3g} /mm^2, too far above the limit of {limits.curvature:g} "
                "/mm^2; raise the limit, make radii or corners larger, or the ripple flatter",
            )


def check_states(problem: Tables) -> Iterator[tuple[str, str]]:
    """Bounds on states that not even a body at rest keeps."""
    limits = problem.limits
    for name, material in materials(problem).items():
        if not isinstance(limits.strain, float) or material.valid_stretch is None:
            continue
        if limits.strain * material.valid_stretch <= 1.0:
            where = "" if name == REST else f' of region "{name}"'
            yield (
                "limits.strain",
                f"{limits.strain:g} is out of reach: at rest, the stretch of 1 is {1.0 / material.valid_stretch:.3g} "
                f"of the range of the rubber{where}; use a larger one, usually 1",
            )


def check_ranges(problem: Tables) -> Iterator[tuple[str, str]]:
    """A limit on strain is relative to the stated range of every rubber; two models state it by their limits."""
    for name, material in materials(problem).items():
        stated = material.valid_stretch is not None or material.locks
        if problem.limits.strain not in (None, "off") and not stated:
            where = "material" if name == REST else f'the material of region "{name}"'
            yield (
                "limits.strain",
                f"needs the stretch up to which {where} is valid; give it as valid_stretch, or leave the limit out",
            )


def check_sensitivities(problem: Tables) -> Iterator[tuple[str, str]]:
    """A limit on the sensitivity is for tasks whose objectives are motions of that kind, at given pressures."""
    units = {"angle": ("a rotation", "mm/kPa"), "length": ("a translation", "deg/kPa")}
    sealed = any(chamber.gas is not None for chamber in problem.body.chamber)
    for key, limits, tasks in _limits_on_states(problem):
        if limits.sensitivity is not None and (sealed or any(task.volumes for task in tasks)):
            yield (
                f"{key}.sensitivity",
                "is not possible with chambers that are sealed or filled to a volume; leave it out, or give pressures",
            )
            continue
        for kind, (word, other) in units.items():
            given = limits.sensitivity is not None and getattr(limits.sensitivity, kind) is not None
            if given and not any(task.objective.motions_of(kind) for task in tasks):
                yield (
                    f"{key}.sensitivity",
                    f"is for {word} of the tip, which no objective is about here; give it in {other}, or leave it out",
                )


def check_stiffnesses(problem: Tables) -> Iterator[tuple[str, str]]:
    """A limit on stiffness is for motions of the tip that are free, at given pressures."""
    sealed = any(chamber.gas is not None for chamber in problem.body.chamber)
    for key, limits, tasks in _limits_on_states(problem):
        if limits.stiffness is None:
            continue
        if sealed or any(task.volumes for task in tasks):
            yield (
                f"{key}.stiffness",
                "is not possible with chambers that are sealed or filled to a volume; leave it out, or give pressures",
            )
        for name in limits.stiffness.motions:
            if any(component_of(name) in acting(problem, task).hold.values for task in tasks):
                yield f"{key}.stiffness.{name}", f"{name} is held, so nothing moves; leave it out here, or in hold"


def _limits_on_states(problem: Tables) -> Iterator[tuple[str, TaskLimits, tuple[Task, ...]]]:
    """The tables of limits on states: their keys, and the tasks that they are for."""
    yield "limits", problem.limits, problem.task
    for index, task in enumerate(problem.task):
        if task.limits is not None:
            yield f"task[{index}].limits", task.limits, (task,)
