"""`pneumorph study`: many designs at once on Dask, with a live table, a summary and a sheet of the shapes."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from pneumorph import compiling, doing
from pneumorph.cli.trust import asking
from pneumorph.errors import ComputationError, ProblemError, printable, writing
from pneumorph.interrupts import Interrupted, deferred
from pneumorph.limits.kinds.states import beside
from pneumorph.output.render import NoPicture
from pneumorph.output.study_page import write_study_page
from pneumorph.results import HistoryEntry
from pneumorph.run import open_run
from pneumorph.study import Study, load_study, write_front, write_sheet, write_summary
from pneumorph.study.cluster import connected, run_members
from pneumorph.study.members import MemberEnd, finished
from pneumorph.study.summary import motions


def study(
    source: Path,
    out: Path | None,
    cluster: str | None,
    workers: int | None,
    quiet: bool,
    tls: Mapping[str, Path | None],
    trust: bool,
) -> None:
    """Run every design of a study; finished members are not run again.

    Parameters
    ----------
    source : Path
        The study file.
    out : Path or None
        The study's directory; by default in ``runs``, with the name of the file.
    cluster : str or None
        Address of a Dask scheduler, or "slurm"; by default processes on this machine.
    workers : int or None
        Number of these.
    quiet : bool
        Whether only the place of the results is printed.
    tls : {option: Path or None}
        Certificates and key for an address with tls.
    trust : bool
        Whether code in problem files is trusted.

    Raises
    ------
    ProblemError
        If an option or the study has a mistake.
    ComputationError
        If a member has failed.
    """
    if quiet:
        compiling.announce(None)
        doing.announce(None)
    asked = load_study(source, asking(trust))
    folder = out or Path("runs") / source.stem
    members = {member.name: member for member in asked.members}
    done = [name for name, member in members.items() if finished(folder / name, member.problem)]
    unfinished = {name: member for name, member in members.items() if name not in done}
    with writing(f"--out {folder}", "name another"):
        folder.mkdir(parents=True, exist_ok=True)
    console = Console()
    board = Board(asked, done)

    def accepted(name: str, entry: HistoryEntry) -> None:
        board.update(name, entry)
        report(board.line(name))

    def report(text: str) -> None:
        if not (quiet or console.is_terminal):
            console.print(Text(text), soft_wrap=True)
            doing.said()

    ends: list[MemberEnd] = []
    if unfinished:
        try:
            # A table that changes is for terminals only; elsewhere every design and every end is a line.
            shown = Live(board, console=console, refresh_per_second=2) if console.is_terminal and not quiet else None
            if shown is not None:
                doing.announce(None)
            with (
                deferred(),
                doing.doing("members") as far,
                connected(cluster, workers, tls) as client,
                shown or nullcontext(),
            ):
                far(f"0 of {len(unfinished)} have ended")
                for end in run_members(client, ((each, None) for each in unfinished.values()), folder, accepted):
                    ends.append(end)
                    far(f"{len(ends)} of {len(unfinished)} have ended")
                    board.end(end)
                    report(board.line(end.name))
        except Interrupted as stop:
            raise stop.saying(
                f"stopped; designs so far are in {folder}; resume with the same command, finished members are not run "
                "again"
            ) from None
    if not (quiet or console.is_terminal):
        console.print(board)
    failed = [end for end in ends if not end.completed]
    try:
        console.print(Text(f"summary in {write_summary(asked, folder)}"), soft_wrap=True)
    except OSError as error:
        raise ComputationError(f"{folder}: the summary cannot be written ({error.strerror}); make room") from None
    complete = [name for name in members if name not in {end.name for end in failed}]
    try:
        if complete:
            console.print(Text(f"sheet in {write_sheet(asked, folder, complete)}"), soft_wrap=True)
    except NoPicture as error:
        console.print(Text(f"the sheet could not be drawn: {error}"), soft_wrap=True)
    if (front := write_front(asked, folder, complete)) is not None:
        console.print(Text(f"what more of one task costs of the other in {front}"), soft_wrap=True)
    try:
        runs = [open_run(folder / name) for name in members if (folder / name / "problem.toml").exists()]
        if runs:
            console.print(Text(f"everything in one page: {write_study_page(folder, runs)}"), soft_wrap=True)
    except ProblemError as error:
        console.print(Text(f"the page could not be written: {error}"), soft_wrap=True)
    if failed:
        reasons = "; ".join(f"{end.name}: {end.reason}" for end in failed)
        raise ComputationError(f"{len(failed)} of {len(members)} members failed: {reasons}")


class Board:
    """The live table: a row for every member."""

    def __init__(self, study: Study, done: list[str]):
        self._study = study
        self._state = {member.name: "done earlier" if member.name in done else "waiting" for member in study.members}
        self._reason: dict[str, str] = {}
        self._latest: dict[str, HistoryEntry] = {}
        self._seconds = dict.fromkeys(self._state, 0.0)

    def update(self, name: str, entry: HistoryEntry) -> None:
        """Show an accepted design of a member."""
        self._state[name] = "running"
        self._latest[name] = entry
        self._seconds[name] += entry.seconds["total"]

    def end(self, end: MemberEnd) -> None:
        """Show how a member ended."""
        self._state[end.name] = "done" if end.completed else "failed"
        self._reason[end.name] = f": {end.reason}"

    def line(self, name: str) -> str:
        """The state of a member in a line."""
        entry, state = self._latest.get(name), self._state[name]
        if entry is None or state != "running":
            return f"{name}: {state}{self._reason.get(name, '')}"
        return f"{name}: design {entry.iteration}, {self._motions(name, entry)}, limits {_limits(entry)}"

    def _motions(self, name: str, entry: HistoryEntry) -> str:
        (member,) = (member for member in self._study.members if member.name == name)
        problem = member.problem
        results = ((task, entry.tasks[task.name]) for task in problem.task)
        return ", ".join(f"{task.objective.achieved(one)}{beside(problem, task, one)}" for task, one in results)

    def __rich__(self) -> Table:
        """A column for each motion, with its unit in the heading."""
        found = {
            member.name: motions(member.problem, self._latest[member.name])
            for member in self._study.members
            if member.name in self._latest
        }
        columns = list(dict.fromkeys(heading for row in found.values() for heading in row))
        table = Table(title=printable(self._study.title), title_style="bold")
        table.add_column("member", overflow="fold")
        for heading in ("design", *columns, "time (s)"):
            table.add_column(heading, overflow="fold", justify="right")
        table.add_column("limits")
        table.add_column("state")
        for member in self._study.members:
            entry, state = self._latest.get(member.name), self._state[member.name]
            style = {"failed": "red", "done": "green", "done earlier": "green"}.get(state, "")
            cells = [""] * (len(columns) + 3)
            if entry is not None:
                values = (found[member.name].get(heading) for heading in columns)
                numbers = ("" if value is None else f"{value:.4g}" for value in values)
                limits = Text(_limits(entry), style="" if entry.held else "red")
                cells = [str(entry.iteration), *numbers, f"{self._seconds[member.name]:.0f}", limits]
            table.add_row(member.name, *cells, Text(state, style=style))
        return table


def _limits(entry: HistoryEntry) -> str:
    return "satisfied" if entry.held else "violated !"
