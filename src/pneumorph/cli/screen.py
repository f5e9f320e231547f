"""Progress of a design run on the screen: a row for every accepted design, and a status line below."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from pneumorph import doing
from pneumorph.cli.columns import columns_of, heading, row
from pneumorph.optimize import (
    BegunBeyond,
    BegunLower,
    BroughtWithin,
    DesignAccepted,
    DesignRejected,
    Divided,
    Event,
    Finished,
    MeshKept,
    NotDivided,
    NotRefined,
    Refined,
    Remeshed,
    Served,
    Started,
)
from pneumorph.optimize.prospects import backwards
from pneumorph.output.format import format_duration, format_pressures, part_note
from pneumorph.problem import Problem
from pneumorph.results import HistoryEntry

PHASES = {"geometry": "mesh", "equilibrium": "equilibrium", "gradient": "gradient", "subproblem": "sub-problem"}


class Screen:
    """Shows the events of a run on a console, as plain lines if that is not a terminal. Used as a context manager.

    A quiet one shows none, a verbose one more columns.
    """

    def __init__(self, problem: Problem, console: Console, quiet: bool = False, verbose: bool = False):
        self._problem = problem
        self._console = console
        self._quiet = quiet
        self._columns = columns_of(problem, console.width, verbose)
        self._began = time.perf_counter()
        self._recent: list[float] = []
        self._phases = dict.fromkeys(PHASES, 0.0)
        self._total = problem.optimizer.iterations
        self._rejected = 0
        self._spinner = Spinner("dots")
        self._status = Text("meshing, first equilibria")
        self._live = Live(self, console=console, transient=True, refresh_per_second=4)

    def __enter__(self) -> Screen:
        if self._console.is_terminal and not self._quiet:
            # The status line says what is done.
            doing.announce(None)
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
        now = f" · {words}" if (words := doing.words()) else ""
        table.add_row(self._spinner, Text(elapsed, style="dim"), self._status + Text(now, style="dim"))
        return table

    def show(self, event: Event) -> None:
        """Show an event."""
        match event:
            case Started():
                self._started(event)
            case BroughtWithin():
                self.say(
                    f"the start is not certified to satisfy limits: {'; '.join(event.violated)}; its surfaces were "
                    f"moved by up to {event.moved_mm:.2g} mm, after which it is"
                )
            case BegunLower():
                begun = "; ".join(f"{name} {format_pressures(own)}" for name, own in event.pressures.items())
                self.say(f"the start has no state at its pressures and begins lower: {begun}; designs may raise them")
            case BegunBeyond():
                for sentence in event.violated:
                    self.say(sentence)
            case DesignAccepted():
                self._rejected = 0
                self.row(event.entry)
                if event.iteration == 0:
                    self._doubts(event.entry)
                self._update_status(event)
            case Remeshed():
                # A sector that cannot be meshed is followed by the whole body.
                self._note(
                    f"design {event.iteration}: remeshed with {event.elements} elements{part_note(event.part)}; "
                    f"in the old mesh, {event.reason}"
                )
            case Divided():
                self.say(
                    f"design {event.iteration}: the error of the mesh is {100 * event.share:.2g} %; elements that "
                    f"contribute most are divided, which gives {event.elements}{part_note(event.part)}"
                )
            case NotDivided():
                self.say(
                    f"design {event.iteration}: the error of the mesh is {100 * event.share:.2g} %, but elements are "
                    f"not divided: {event.reason}"
                )
            case Served():
                self.say(f"larger elements have served with design {event.iteration}: {event.reason}")
            case Refined():
                near = event.iteration - 1, event.iteration
                of = "" if event.shape in near else f"with the shape of design {event.shape}, "
                self.say(
                    f"design {event.iteration}: {of}from here on with {event.elements} elements of {event.size:g} mm"
                    f"{part_note(event.part)}"
                )
            case NotRefined():
                self.say(f"design {event.iteration} does not go on with elements of the size asked for: {event.reason}")
            case MeshKept():
                self._note(
                    f"design {event.iteration}: the old mesh is kept with elements of quality {event.quality:.2g}, "
                    f"{event.reason}"
                )
            case DesignRejected():
                self._rejected += 1
                shorter = f"; the next step is at most {event.step_mm:.3g} mm" if event.step_mm > 0 else ""
                self._note(f"design {event.iteration}, trial {self._rejected} rejected: {event.reason}{shorter}")
            case Finished():
                self._status = Text("drawing the pictures")

    def row(self, entry: HistoryEntry) -> None:
        """Show the row of an accepted design."""
        self._print(row(self._problem, self._columns, entry))

    def say(self, sentence: str) -> None:
        """Print a sentence on its own line."""
        self._print(Text(sentence))

    def _doubts(self, start: HistoryEntry) -> None:
        for task in self._problem.task:
            for sentence in backwards(self._problem, task, start.tasks[task.name]):
                self.say(f"{task.name}: {sentence}")

    def _started(self, event: Started) -> None:
        self.say(
            f"{event.variables} variables, {event.elements} {event.element} elements, {event.dofs} degrees of freedom"
            + part_note(event.part)
        )
        if event.larger is not None:
            self.say(f"elements of {event.larger:g} mm at first, to save time; the last designs have those asked for")
        self._print(heading(self._columns))
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
        if self._quiet:
            return
        # Rows are never wrapped, so that they keep their columns on narrow terminals and in files.
        self._console.print(text, soft_wrap=True)
        doing.said()
