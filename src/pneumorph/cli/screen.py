"""Progress of a design run on the screen: a row for every accepted design, and a status line below."""

from __future__ import annotations

import time
from collections.abc import Mapping
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from pneumorph.analysis import HistoryEntry
from pneumorph.constraint.table import in_history
from pneumorph.optimize import (
    BroughtWithin,
    DesignAccepted,
    DesignRejected,
    Event,
    Finished,
    MeshKept,
    Remeshed,
    Started,
)
from pneumorph.output.format import format_duration, mirror_note, motion_of
from pneumorph.problem import Problem

PHASES = {"geometry": "mesh", "equilibrium": "equilibrium", "gradient": "gradient", "subproblem": "sub-problem"}


class Screen:
    """Shows the events of a run on a console, as plain lines if that is not a terminal. Used as a context manager."""

    def __init__(self, problem: Problem, console: Console):
        self._problem = problem
        self._console = console
        self._columns = _columns(problem)
        self._began = time.perf_counter()
        self._recent: list[float] = []
        self._phases = dict.fromkeys(PHASES, 0.0)
        self._total = problem.optimizer.iterations
        self._spinner = Spinner("dots")
        self._status = Text("meshing, first equilibria")
        self._live = Live(self, console=console, transient=True, refresh_per_second=4)

    def __enter__(self) -> Screen:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._live.stop()

    def __rich__(self) -> Table:
        """The status line."""
        table = Table.grid(padding=(0, 1))
        for _ in range(3):
            table.add_column(no_wrap=True)
        elapsed = format_duration(time.perf_counter() - self._began)
        table.add_row(self._spinner, Text(elapsed, style="dim"), self._status)
        return table

    def show(self, event: Event) -> None:
        """Show an event."""
        match event:
            case Started():
                self._started(event)
            case BroughtWithin():
                self.say(
                    f"the start violates limits: {'; '.join(event.broken)}; it was brought within them by moving its "
                    f"surfaces by up to {event.moved_mm:.2g} mm"
                )
            case DesignAccepted():
                self.row(event.entry)
                self._update_status(event)
            case Remeshed():
                self._note(f"design {event.iteration}: remeshed with {event.elements} elements, {event.reason}")
            case MeshKept():
                self._note(
                    f"design {event.iteration}: the old mesh is kept with elements of quality {event.quality:.2g}, "
                    f"{event.reason}"
                )
            case DesignRejected() if event.step_mm > 0:
                self._note(f"design {event.iteration}: step taken back to {event.step_mm:.3g} mm, {event.reason}")
            case DesignRejected():
                self._note(f"design {event.iteration}: step taken back, {event.reason}")
            case Finished():
                self._status = Text("drawing the pictures")

    def row(self, entry: HistoryEntry) -> None:
        """Show the row of an accepted design."""
        row = Text()
        for (_, width), cell in zip(self._columns, _cells(self._problem, entry), strict=True):
            row.append(f"{cell.plain:>{width}} ", style=cell.style)
        self._print(row)

    def say(self, sentence: str) -> None:
        """Print a sentence on its own line."""
        self._print(Text(sentence))

    def _started(self, event: Started) -> None:
        self.say(
            f"{event.variables} variables, {event.elements} {event.element} elements, {event.dofs} degrees of freedom"
            + mirror_note(event.mirror)
        )
        heading = Text(style="bold")
        for title, width in self._columns:
            heading.append(f"{title:>{width}} ")
        self._print(heading)
        self._status = Text(f"design {event.iteration + 1} of {event.iterations}")

    def _update_status(self, event: DesignAccepted) -> None:
        seconds = event.entry.seconds
        if event.iteration > 0:
            self._recent = [*self._recent[-4:], seconds["total"]]
        for phase in PHASES:
            self._phases[phase] += seconds.get(phase) or 0.0
        if event.iteration >= self._total:
            self._status = Text("checking the limits")
            return
        self._status = Text(f"design {event.iteration + 1} of {self._total}")
        if self._recent:
            left = (self._total - event.iteration) * sum(self._recent) / len(self._recent)
            self._status.append(f" · {format_duration(left)} left")
        spent = sum(self._phases.values()) or 1.0
        split = ", ".join(f"{word} {100 * self._phases[phase] / spent:.0f} %" for phase, word in PHASES.items())
        self._status.append(f" · {split}")

    def _note(self, sentence: str) -> None:
        self._print(Text(f"     {sentence}", style="dim"))

    def _print(self, text: Text) -> None:
        # Rows are never wrapped, so that they keep their columns on narrow terminals and in files.
        self._console.print(text, soft_wrap=True)


def _columns(problem: Problem) -> list[tuple[str, int]]:
    """Titles and widths of the columns."""
    motions = [(task.name, max(10, len(task.name))) for task in problem.task]
    limits = [(limit.word[:9], max(6, len(limit.word[:9]))) for limit, _, _ in in_history(problem.limits)]
    return [("it", 3), *motions, *limits, ("elements", 8), ("fact.", 5), ("s", 6), ("equiv.", 6)]


def _cells(problem: Problem, entry: HistoryEntry) -> list[Text]:
    motions = [Text(str(motion_of(task, entry.tasks[task.name])), style="bold") for task in problem.task]
    seconds, equivalents = entry.seconds["total"], entry.equivalents
    return [
        Text(str(entry.iteration)),
        *motions,
        *_limits(problem, entry.limits),
        Text(str(entry.elements)),
        Text(str(entry.factorisations)),
        Text(f"{seconds:.1f}"),
        Text("–" if equivalents is None else f"{equivalents:.1f}"),
    ]


def _limits(problem: Problem, found: Mapping[str, float | None]) -> list[Text]:
    """Worst values of the limits: red beyond the bound and its tolerance, yellow within the tolerance."""
    cells = []
    for limit, key, bound in in_history(problem.limits):
        value = found[key]
        if value is None:
            cells.append(Text("–", style="red"))
            continue
        passed = limit.excess(value, bound)
        style = "red" if passed > limit.tolerance else "yellow" if passed > 0 else "green"
        cells.append(Text(f"{value:.2f}" if limit.unit == "mm" else f"{value:.3f}", style=style))
    return cells
