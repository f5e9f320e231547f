"""What is recorded of an accepted design: its history entry, its fields and its checkpoint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pneumorph.analysis import collect_castings, collect_fields, collect_task_results, compute_sag
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import DesignAccepted
from pneumorph.optimize.iterate import Iterate
from pneumorph.optimize.setup import Setup
from pneumorph.results import HistoryEntry


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


def accepted(setup: Setup, current: Iterate, record: StepRecord, clock: Clock) -> DesignAccepted:
    """The event of an accepted design.

    Parameters
    ----------
    setup : of the run.
    current : the design.
    record : how it was reached.
    clock : which has counted its time.
    """
    entry = history_entry(current, record, clock)
    # The sag under weight alone is shown for the first and the last design.
    sag = compute_sag(setup.problem, current.disc, current.analysis) if current.number == 0 else None
    return DesignAccepted(
        iteration=current.number,
        entry=entry,
        body=setup.space.body(current.analysis.phi),
        pressures=current.analysis.pressures,
        fields=collect_fields(current.disc, current.analysis, sag),
        state=checkpoint(setup, current),
    )


def checkpoint(setup: Setup, current: Iterate) -> dict[str, Any]:
    """Arrays and numbers from which a run goes on after a design."""
    return {**current.pack(), "coarse": setup.coarse}


def history_entry(current: Iterate, record: StepRecord, clock: Clock) -> HistoryEntry:
    """The history entry of a design."""
    analysis, disc, seconds = current.analysis, current.disc, clock.seconds()
    unit = sum(tangent.unit_seconds for tangent in disc.tangents.values()) / len(disc.tangents)
    return HistoryEntry(
        iteration=current.number,
        objective=analysis.value,
        optimality=current.optimality,
        tasks=collect_task_results(disc, analysis),
        limits=current.design.report.values() | current.states.values(),
        held=current.feasible and not current.states.unknown,
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
        castings=collect_castings(disc, analysis),
        finer={name: error.fine for name, error in current.errors.items()},
    )
