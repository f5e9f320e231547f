"""The run directory: the problem, every accepted design, and the state from which an interrupted run can be resumed.

It contains ``problem.toml``, ``history.jsonl`` (a line per accepted design), ``designs/NNNN.npz``, ``fields/NNNN.npz``
of the first and the last design, ``checkpoint.npz`` and ``result.json``; ``pictures`` and ``report.html`` are
made of these. A design is stored in the order shape, fields, history line, checkpoint, and counts once the checkpoint
is written. Files newer than the checkpoint belong to an unfinished iteration; `resume` removes them.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.analysis import Fields, HistoryEntry, RunResult, from_json, to_json, unpack_fields
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body, starting_body
from pneumorph.problem import Problem, codes_of, keep, read
from pneumorph.run import atomic

Checkpoint = dict[str, Any]
"""Arrays and JSON values by name: what the design loop needs to resume."""


@dataclass(frozen=True)
class StoredDesign:
    """One design as stored.

    Attributes
    ----------
    exterior : ndarray, shape (n_r, n_q, 3), mm
        Control net of the exterior.
    chambers : dict of str to ndarray, shape (n_r, n_q, 3), mm
        Control net of every chamber, by its name in the problem.
    pressures : dict of str to dict of str to float, MPa
        Pressures by task, then by chamber.
    """

    exterior: np.ndarray
    chambers: dict[str, np.ndarray]
    pressures: dict[str, dict[str, float]]

    @classmethod
    def of(cls, body: Body, pressures: dict[str, dict[str, float]]) -> "StoredDesign":
        """The stored form of a body and its pressures."""
        return cls(body.exterior.net, {chamber.name: chamber.net for chamber in body.chambers}, pressures)

    def body(self, problem: Problem) -> Body:
        """The body of this design; `problem` is the one it was made for."""
        start = starting_body(problem.body)
        nets = [self.exterior, *(self.chambers[chamber.name] for chamber in start.chambers)]
        return start.with_control_points(np.concatenate([net.reshape(-1, 3) for net in nets]))


@dataclass(frozen=True)
class RunDirectory:
    """The directory of a run of `problem`. Made by `create`, `resume` and `open_run`."""

    path: Path
    problem: Problem

    def record(self, entry: HistoryEntry, design: StoredDesign, fields: Fields, state: Checkpoint) -> None:
        """Store an accepted design: history entry, shape and pressures, fields, and the state for resuming after it."""
        iteration = entry.iteration
        atomic.write_arrays(self._design_path(iteration), self._design_arrays(design))
        self.write_fields(iteration, fields)
        atomic.append_line(self.path / "history.jsonl", json.dumps(to_json(entry), allow_nan=False))
        atomic.write_arrays(self.path / "checkpoint.npz", _checkpoint_arrays(iteration, state))
        self._keep_fields_of((0, iteration))

    def write_fields(self, iteration: int, fields: Fields) -> None:
        """Store the fields of a design."""
        (self.path / "fields").mkdir(exist_ok=True)
        atomic.write_arrays(self._fields_path(iteration), fields.pack())

    def fields(self, iteration: int) -> Fields | None:
        """The stored fields of a design, None without: only those of the first and the last design are kept."""
        path = self._fields_path(iteration)
        if not path.exists():
            return None
        with _reporting_damage(path):
            return unpack_fields(atomic.read_arrays(path))

    def write_result(self, result: RunResult) -> None:
        """Store ``result.json``."""
        text = json.dumps(to_json(result), indent=2, allow_nan=False, ensure_ascii=False)
        atomic.write_bytes(self.path / "result.json", f"{text}\n".encode())

    def result(self) -> RunResult | None:
        """Contents of ``result.json``; None if the run has not ended."""
        path = self.path / "result.json"
        if not path.exists():
            return None
        try:
            return from_json(RunResult, json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, KeyError) as error:
            raise ProblemError(f"{path}: cannot be read ({error}); remove it and run with --resume") from None

    def history(self) -> list[HistoryEntry]:
        """The history in the order of iterations; an incomplete last line is ignored."""
        path = self.path / "history.jsonl"
        with _reporting_damage(path):
            return [from_json(HistoryEntry, json.loads(text)) for text in atomic.complete_lines(path)]

    def latest(self) -> int | None:
        """The iteration of the checkpoint; None before the first.

        Raises
        ------
        ProblemError
            If its history line or its design is missing.
        """
        if not (self.path / "checkpoint.npz").exists():
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
        with _reporting_damage(path):
            arrays = atomic.read_arrays(path)
            plain = json.loads(arrays.pop("json").item())
            state = {name.removeprefix("array "): array for name, array in arrays.items()}
            return plain["iteration"], plain["state"] | state

    def load_design(self, iteration: int) -> StoredDesign:
        """The design of an iteration; ProblemError if there is none."""
        path = self._design_path(iteration)
        chambers = [chamber.name for chamber in self.problem.body.chamber]
        with _reporting_damage(path):
            arrays = atomic.read_arrays(path)
            pressures = zip((task.name for task in self.problem.task), arrays["pressures"], strict=True)
            return StoredDesign(
                exterior=arrays["exterior"],
                chambers={name: arrays[f"chamber_{name}"] for name in chambers},
                pressures={task: dict(zip(chambers, map(float, row), strict=True)) for task, row in pressures},
            )

    def _design_path(self, iteration: int) -> Path:
        return self.path / "designs" / f"{iteration:04d}.npz"

    def _fields_path(self, iteration: int) -> Path:
        return self.path / "fields" / f"{iteration:04d}.npz"

    def _keep_fields_of(self, iterations: tuple[int, ...]) -> None:
        for stored in (self.path / "fields").glob("[0-9]*.npz"):
            if int(stored.stem) not in iterations:
                stored.unlink()

    def _design_arrays(self, design: StoredDesign) -> dict[str, np.ndarray]:
        chambers = [chamber.name for chamber in self.problem.body.chamber]
        rows = [[design.pressures[task.name][name] for name in chambers] for task in self.problem.task]
        nets = {f"chamber_{name}": design.chambers[name] for name in chambers}
        return {"exterior": design.exterior, **nets, "pressures": np.array(rows)}

    def _remove_unfinished(self) -> None:
        """Remove what is newer than the checkpoint: an iteration that was interrupted while it was being stored."""
        latest = self.latest()
        finished = -1 if latest is None else latest
        lines = atomic.complete_lines(self.path / "history.jsonl")
        text = "".join(f"{line}\n" for line in lines if json.loads(line)["iteration"] <= finished)
        atomic.write_bytes(self.path / "history.jsonl", text.encode())
        for stored in (self.path / "designs").glob("[0-9]*.npz"):
            if int(stored.stem) > finished:
                stored.unlink()
        self._keep_fields_of((0, finished) if finished >= 0 else ())


def create(path: str | Path, problem: Problem) -> RunDirectory:
    """Make a new run directory for `problem`; ProblemError if it exists and is not empty, or cannot be made."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        if any(not entry.name.startswith(".") for entry in path.iterdir()):
            raise ProblemError(f"{path}: is not empty; add --resume to resume the run in it, or name another --out")
        return _started(path, problem)
    except OSError as error:
        raise ProblemError(f"{path}: cannot be a run directory ({error.strerror}); name another --out") from None


def resume(path: str | Path, problem: Problem) -> RunDirectory:
    """Prepare the directory of an interrupted run of `problem` for resuming: remove what was unfinished.

    The number of iterations may differ from that of the interrupted run. Without a run in the directory a new one is
    made.

    Raises
    ------
    ProblemError
        If it contains a run of another problem, or other files but no run.
    """
    path = Path(path)
    if not (path / "problem.toml").exists():
        return create(path, problem)
    stored = read(path / "problem.toml")
    key = first_difference(stored, problem)
    if key:
        raise ProblemError(
            f"{path}: contains a run of another problem ({key} differs); name another --out or use {path}/problem.toml"
        )
    run = _started(path, problem)
    run._remove_unfinished()
    return run


def open_run(path: str | Path) -> RunDirectory:
    """Open a run directory for reading; nothing in it is changed. ProblemError if it is not a run directory.

    Code in its problem passes: `interface.open_run`, from which all get a run that may execute it, asks about that.
    """
    path = Path(path)
    if not (path / "problem.toml").exists():
        raise ProblemError(f"{path}: is not a run directory (no problem.toml in it); name the --out of a design")
    return RunDirectory(path, read(path / "problem.toml"))


def _started(path: Path, problem: Problem) -> RunDirectory:
    atomic.write_bytes(path / "problem.toml", problem.to_toml().encode())
    (path / "designs").mkdir(exist_ok=True)
    # It is designed with: opening the run asks nothing.
    keep(codes_of(problem), str(path))
    return RunDirectory(path, problem)


def first_difference(one: Problem, other: Problem) -> str | None:
    """The first key in which two problems differ, other than the number of iterations; None if they do not."""
    return next(_differences(one.model_dump(), other.model_dump()), None)


@contextmanager
def _reporting_damage(path: Path) -> Iterator[None]:
    """Raise ProblemError, one line, where the contents of a run's file are not what they should be."""
    try:
        yield
    except (KeyError, TypeError, ValueError) as error:
        words = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise ProblemError(f"{path}: is damaged ({words}); run the design again") from None


def _differences(one: Any, other: Any, key: str = "") -> Iterator[str]:
    """The keys in which two dumped problems differ, other than the number of iterations."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in {**one, **other}:
            yield from _differences(one.get(name), other.get(name), f"{key}.{name}" if key else name)
    elif isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        for index, (mine, yours) in enumerate(zip(one, other, strict=True)):
            yield from _differences(mine, yours, f"{key}[{index}]")
    elif one != other and key != "optimizer.iterations":
        yield key


def _checkpoint_arrays(iteration: int, state: Checkpoint) -> dict[str, np.ndarray]:
    arrays = {f"array {name}": value for name, value in state.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in state.items() if not isinstance(value, np.ndarray)}
    return {"json": np.array(json.dumps({"iteration": iteration, "state": rest})), **arrays}
