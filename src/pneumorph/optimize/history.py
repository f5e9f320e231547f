"""A line of the history: everything a person wants to know of an accepted design."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.constraint import LimitReport
from pneumorph.mechanics.assembly.plate import rotation_vector
from pneumorph.optimize.analysis import Analysis, Discretisation
from pneumorph.problem import Problem

PHASES = ("geometry", "equilibrium", "gradient", "subproblem")


class Clock:
    """Seconds since it was made, and the parts of them spent in named phases."""

    def __init__(self):
        self._began = time.perf_counter()
        self._spent: dict[str, float] = dict.fromkeys(PHASES, 0.0)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Count what runs inside as part of a phase."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._spent[name] += time.perf_counter() - began

    def seconds(self) -> dict[str, float]:
        """By phase, and in total."""
        return {**self._spent, "total": time.perf_counter() - self._began}


def answers(disc: Discretisation, analysis: Analysis) -> dict[str, dict[str, Any]]:
    """What every task came to: its entry of the history line."""
    told = {}
    for name, found in analysis.equilibria.items():
        objective = disc.objectives[name]
        moved = objective.features(disc.model, analysis.configurations[name].X, found.state)
        told[name] = {
            "pressure_MPa": analysis.pressures[name],
            "objective": analysis.values[name],
            "errors": {key: float(error(moved)) for key, error in objective.errors.items()},
            "translation_mm": np.asarray(moved.translation).tolist(),
            "rotation_rad": np.asarray(moved.rotation).tolist(),
            "section_position_mm": np.asarray(moved.section_position).tolist(),
            "section_rotation_rad": [
                rotation_vector(np.asarray(section)).tolist() for section in moved.section_rotation
            ],
            "volume_mm3": found.volumes,
            "max_stretch": found.max_stretch,
            "beyond_validity": disc.model.rubber.beyond(found.max_stretch),
            "stable": found.stable,
        }
    return told


@dataclass(frozen=True)
class Told:
    """How a design was come by.

    Attributes
    ----------
    factorisations : of all tries.
    remeshed : whether it has a new mesh.
    step_mm, ratio, evaluations : longest motion of a control point, actual over predicted gain, and how often limits
        were evaluated in the sub-problem; None for the start.
    """

    factorisations: int
    remeshed: bool
    step_mm: float | None = None
    ratio: float | None = None
    evaluations: int | None = None


def history_line(
    problem: Problem,
    iteration: int,
    analysis: Analysis,
    disc: Discretisation,
    limits: LimitReport,
    optimality: float,
    clock: Clock,
    told: Told,
) -> dict[str, Any]:
    """The history line of a design.

    `equivalents` is the time of the whole iteration over that of one tangent assembly with factorisation on the same
    mesh; `optimality` is the part of the gradient that the limits leave.
    """
    seconds = clock.seconds()
    unit = sum(tangent.unit_seconds for tangent in disc.tangents.values()) / len(disc.tangents)
    return {
        "iteration": iteration,
        "objective": analysis.value,
        "optimality": optimality,
        "tasks": answers(disc, analysis),
        "limits": limits.values(),
        "held": limits.held(),
        "elements": disc.model.elements,
        "dofs": disc.model.size,
        "factorisations": told.factorisations,
        "seconds": seconds,
        "equivalents": seconds["total"] / unit,
        "step_mm": told.step_mm,
        "ratio": told.ratio,
        "remeshed": told.remeshed,
        "evaluations": told.evaluations,
    }
