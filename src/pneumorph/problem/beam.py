"""How the loads alone would deform a body of tubes, as a slender beam clamped at its base: an estimate in no time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumorph.problem.acting import acting
from pneumorph.problem.materials import materials
from pneumorph.problem.models import Task
from pneumorph.problem.outline import Outline
from pneumorph.problem.tables import Tables

SLICES = 60
"""Slices along the axis in which sections are taken to be constant."""


@dataclass(frozen=True, eq=False)
class Beam:
    """What linear theory says of a body under its plate's loads and its weight, without pressure.

    Attributes
    ----------
    turned : (2,) rotation of the tip about x and y, rad.
    strain : mean strain along the axis; negative where it is pressed together.
    compression : the load along the axis over the one at which the body buckles; 0 under tension.
    """

    turned: NDArray[np.float64]
    strain: float
    compression: float

    @property
    def angle(self) -> float:
        """The rotation of the tip across the axis, rad."""
        return float(np.hypot(*self.turned))


def beam_of(problem: Tables, task: Task) -> Beam | None:
    """The estimate for a task; None where there are no loads, or more than rubber bears them.

    Sheets, fibres, springs, guides and obstacles may bear them. Bodies from files, and those with bent axes, are no
    beams along z.
    """
    under = acting(problem, task)
    weight = np.zeros(3) if under.gravity is None else np.array(under.gravity.vector)
    force, moment = np.array(under.force), np.array(under.moment)
    if not (np.any(weight) or np.any(force) or np.any(moment)):
        return None
    borne = under.hold.values or any(value > 0.0 for _, value in under.spring)
    if problem.solid or problem.tubes.bent or problem.membrane or problem.fibres or problem.obstacle or borne:
        return None
    rubbers = materials(problem).values()
    # Where there are several, the stiffest and the lightest: the estimate is not to make matters worse.
    young = 3.0 * max(rubber.initial_shear_modulus for rubber in rubbers)
    density = min(rubber.density for rubber in rubbers)
    length = problem.tubes.length
    dz, z, areas, seconds = _slices(problem)
    # What acts above each height: force, and moment about its own place on the axis.
    own = density * areas[:, None] * weight * dz
    above = force + np.cumsum(own[::-1], axis=0)[::-1] - own / 2.0
    levers = np.cumsum((own * z[:, None])[::-1], axis=0)[::-1] - z[:, None] * np.cumsum(own[::-1], axis=0)[::-1]
    across = (length - z)[:, None] * force + levers
    bending = moment[:2] + np.column_stack([-across[:, 1], across[:, 0]])
    curvature = np.linalg.solve(young * seconds, bending[:, :, None])[:, :, 0]
    # Of its own weight three tenths count as if they were at its tip.
    pressed = -(force[2] + 0.315 * float(own[:, 2].sum()))
    return Beam(
        curvature.sum(axis=0) * dz,
        float(np.mean(above[:, 2] / (young * areas))),
        max(float(pressed) / _critical(length, young * seconds), 0.0),
    )


def column_load(problem: Tables) -> float:
    """The force (N) along z at which a body of straight tubes buckles as a column, clamped at its base alone.

    Sheets and fibres are not counted.
    """
    young = 3.0 * max(rubber.initial_shear_modulus for rubber in materials(problem).values())
    return _critical(problem.tubes.length, young * _slices(problem)[3])


def _critical(length: float, stiffness: NDArray[np.float64]) -> float:
    """Euler's load, N, of a column clamped at one end, from the stiffness (n, 2, 2) of its slices in bending."""
    return math.pi**2 / (4.0 * length**2 * float(np.mean(1.0 / np.linalg.eigvalsh(stiffness)[:, 0])))


def _slices(problem: Tables) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Thickness (mm) and heights (n,) of slices across the axis, with areas (n,) and second moments (n, 2, 2)."""
    dz = problem.tubes.length / SLICES
    z = np.asarray(dz * (np.arange(SLICES) + 0.5), dtype=np.float64)
    areas, seconds = (np.array(each) for each in zip(*(_section(problem, float(height)) for height in z), strict=True))
    return dz, z, areas, seconds


def key_of_loads(problem: Tables, index: int) -> str:
    """The key of what loads the plate in a task by its index, or else of the weight."""
    task = problem.task[index]
    under = acting(problem, task)
    key = next((key for key in ("force", "moment") if any(getattr(under, key))), "gravity")
    if getattr(task, key) is not None:
        return f"task[{index}].{key}"
    return key if key == "gravity" else f"end_effector.{key}"


def _section(problem: Tables, height: float) -> tuple[float, NDArray[np.float64]]:
    """Area (mm²) of the rubber at a height, and its second moments about x and y (2, 2) through its centroid (mm⁴)."""
    body = problem.tubes
    outside = body.outline.scaled(1.0 + (body.taper - 1.0) * height / body.length)
    parts = [(1.0, outside)]
    for chamber in body.chamber:
        start, end = chamber.span
        if start < height < end:
            size = 1.0 + (chamber.taper - 1.0) * (height - start) / (end - start)
            parts.append((-1.0, chamber.outline.scaled(size).moved(*chamber.center)))
    moments = [(sign, *_moments(outline)) for sign, outline in parts]
    area = sum(sign * own for sign, own, _, _ in moments)
    second = np.sum([sign * own for sign, _, _, own in moments], axis=0)
    x, y = np.sum([sign * own for sign, _, own, _ in moments], axis=0) / area
    (xx, xy), (_, yy) = second - area * np.outer((x, y), (x, y))
    return float(area), np.array([[yy, -xy], [-xy, xx]])


def _moments(outline: Outline) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Area, first moments (2,) and second moments (2, 2) of what is inside a polygon, by its triangles from 0."""
    one = outline.points
    other = np.roll(one, -1, axis=0)
    twice = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    middle = one + other
    squares = sum(np.einsum("n,ni,nj->ij", twice, each, each) for each in (one, other, middle))
    return float(twice.sum()) / 2.0, (twice[:, None] * middle).sum(axis=0) / 6.0, np.asarray(squares) / 24.0
