"""A disc of Ecoflex 00-30 that lifts dead loads by air below it (Campbell and others 2025).

A membrane under a dead load balloons at a constant pressure beyond some height, so the volume of air is given, step by
step, and pressure and height follow. A quarter is solved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    configure,
    enclosed_of,
    loads_of,
    model_of,
    part_of,
    settled,
    sweep,
)
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting
from pneumorph.sensitivity import motion_slopes
from pneumorph.validation.comparison import Comparison
from pneumorph.validation.tables import problem_of, table_of

RUBBERS = ("tension_tests", "first_pull")

HEIGHTS = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
"""At which pressures are compared, mm."""

SIZE, QUICK = 10.0, 12.0
"""Of elements, mm. The prediction is that with half of this size, and the difference between both its mesh part."""

STEP, LONG, MOST = 60e3, 120e3, 2.4e6
"""Air that a step adds, mm³, the same if it is to be quick, and most air."""

THICKNESS = 0.1 / 2.0
"""Standard deviation of the thickness, 0.1 mm of 2 mm, relative. Forces of a membrane go with it as with moduli."""


@dataclass(frozen=True, eq=False)
class Lift:
    """Heights (n,) mm and pressures (n,) MPa on the way up, with derivatives by the logarithm of the rubber's moduli.

    Attributes
    ----------
    heights, pressures, by_moduli : (n,)
        The derivative is that of the pressure at a height, MPa.
    reason : str
        Why there are no more; empty if the last height that is compared is reached.
    """

    heights: np.ndarray
    pressures: np.ndarray
    by_moduli: np.ndarray
    reason: str


def discs(quick: bool = False) -> Iterator[Comparison]:
    """Pressures at all heights of the comparison, with every rubber and under every load.

    Parameters
    ----------
    quick : with large elements and steps.
    """
    table, step = table_of("disc"), LONG if quick else STEP
    volumes = np.arange(step, MOST, step)
    for rubber in RUBBERS:
        size = QUICK if quick else SIZE
        coarse, fine = (problem_of("disc", rubber, each) for each in (size, size / 2.0))
        deviation = float(np.hypot(fine.material.scatter or 0.0, THICKNESS))
        for task in fine.task:
            load = _load(task)
            own = table[(table["force_N"] == load) & np.isin(table["height_mm"], HEIGHTS)]
            own = own[np.isfinite(own["pressure_mean_Pa"])]
            until = float(own["height_mm"].max())
            before = lifted(coarse, task, volumes, until)
            # Where the search finds nothing on large elements, it would find no more on small ones, at a high cost.
            lift = lifted(fine, task, volumes, until) if len(before.heights) > 1 else before
            reached = own[_covered(own["height_mm"], lift) & _covered(own["height_mm"], before)]
            at = reached["height_mm"]
            pressures, slopes = _interpolated(at, lift)
            mesh = pressures - _interpolated(at, before)[0]
            yield Comparison(
                body="disc",
                rubber=fine.material.name,
                quantity="pressure",
                unit="kPa",
                case=f"under {load:g} N",
                along="height, mm",
                at=at,
                measured=1e-3 * reached["pressure_mean_Pa"],
                scatter=1e-3 * reached["pressure_sd_Pa"],
                predicted=1e3 * pressures,
                error=1e3 * np.hypot(deviation * slopes, mesh),
                fitted=np.zeros(len(at), bool),
                missing=lift.reason or before.reason,
            )


def _load(task: Task) -> float:
    """The dead load, N."""
    return 0.0 if task.force is None else -task.force[2]


def _covered(heights: np.ndarray, lift: Lift) -> np.ndarray:
    """Which heights a path has."""
    return (heights >= lift.heights.min(initial=np.inf)) & (heights <= lift.heights.max(initial=-np.inf))


def _interpolated(heights: np.ndarray, lift: Lift) -> tuple[np.ndarray, np.ndarray]:
    """Pressures at heights that a path has, and their derivatives by the moduli, MPa."""
    if not len(heights):
        return np.zeros(0), np.zeros(0)
    return np.interp(heights, lift.heights, lift.pressures), np.interp(heights, lift.heights, lift.by_moduli)


def lifted(problem: Problem, task: Task, volumes: np.ndarray, until: float) -> Lift:
    """The path of the disc up to a height, by volumes of air.

    At a volume, Euler's theorem for the potential, which is homogeneous in moduli and load F, gives the derivative of
    the pressure p by the logarithm of the moduli, p − F ∂p/∂F = p − F dh/dV: pressure and height h are its derivatives
    by volume and load. That of h is −F ∂h/∂F. At a height, it is the former less dp/dh times the latter. The pot and
    the weight of the disc are left out of this.

    Parameters
    ----------
    problem : of the disc.
    task : whose load acts.
    volumes : (m,) of air that is added, one after another, mm³.
    until : height at which the path ends, mm.
    """
    under = acting(problem, task)
    mesh = mesh_of(problem, body_of(problem), part_of(problem, [{"A": 0.0}], [under])).mesh
    model = model_of(problem, mesh)
    tangent, loads = Tangent(model), loads_of(problem, model, {"A": 0.0}, under=under)
    path = [configure(model, mesh.points, loads, enclosed=enclosed_of(problem, {"A": each})) for each in volumes]
    found, reason = list[tuple[float, float, float]](), ""
    for at, answer in zip(path, sweep(path, tangent), strict=True):
        if not isinstance(answer, Equilibrium):
            reason = answer.reason
            break
        slopes = motion_slopes(settled(at, answer), tangent, answer.state)
        by_load = float(np.asarray(at.loads.wrench)[2] * np.asarray(slopes.loads[2].wrench)[2])
        found.append((float(answer.plate[2]), answer.enclosed["A"], by_load))
        if found[-1][0] > until:
            break
    heights, pressures, by_load = np.array(found).reshape(-1, 3).T
    if len(found) < 2:
        return Lift(heights, pressures, np.zeros(len(found)), reason or "the path has one state alone")
    rising = np.gradient(heights, volumes[: len(found)])
    at_volume = pressures - _load(task) * rising
    at_height = at_volume + np.gradient(pressures, volumes[: len(found)]) / rising * by_load
    return Lift(heights, pressures, at_height, reason)
