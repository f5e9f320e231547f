"""The run directory: the problem, every accepted design, and the state from which an interrupted run can be resumed.

It contains ``problem.toml``, ``history.jsonl`` (a line per accepted design), ``designs/NNNN.npz``, ``fields/NNNN.npz``
of the first and the last design, ``checkpoint.npz`` and ``result.json``, and ``begin.npz`` where the run begins with
a design of another one; ``pictures`` and ``report.html`` are made of these. A design is stored in the order shape,
fields, history line, checkpoint, and counts once the checkpoint is written. Files newer than the checkpoint belong to
an unfinished iteration; `resume` removes them.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph import atomic
from pneumorph.errors import NotWritten, ProblemError
from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of
from pneumorph.limits.obstacles import OBSTACLES
from pneumorph.limits.table import in_history
from pneumorph.problem import Problem, codes_of, keep
from pneumorph.problem.designed import designed
from pneumorph.results import Fields, FineResult, HistoryEntry, RunResult, checkpoint, from_json, to_json, unpack_fields
from pneumorph.run.reading import complete_lines, read_arrays, read_json, reporting_damage
from pneumorph.run.stored import StoredDesign, unpack_design

Checkpoint = dict[str, Any]
"""Arrays and JSON values by name: what the design loop needs to resume."""

MOST_DESIGNS = 10**6
"""Above all numbers of designs."""

BEGIN = "begin.npz"
"""The checkpoint of the run whose last design is the start of this one, where it begins with that."""

FOLDERS = ("designs", "fields", "pictures")
"""Folders in which a run is written."""

_NUMBERED = re.compile(r"([0-9]{1,9})\.npz")

_EPS = 1e-6
"""What rounding may put a value beyond its bounds, N/mm and rad."""


@dataclass(frozen=True)
class RunDirectory:
    """The directory of a run of `problem`. Made by `create`, `resume` and `open_run` in `opening.py`."""

    path: Path
    problem: Problem

    def record(self, entry: HistoryEntry, design: StoredDesign, fields: Fields, state: Checkpoint) -> None:
        """Store an accepted design.

        Parameters
        ----------
        entry : HistoryEntry
        design : StoredDesign
            Shape and pressures.
        fields : Fields
            Of it.
        state : Checkpoint
            For resuming after it.
        """
        iteration = entry.iteration
        with self._writing():
            atomic.write_arrays(self._design_path(iteration), design.pack(self._tasks), follow=False)
            self.write_fields(iteration, fields)
            atomic.append_line(self.path / "history.jsonl", json.dumps(to_json(entry), allow_nan=False))
            atomic.write_arrays(self.path / "checkpoint.npz", _checkpoint_arrays(iteration, state))
            self._keep_fields_of((0, iteration))

    def amend(self, finer: Mapping[str, FineResult]) -> None:
        """Store estimates without the error of the mesh in the last line of the history, once a run has ended."""
        *before, last = self.history()
        if finer == last.finer:
            return
        lines = [*self._lines()[: len(before)], json.dumps(to_json(replace(last, finer=finer)), allow_nan=False)]
        with self._writing():
            atomic.write_bytes(self.path / "history.jsonl", "".join(f"{line}\n" for line in lines).encode())

    def write_fields(self, iteration: int, fields: Fields) -> None:
        """Store the fields of a design."""
        with self._writing():
            atomic.make_folder(self.path / "fields")
            atomic.write_arrays(self._fields_path(iteration), fields.pack(), follow=False)

    def fields(self, iteration: int) -> Fields | None:
        """The stored fields of a design, None if there are none: only those of the first and the last are kept."""
        path = self._fields_path(iteration)
        if not path.exists():
            return None
        with reporting_damage(path):
            stored = unpack_fields(read_arrays(path))
            if set(stored.u) != set(self._tasks):
                raise ValueError("its tasks are not those of the problem")
            return stored

    def write_result(self, result: RunResult) -> None:
        """Store ``result.json``."""
        text = json.dumps(to_json(result), indent=2, allow_nan=False, ensure_ascii=False)
        with self._writing():
            atomic.write_bytes(self.path / "result.json", f"{text}\n".encode())

    def result(self) -> RunResult | None:
        """Contents of ``result.json``, None if the run has not ended; ProblemError if it cannot be read."""
        path = self.path / "result.json"
        if not path.exists():
            return None
        with reporting_damage(path, "remove it and run with --resume"):
            stored = from_json(RunResult, read_json(path))
            if set(stored.tasks) != set(self._tasks) or not set(self._tasks) <= set(stored.motions):
                raise ValueError("its tasks are not those of the problem")
            return stored

    def history(self) -> list[HistoryEntry]:
        """The history in the order of iterations; an incomplete last line is ignored."""
        path = self.path / "history.jsonl"
        with reporting_damage(path):
            entries = [self._entry(number, text) for number, text in enumerate(complete_lines(path), start=1)]
            for one, following in pairwise(entries):
                if following.iteration <= one.iteration:
                    raise ValueError(f"design {following.iteration} follows design {one.iteration}")
            return entries

    def latest(self) -> int | None:
        """The iteration of the checkpoint; None before the first.

        Raises
        ------
        ProblemError
            If its history line or its design is missing, or the checkpoint itself is although designs are finished.
        """
        if not (self.path / "checkpoint.npz").exists():
            # The first design is stored in part before its checkpoint is.
            if self._design_path(1).exists() or (self.path / "result.json").exists() or len(self._lines()) > 1:
                raise ProblemError(
                    f"{self.path}: has finished designs, but checkpoint.npz is missing; restore that file or name "
                    "another directory"
                )
            return None
        iteration, _ = self.checkpoint()
        if self._design_path(iteration).exists() and any(entry.iteration == iteration for entry in self.history()):
            return iteration
        raise ProblemError(
            f"{self.path}: design {iteration} of its checkpoint is not in history.jsonl and designs/; "
            "restore the files or name another directory"
        )

    def checkpoint(self) -> tuple[int, Checkpoint]:
        """Iteration and state of the checkpoint."""
        return self._state("checkpoint.npz")

    def begin_with(self, iteration: int, state: Checkpoint) -> None:
        """Store the checkpoint of another run, with whose design this one begins."""
        with self._writing():
            atomic.write_arrays(self.path / BEGIN, _checkpoint_arrays(iteration, state))

    def begun_from(self) -> Checkpoint | None:
        """The state of a design of another run with which this one begins, checked to be one; None without any."""
        if not (self.path / BEGIN).exists():
            return None
        _, state = self._state(BEGIN)
        with reporting_damage(self.path / BEGIN):
            checkpoint.check(self.problem, state)
        return state

    def _state(self, name: str) -> tuple[int, Checkpoint]:
        path = self.path / name
        with reporting_damage(path):
            arrays = read_arrays(path)
            plain = json.loads(arrays.pop("json").item())
            state = {name.removeprefix("array "): array for name, array in arrays.items()}
            iteration = plain["iteration"]
            if not isinstance(iteration, int) or not 0 <= iteration < MOST_DESIGNS:
                raise ValueError("its number is none of a design")
            return iteration, plain["state"] | state

    def resumable(self) -> Checkpoint | None:
        """The state from which the run can be resumed, checked to be one; None before the first design."""
        if self.latest() is None:
            return None
        _, state = self.checkpoint()
        with reporting_damage(self.path / "checkpoint.npz"):
            checkpoint.check(self.problem, state)
        return state

    def load_design(self, iteration: int) -> StoredDesign:
        """The design of an iteration; ProblemError if there is none."""
        path = self._design_path(iteration)
        with reporting_damage(path):
            return unpack_design(read_arrays(path), self._start, self._tasks)

    @cached_property
    def _start(self) -> Body:
        return body_of(self.problem)

    @cached_property
    def _limits(self) -> set[str]:
        # Runs of versions without a limit on obstacles stay readable.
        return {key for limit, key, _ in in_history(self.problem) if limit is not OBSTACLES}

    @property
    def _tasks(self) -> list[str]:
        return [task.name for task in self.problem.task]

    def _lines(self) -> list[str]:
        with reporting_damage(self.path / "history.jsonl"):
            return complete_lines(self.path / "history.jsonl")

    def _entry(self, number: int, text: str) -> HistoryEntry:
        """The entry of a line, by its number in the file; ValueError if it is not one of this run."""
        try:
            entry = from_json(HistoryEntry, json.loads(text))
            if not 0 <= entry.iteration < MOST_DESIGNS:
                raise ValueError(f"it is of design {entry.iteration}")
            if set(entry.tasks) != set(self._tasks):
                raise ValueError("its tasks are not those of the problem")
            if not self._has_data(entry.reinforcements):
                raise ValueError("its sheets and fibres are not those of the problem")
            if missing := self._limits - set(entry.limits) or {"total"} - set(entry.seconds):
                raise KeyError(min(missing))
            return entry
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            words = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ValueError(f"line {number}: {words}") from None

    def _has_data(self, values: Mapping[str, Mapping[str, float]]) -> bool:
        """Whether values are those of what is designed of the problem's sheets and fibres, and within the bounds."""
        wanted = designed(self.problem)
        if {name: set(own) for name, own in values.items()} != {name: set(own) for name, own in wanted.items()}:
            return False
        bounded = [(values[name][key], own) for name, data in wanted.items() for key, own in data.items()]
        return all(own.min - _EPS <= value <= own.max + _EPS for value, own in bounded)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Raise NotWritten, one line, where the run's files cannot be written."""
        try:
            yield
        except OSError as error:
            raise NotWritten(
                f"{self.path}: cannot be written ({error.strerror or error}); what is in it is whole; make room, or "
                "make it writable"
            ) from None

    def _design_path(self, iteration: int) -> Path:
        return self.path / "designs" / f"{iteration:04d}.npz"

    def _fields_path(self, iteration: int) -> Path:
        return self.path / "fields" / f"{iteration:04d}.npz"

    def check_folders(self) -> None:
        """Raise OSError where a folder in which a run writes is a link, or no folder."""
        for name in FOLDERS:
            if os.path.lexists(self.path / name):
                with atomic.opened(self.path / name, follow=False):
                    pass

    def _keep_fields_of(self, iterations: tuple[int, ...]) -> None:
        self._remove("fields", lambda number: number not in iterations)

    def begin(self) -> None:
        """Store the problem, and remove what is newer than the checkpoint, which an interruption left in part.

        To be called once the run goes on: what is refused before changes nothing in the directory.

        Raises
        ------
        NotWritten
            If the directory cannot be written.
        """
        with self._writing():
            store(self.path, self.problem)
            self._remove_unfinished()

    def _remove_unfinished(self) -> None:
        latest = self.latest()
        finished = -1 if latest is None else latest
        kept = sum(entry.iteration <= finished for entry in self.history())
        text = "".join(f"{line}\n" for line in self._lines()[:kept])
        atomic.write_bytes(self.path / "history.jsonl", text.encode())
        self._remove("designs", lambda number: number > finished)
        self._keep_fields_of((0, finished) if finished >= 0 else ())

    def _remove(self, folder: str, unwanted: Callable[[int], bool]) -> None:
        """Remove the arrays of unwanted designs from a folder of the run; nothing is done where there is none."""
        if not os.path.lexists(self.path / folder):
            return
        with atomic.opened(self.path / folder, follow=False) as there:
            for name in there.names():
                if (number := _NUMBERED.fullmatch(name)) and unwanted(int(number[1])):
                    there.remove(name)


def store(path: Path, problem: Problem) -> None:
    """Store the problem of a run in its directory."""
    atomic.make_folder(path / "designs")
    atomic.write_bytes(path / "problem.toml", problem.to_toml().encode())
    # It is designed with: opening the run asks nothing.
    keep(codes_of(problem), str(path))


def _checkpoint_arrays(iteration: int, state: Checkpoint) -> dict[str, np.ndarray]:
    arrays = {f"array {name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
    return {"json": np.array(json.dumps({"iteration": iteration, "state": rest})), **arrays}
