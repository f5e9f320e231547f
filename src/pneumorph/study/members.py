"""Run one member of a study where a Dask worker is: its run directory is on a disk that all workers share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import jax

from pneumorph.analysis import HistoryEntry, to_json
from pneumorph.drive import drive
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.mesh import keep_netgen_quiet
from pneumorph.optimize import DesignAccepted, Event
from pneumorph.output.pictures import run_pictures
from pneumorph.problem import Problem
from pneumorph.run import open_run, resume, unlike

TOPIC = "pneumorph"


@dataclass(frozen=True)
class MemberEnd:
    """How a member ended: its name, whether the loop came to its own end, and why, as a sentence."""

    name: str
    completed: bool
    reason: str


def finished(directory: Path, problem: Problem) -> bool:
    """Whether a run of this problem has come to its end in a directory; one of another number of designs goes on.

    Raises
    ------
    ProblemError
        When the directory holds a run of another problem.
    """
    if not (directory / "problem.toml").exists():
        return False
    run = open_run(directory)
    key = unlike(run.problem, problem)
    if key:
        raise ProblemError(f"{directory}: holds a run of another problem ({key} differs); name another --out")
    result = run.result()
    return run.problem == problem and result is not None and result.completed


def run_member(name: str, problem: Problem, directory: str, tell: Callable[[str, HistoryEntry], None]) -> MemberEnd:
    """Start or go on with a member's run; a failure of the computation is an end too, not an error.

    Parameters
    ----------
    name, problem : of the member.
    directory : of its run.
    tell : hears of every accepted design: the name and its history entry.
    """

    def show(event: Event) -> None:
        if isinstance(event, DesignAccepted):
            tell(name, event.entry)

    run = resume(directory, problem)
    try:
        outcome = drive(run, show)
    except ComputationError as error:
        return MemberEnd(name, False, str(error))
    run_pictures(run)
    return MemberEnd(name, outcome.completed, outcome.reason)


def run_on_worker(name: str, problem: Problem, directory: str) -> MemberEnd:
    """`run_member` on a Dask worker, which tells the scheduler of every design."""
    from distributed import get_worker

    keep_netgen_quiet()
    worker = get_worker()

    def tell(name: str, entry: HistoryEntry) -> None:
        # Messages to the scheduler are of plain values.
        worker.log_event(TOPIC, {"name": name, "entry": to_json(entry)})

    try:
        return run_member(name, problem, directory, tell)
    finally:
        # A worker runs many members: compiled kernels are kept on disk, not in its memory.
        jax.clear_caches()
