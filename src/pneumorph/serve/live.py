"""A run as the server sees it: read again when its files have changed, and its designs as the solver's demands."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pneumorph.errors import ProblemError
from pneumorph.interface.runs import Run, open_run
from pneumorph.output.report import facts_and_shapes, finished
from pneumorph.output.report_limits import Known
from pneumorph.output.report_model import NAME
from pneumorph.problem import Problem
from pneumorph.run import RunDirectory
from pneumorph.serve.worker import RequestedState
from pneumorph.surrogate.reader import Model, ModelError

PARTS = 6
"""Steps of a sweep from no pressure to those of a task."""

BEYOND = 1.25
"""Sliders reach so many times the largest pressure of the tasks."""

OVER = 0.05
"""By so much of its range a pressure may be beyond a slider."""

WATCHED = ("problem.toml", "history.jsonl", "checkpoint.npz", "fields", "result.json", "make", NAME)
"""What changes in a run directory when there is something new to show."""

READINGS = 4
"""A run that goes on removes files; so often a reading is tried before its error counts."""


@dataclass(frozen=True)
class Slider:
    """A chamber whose pressure can be set from `least` to `most`, MPa."""

    chamber: str
    least: float
    most: float


class LiveRun:
    """A run directory, in which a run may go on.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ProblemError
        If it is not a run directory.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        problem = _opened(path).problem
        self.title = problem.title or self.path.name
        self._reading = threading.Lock()
        self._read: tuple[str, bytes] | None = None
        self._known: Known = {}

    def stamp(self) -> str | None:
        """Text that changes when the run has something new to show; None before its first design."""
        if not (self.path / "checkpoint.npz").exists():
            return None
        return "-".join(f"{_written(self.path / name):x}" for name in WATCHED)

    def block(self) -> bytes:
        """What its page shows; see `output.packed`.

        Raises
        ------
        ProblemError
            If the directory cannot be read.
        """
        with self._reading:
            # Taken first: what changes while it is read is read again.
            stamp = self.stamp() or ""
            if self._read is None or self._read[0] != stamp:
                self._read = stamp, self._packed()
            return self._read[1]

    def wanted(self, design: int, pressures: Mapping[str, Any]) -> RequestedState:
        """The demand for a design at pressures in kPa by chamber.

        Raises
        ------
        ProblemError
            If there is no such design, or the pressures are not numbers for its chambers, or far beyond the sliders.
        """
        run = _opened(self.path)
        chambers = [chamber.name for chamber in run.problem.body.chamber]
        if set(pressures) != set(chambers):
            raise ProblemError(f"pressures: need a number in kPa for each of {', '.join(chambers)}")
        if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in pressures.values()):
            raise ProblemError("pressures: are not numbers in kPa")
        for slider in sliders_of(run.problem, modelled(self.path)):
            # A slider ends with a whole step of it.
            over = OVER * (slider.most - slider.least)
            low, high = 1e3 * (slider.least - over), 1e3 * (slider.most + over)
            # Written so that NaN is refused.
            if not low <= pressures[slider.chamber] <= high:
                raise ProblemError(f"pressures: {slider.chamber} must be between {low:.4g} and {high:.4g} kPa")
        written = _written(run.directory.path / "designs" / f"{design:04d}.npz")
        if not written:
            raise ProblemError(f"design {design}: {self.path} has no design of this number")
        return RequestedState(self.path, design, written, tuple((name, pressures[name] / 1e3) for name in chambers))

    def sweep(self, design: int) -> list[RequestedState]:
        """Demands for a design on the way to the pressures of its tasks, without any pressure first."""
        stored = _opened(self.path).design(design).pressures
        kilopascals = [
            {name: round(1e3 * part / PARTS * value, 3) for name, value in pressures.items()}
            for pressures in stored.values()
            for part in range(PARTS + 1)
        ]
        return list(dict.fromkeys(self.wanted(design, each) for each in kilopascals))

    def _packed(self) -> bytes:
        for _ in range(READINGS - 1):
            try:
                return _block(_opened(self.path).directory, self._known)
            except ProblemError:
                time.sleep(0.2)
        return _block(_opened(self.path).directory, self._known)


def _opened(path: Path) -> Run:
    """A run; the command has asked about code in it, and nothing here evaluates an objective."""
    return open_run(path, trust=True)


def _block(run: RunDirectory, known: Known) -> bytes:
    sliders = [asdict(each) for each in sliders_of(run.problem, modelled(run.path))]
    return facts_and_shapes(run, finished(run), {"sliders": sliders}, level=1, known=known, driven=True)


def modelled(path: Path) -> dict[str, tuple[float, float]]:
    """The bounds in MPa of the fast model in a run directory, by chamber; none without one."""
    try:
        model = Model(path / NAME)
    except ModelError:
        return {}
    return dict(zip(model.chambers, map(tuple, model.bounds.tolist()), strict=True))


def sliders_of(problem: Problem, bounds: Mapping[str, tuple[float, float]]) -> Iterator[Slider]:
    """The chambers with the pressures that are sensible for them: to beyond those of tasks, and to those of a model."""
    ranges = {
        chamber.name: [
            end for task in problem.task for free in [task.pressure[chamber.name]] for end in (free.min, free.max)
        ]
        for chamber in problem.body.chamber
    }
    usual = max(abs(end) for ends in ranges.values() for end in ends)
    for name, ends in ranges.items():
        least, most = min(0.0, *ends), max(0.0, *ends)
        if least == most:
            most = usual
        low, high = bounds.get(name, (0.0, 0.0))
        yield Slider(name, min(BEYOND * least, low), max(BEYOND * most, high))


def _written(path: Path) -> int:
    """When a file was written, in ns; 0 without one."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
