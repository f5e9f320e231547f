"""Run one member of a study on a Dask worker; run directories are on a disk that all workers share."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import jax

from pneumorph.errors import ComputationError, ProblemError
from pneumorph.optimize import DesignAccepted, Event
from pneumorph.optimize.settings import LoopSettings
from pneumorph.output.pictures import run_pictures
from pneumorph.output.report import write_report
from pneumorph.problem import Problem
from pneumorph.results import HistoryEntry, to_json
from pneumorph.run import differences, in_words, open_run, resume
from pneumorph.run.complete import complete

TOPIC = "pneumorph"


@dataclass(frozen=True)
class MemberEnd:
    """How the run of a member ended: the member's name, whether the loop ended by itself, and why, as a sentence."""

    name: str
    completed: bool
    reason: str


def finished(directory: Path, problem: Problem) -> bool:
    """Whether a directory contains a completed run of this problem, with the same number of designs.

    Raises
    ------
    ProblemError
        If the directory contains a run of another problem, or is a link.
    """
    if directory.is_symlink():
        raise ProblemError(f"{directory}: is a link, which is not followed; put a folder there, or name another --out")
    if not (directory / "problem.toml").exists():
        return False
    run = open_run(directory)
    if keys := differences(run.problem, problem):
        raise ProblemError(f"{directory}: contains a run of another problem ({in_words(keys)}); name another --out")
    result = run.result()
    return run.problem == problem and result is not None and result.completed


def run_member(
    name: str,
    problem: Problem,
    directory: str,
    on_design: Callable[[str, HistoryEntry], None],
    drawn: bool = True,
    begin: str | None = None,
    settings: LoopSettings | None = None,
) -> MemberEnd:
    """Start or resume the run of a member; if the computation fails, its end says so and nothing is raised.

    Parameters
    ----------
    name, problem : name and problem of the member.
    directory : its run directory.
    on_design : called with the name and the history entry of every accepted design.
    drawn : whether its pictures and its page are made.
    begin : the directory of the run with whose last design it begins, see `run.create`.
    settings : of the loop, by default the usual ones.
    """

    def show(event: Event) -> None:
        if isinstance(event, DesignAccepted):
            on_design(name, event.entry)

    if settings is not None:
        if (now := time.time()) > settings.until:
            return MemberEnd(name, False, "there was no time for it")
        settings = replace(settings, until=min(settings.until, now + settings.seconds))
    run = resume(directory, problem, begin)
    try:
        outcome = complete(run, show, settings)
    except ComputationError as error:
        return MemberEnd(name, False, str(error))
    if drawn:
        run_pictures(run)
        write_report(run)
    return MemberEnd(name, outcome.completed, outcome.reason)


def run_on_worker(
    name: str, problem: Problem, directory: str, drawn: bool, begin: str | None, settings: LoopSettings | None
) -> MemberEnd:
    """`run_member` on a Dask worker, which sends a message about every design to the scheduler."""
    from distributed import get_worker

    worker = get_worker()

    def send(name: str, entry: HistoryEntry) -> None:
        # Messages to the scheduler consist of plain values.
        worker.log_event(TOPIC, {"name": name, "entry": to_json(entry)})

    try:
        return run_member(name, problem, directory, send, drawn, begin, settings)
    finally:
        # A worker runs many members, and compiled kernels are on disk: it need not keep them in memory.
        jax.clear_caches()
