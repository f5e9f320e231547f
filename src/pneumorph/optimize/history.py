"""History entries: what is recorded of an accepted design."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pneumorph.analysis import Analysis, Discretisation, collect_task_results
from pneumorph.limits.certify import LimitReport
from pneumorph.optimize.states import StateLimits
from pneumorph.results import HistoryEntry

PHASES = ("geometry", "equilibrium", "gradient", "subproblem")


class Clock:
    """Seconds since its creation, in total and by named phase."""

    def __init__(self):
        self._began = time.perf_counter()
        self._spent: dict[str, float] = dict.fromkeys(PHASES, 0.0)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Count the time inside as part of a phase."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._spent[name] += time.perf_counter() - began

    def seconds(self) -> dict[str, float]:
        """Seconds by phase, and in total."""
        return {**self._spent, "total": time.perf_counter() - self._began}


@dataclass(frozen=True)
class StepRecord:
    """How a design was reached.

    Attributes
    ----------
    factorisations : of all trials.
    remeshed : whether the design has a new mesh.
    step_mm, ratio, evaluations : longest motion of a control point, actual over predicted gain, and how often limits
        were evaluated in the sub-problem; None for the start.
    """

    factorisations: int
    remeshed: bool
    step_mm: float | None = None
    ratio: float | None = None
    evaluations: int | None = None


def history_entry(
    iteration: int,
    analysis: Analysis,
    disc: Discretisation,
    limits: LimitReport,
    states: StateLimits,
    optimality: float,
    clock: Clock,
    record: StepRecord,
) -> HistoryEntry:
    """The history entry of a design; `optimality` is the fraction of the gradient that the limits leave."""
    seconds = clock.seconds()
    unit = sum(tangent.unit_seconds for tangent in disc.tangents.values()) / len(disc.tangents)
    return HistoryEntry(
        iteration=iteration,
        objective=analysis.value,
        optimality=optimality,
        tasks=collect_task_results(disc, analysis),
        limits=limits.values() | states.values(),
        held=limits.satisfied() and not states.broken,
        elements=disc.model.elements,
        dofs=disc.model.size,
        factorisations=record.factorisations,
        seconds=seconds,
        equivalents=seconds["total"] / unit,
        step=record.step_mm,
        ratio=record.ratio,
        remeshed=record.remeshed,
        evaluations=record.evaluations,
        reinforcements=analysis.reinforcements,
    )
