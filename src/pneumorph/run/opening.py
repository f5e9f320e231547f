"""Make the directory of a run, and open one that is there, for resuming the run or for reading."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumorph.errors import ProblemError
from pneumorph.mechanics import part_of
from pneumorph.problem import Problem, read
from pneumorph.problem.reading import read_toml
from pneumorph.run.differences import differences, in_words
from pneumorph.run.directory import Checkpoint, RunDirectory, store
from pneumorph.run.lock import NAME, locked

_LATER = {"margin": 1.0, "strain": "off"}
"""Limits by default that runs of earlier versions do not have, and the values with which they are off."""


_OF_TASKS = re.compile(r"task\[[0-9]+\]\.(objective|limits|weight)\b|limits\.(motion|at_least|stiffness|sensitivity)\b")
"""Keys in which a problem may differ from that of the run with whose design it begins: what is asked of the body."""


def create(path: str | Path, problem: Problem, begin: str | Path | None = None) -> RunDirectory:
    """Make a new run directory.

    Parameters
    ----------
    path : of the directory.
    problem : of the run.
    begin : the directory of a run of the same body with whose last design this one begins.

    Raises
    ------
    ProblemError
        If the directory exists and is not empty, cannot be made, or the other run is of another body.
    """
    path = Path(path)
    state = None if begin is None else _beginning(Path(begin), problem)
    with _usable(path):
        path.mkdir(parents=True, exist_ok=True)
        if (path / NAME).exists() or _is_empty(path):
            with locked(path):
                if _is_empty(path):
                    run = RunDirectory(path, problem)
                    if state is not None:
                        run.begin_with(*state)
                    store(path, problem)
                    return run
        raise ProblemError(f"{path}: is not empty; add --resume to resume the run in it, or name another --out")


def _beginning(path: Path, problem: Problem) -> tuple[int, Checkpoint]:
    """The checkpoint of a run with whose last design a problem can begin."""
    other = open_run(path)
    if other.resumable() is None:
        raise ProblemError(f"{path}: has no finished design to begin with; name another run")
    count = len(other.problem.task)
    alike, more = problem.model_copy(update={"task": problem.task[:count]}), problem.task[count:]
    keys = [key for key in differences(other.problem, alike) if not _OF_TASKS.match(key)]
    keys = [key for key in keys if not key.startswith("optimizer.") and key != "mesh.size"]
    if keys or len(problem.task) < count or any(task.pressures_of is None for task in more):
        raise ProblemError(
            f"{path}: its designs are of another problem ({in_words(keys or ['task'])}); only what tasks ask for, "
            "limits on motions, the size of elements and the optimizer may be others, and tasks be added that have the "
            "pressures of another"
        )
    if part_of(other.problem) != part_of(problem):
        raise ProblemError(
            f"{path}: another part of the body is solved for these tasks; begin with the body at rest, without --begin"
        )
    iteration, state = other.checkpoint()
    other_size = other.problem.mesh.size != problem.mesh.size or bool(state.get("coarse"))
    return iteration, {**state, "on_new_mesh": True} if other_size else state


def resume(path: str | Path, problem: Problem, begin: str | Path | None = None) -> RunDirectory:
    """Open the directory of an interrupted run of `problem` for resuming; nothing is changed before it begins.

    The number of iterations, and other keys that do not change what is designed (`HARMLESS`), may differ from those of
    the interrupted run. Without a run in the directory a new one is made, which begins with the last design of the run
    in the directory `begin`, if that is given.

    Raises
    ------
    ProblemError
        If it contains a run of another problem, or other files but no run, or another run goes on in it. Nothing has
        been changed then.
    """
    path = Path(path)
    if not (path / "problem.toml").exists():
        return create(path, problem, begin)
    stored = _problem_of(path)
    if stored != problem and not differences(read(path / "problem.toml"), problem):
        # A run goes on with the limits with which it began.
        problem = problem.with_changes(_not_yet(path))
    if keys := differences(stored, problem):
        raise ProblemError(
            f"{path}: contains a run of another problem ({in_words(keys)}); name another --out or use "
            f"{path}/problem.toml"
        )
    with _usable(path), locked(path):
        run = RunDirectory(path, problem)
        run.latest()
        run.check_folders()
        return run


def open_run(path: str | Path) -> RunDirectory:
    """Open a run directory for reading; nothing in it is changed. ProblemError if it is not a run directory.

    Code in its problem passes: `interface.open_run`, from which all get a run that may execute it, asks about that.
    """
    path = Path(path)
    if not (path / "problem.toml").exists():
        raise ProblemError(
            f"{path}: is not a run directory (no problem.toml in it); give the one that pneumorph design wrote"
        )
    return RunDirectory(path, _problem_of(path))


def _problem_of(path: Path) -> Problem:
    """The problem of a run, without the limits by default that came after it was made."""
    problem = read(path / "problem.toml")
    later = _not_yet(path)
    return problem.with_changes(later) if later else problem


def _not_yet(path: Path) -> dict[str, Any]:
    """The limits by default that a run does not have, since it was made by an earlier version, and how they are off."""
    given = read_toml(path / "problem.toml", str(path), "the problem file").get("limits", {})
    return {f"limits.{key}": off for key, off in _LATER.items() if key not in given}


def _is_empty(path: Path) -> bool:
    return all(entry.name.startswith(".") for entry in path.iterdir())


@contextmanager
def _usable(path: Path) -> Iterator[None]:
    """Raise ProblemError, one line, where a directory cannot be that of a run."""
    try:
        yield
    except OSError as error:
        raise ProblemError(
            f"{path}: cannot be a run directory ({error.strerror or error}); name another --out"
        ) from None
