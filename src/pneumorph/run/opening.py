"""Make the directory of a run, and open one that is there, for resuming the run or for reading."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, read
from pneumorph.problem.reading import read_toml
from pneumorph.run.differences import differences, in_words
from pneumorph.run.directory import RunDirectory, store
from pneumorph.run.lock import NAME, locked

_LATER = {"margin": 1.0, "strain": "off"}
"""Limits by default that runs of earlier versions do not have, and the values with which they are off."""


def create(path: str | Path, problem: Problem) -> RunDirectory:
    """Make a new run directory for `problem`; ProblemError if it exists and is not empty, or cannot be made."""
    path = Path(path)
    with _usable(path):
        path.mkdir(parents=True, exist_ok=True)
        if (path / NAME).exists() or _is_empty(path):
            with locked(path):
                if _is_empty(path):
                    store(path, problem)
                    return RunDirectory(path, problem)
        raise ProblemError(f"{path}: is not empty; add --resume to resume the run in it, or name another --out")


def resume(path: str | Path, problem: Problem) -> RunDirectory:
    """Open the directory of an interrupted run of `problem` for resuming; nothing is changed before it begins.

    The number of iterations, and other keys that do not change what is designed (`HARMLESS`), may differ from those of
    the interrupted run. Without a run in the directory a new one is made.

    Raises
    ------
    ProblemError
        If it contains a run of another problem, or other files but no run, or another run goes on in it. Nothing has
        been changed then.
    """
    path = Path(path)
    if not (path / "problem.toml").exists():
        return create(path, problem)
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
