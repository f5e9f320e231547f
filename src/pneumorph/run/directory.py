"""The run directory: the problem, every accepted design, and the state from which an interrupted run can be resumed.

It contains ``problem.toml``, ``history.jsonl`` (a line per accepted design), ``designs/NNNN.npz``, ``fields/NNNN.npz``
of the first and the last design, ``checkpoint.npz`` and ``result.json``; ``pictures`` and ``report.html`` are
made of these. A design is stored in the order shape, fields, history line, checkpoint, and counts once the checkpoint
is written. Files newer than the checkpoint belong to an unfinished iteration; `resume` removes them.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph import atomic
from pneumorph.errors import NotWritten, ProblemError
from pneumorph.geometry import Body, Surface
from pneumorph.geometry.starting import body_of
from pneumorph.limits.table import in_history
from pneumorph.problem import Problem, codes_of, keep, read
from pneumorph.problem.designed import designed
from pneumorph.problem.reading import read_toml
from pneumorph.results import Fields, HistoryEntry, RunResult, checkpoint, from_json, to_json, unpack_fields
from pneumorph.results.arrays import floats
from pneumorph.run.differences import differences, in_words
from pneumorph.run.lock import NAME, locked
from pneumorph.run.reading import complete_lines, read_arrays, read_json, reporting_damage

Checkpoint = dict[str, Any]
"""Arrays and JSON values by name: what the design loop needs to resume."""

MOST_DESIGNS = 10**6
"""Above all numbers of designs."""

BEYOND = 100.0
"""Farthest that a point of a stored design may lie from the origin, in lengths of the body."""

FOLDERS = ("designs", "fields", "pictures")
"""Folders in which a run is written."""

_NUMBERED = re.compile(r"([0-9]{1,9})\.npz")

_LATER = {"margin": 1.0, "strain": "off"}
"""Limits by default that runs of earlier versions do not have, and the values with which they are off."""

_EPS = 1e-6
"""What rounding may put a value beyond its bounds, N/mm and rad."""


@dataclass(frozen=True)
class StoredDesign:
    """One design as stored.

    Attributes
    ----------
    exterior : ndarray, mm
        Control points of the exterior, for a tube its net (n_r, n_q, 3).
    chambers : dict of str to ndarray, mm
        Those of every chamber, by its name in the problem.
    pressures : dict of str to dict of str to float, MPa
        Pressures by task, then by chamber.
    """

    exterior: np.ndarray
    chambers: dict[str, np.ndarray]
    pressures: dict[str, dict[str, float]]

    @classmethod
    def of(cls, body: Body, pressures: dict[str, dict[str, float]]) -> "StoredDesign":
        """The stored form of a body and its pressures."""
        exterior, *chambers = body.nets()
        return cls(exterior, {each.name: net for each, net in zip(body.chambers, chambers, strict=True)}, pressures)

    def body(self, problem: Problem) -> Body:
        """The body of this design; `problem` is the one it was made for."""
        return self.on(body_of(problem))

    def on(self, start: Body) -> Body:
        """The same from the body with which the run began."""
        nets = [self.exterior, *(self.chambers[chamber.name] for chamber in start.chambers)]
        return start.with_control_points(np.concatenate([net.reshape(-1, 3) for net in nets]))


@dataclass(frozen=True)
class RunDirectory:
    """The directory of a run of `problem`. Made by `create`, `resume` and `open_run`."""

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
            atomic.write_arrays(self._design_path(iteration), self._design_arrays(design), follow=False)
            self.write_fields(iteration, fields)
            atomic.append_line(self.path / "history.jsonl", json.dumps(to_json(entry), allow_nan=False))
            atomic.write_arrays(self.path / "checkpoint.npz", _checkpoint_arrays(iteration, state))
            self._keep_fields_of((0, iteration))

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
            if set(stored.u) != self._tasks():
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
            if set(stored.tasks) != self._tasks() or not self._tasks() <= set(stored.motions):
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
        path = self.path / "checkpoint.npz"
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
        path, start = self._design_path(iteration), self._start
        chambers = [chamber.name for chamber in start.chambers]
        tasks = [task.name for task in self.problem.task]
        most = BEYOND * float(np.abs(start.control_points()).max())
        with reporting_damage(path):
            arrays = read_arrays(path)
            pressures = floats(arrays, "pressures", len(tasks), len(chambers))
            return StoredDesign(
                exterior=_net(arrays, "exterior", start.exterior, most),
                chambers={each.name: _net(arrays, f"chamber_{each.name}", each, most) for each in start.chambers},
                pressures={
                    task: dict(zip(chambers, map(float, row), strict=True))
                    for task, row in zip(tasks, pressures, strict=True)
                },
            )

    @cached_property
    def _start(self) -> Body:
        return body_of(self.problem)

    @cached_property
    def _limits(self) -> set[str]:
        return {key for _, key, _ in in_history(self.problem)}

    def _tasks(self) -> set[str]:
        return {task.name for task in self.problem.task}

    def _lines(self) -> list[str]:
        with reporting_damage(self.path / "history.jsonl"):
            return complete_lines(self.path / "history.jsonl")

    def _entry(self, number: int, text: str) -> HistoryEntry:
        """The entry of a line, by its number in the file; ValueError if it is not one of this run."""
        try:
            entry = from_json(HistoryEntry, json.loads(text))
            if not 0 <= entry.iteration < MOST_DESIGNS:
                raise ValueError(f"it is of design {entry.iteration}")
            if set(entry.tasks) != self._tasks():
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

    def _design_arrays(self, design: StoredDesign) -> dict[str, np.ndarray]:
        chambers = [chamber.name for chamber in self._start.chambers]
        rows = [[design.pressures[task.name][name] for name in chambers] for task in self.problem.task]
        nets = {f"chamber_{name}": design.chambers[name] for name in chambers}
        return {"exterior": design.exterior, **nets, "pressures": np.array(rows)}

    def begin(self) -> None:
        """Store the problem, and remove what is newer than the checkpoint, which an interruption left in part.

        To be called once the run goes on: what is refused before changes nothing in the directory.

        Raises
        ------
        NotWritten
            If the directory cannot be written.
        """
        with self._writing():
            _store(self.path, self.problem)
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


def create(path: str | Path, problem: Problem) -> RunDirectory:
    """Make a new run directory for `problem`; ProblemError if it exists and is not empty, or cannot be made."""
    path = Path(path)
    with _usable(path):
        path.mkdir(parents=True, exist_ok=True)
        if (path / NAME).exists() or _is_empty(path):
            with locked(path):
                if _is_empty(path):
                    _store(path, problem)
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
        raise ProblemError(f"{path}: is not a run directory (no problem.toml in it); name the --out of a design")
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


def _store(path: Path, problem: Problem) -> None:
    """Store the problem of a run."""
    atomic.make_folder(path / "designs")
    atomic.write_bytes(path / "problem.toml", problem.to_toml().encode())
    # It is designed with: opening the run asks nothing.
    keep(codes_of(problem), str(path))


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


def _net(arrays: dict[str, np.ndarray], name: str, start: Surface, most: float) -> np.ndarray:
    """A stored control net, of the shape that it had at the start, and with an extent in every direction."""
    net = floats(arrays, name, *start.shape, 3, most=most)
    if not np.ptp(net.reshape(-1, 3), axis=0).min() > 0.0:
        raise ValueError(f'"{name}" is no body: its points lie in a plane')
    return net.astype(float)


def _checkpoint_arrays(iteration: int, state: Checkpoint) -> dict[str, np.ndarray]:
    arrays = {f"array {name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
    return {"json": np.array(json.dumps({"iteration": iteration, "state": rest})), **arrays}
