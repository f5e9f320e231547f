"""`pneumorph propose`: bodies for a target, with a ranked table of what was tried."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from shlex import quote

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pneumorph import compiling, doing
from pneumorph.cli.further import words
from pneumorph.errors import ComputationError, ProblemError, printable
from pneumorph.interface.propose import propose as search
from pneumorph.interface.runs import open_run
from pneumorph.interrupts import Interrupted, deferred
from pneumorph.output.render import NoPicture
from pneumorph.proposals import Plan, Proposal, load_target
from pneumorph.proposals.candidates import suited
from pneumorph.proposals.further import places_in
from pneumorph.proposals.results import (
    draw_front,
    draw_proposals,
    reaches,
    sheet_rows,
    words_of_wishes,
    write_page,
    write_table,
)
from pneumorph.proposals.search import BEST, MOST_BY_WISHES
from pneumorph.results import HistoryEntry
from pneumorph.results.targets import Reached

SHOWN = 12
"""Candidates that are shown on the screen; the file has all."""


def propose(source: Path, out: Path | None, plan: Plan, workers: int | None, quiet: bool) -> int:
    """Search bodies for a target; the exit status is 3 if a stated target is reached by none.

    Parameters
    ----------
    source : Path
        The target file.
    out : Path or None
        The directory of the search; by default in ``runs``, with the name of the file.
    plan : Plan
        How much is searched.
    workers : int or None
        Number of processes.
    quiet : bool
        Whether only the place of the results is printed.

    Raises
    ------
    ProblemError
        If an option or the target has a mistake.
    ComputationError
        If no candidate came to its end.
    """
    if quiet:
        compiling.announce(None)
        doing.announce(None)
    target, console = load_target(source), Console()
    folder = out or Path("runs") / source.stem

    def say(text: str) -> None:
        if not quiet:
            console.print(Text(printable(text)), soft_wrap=True)
            doing.said()

    layouts, against = suited(target)
    say(f"layouts: {', '.join(each.words for each in layouts)}")
    for name, reason in against.items():
        say(f"not {name}: {reason}")
    try:
        with deferred(), doing.doing("trying candidates") as far:

            def accepted(name: str, entry: HistoryEntry) -> None:
                far(f"{name}: design {entry.iteration}")

            proposals = search(target, folder, plan, workers, say, accepted)
    except Interrupted as stop:
        raise stop.saying(f"stopped; the same command goes on with what is in {folder}") from None
    table = write_table(proposals, folder)
    most = MOST_BY_WISHES if target.minimize else BEST
    best = [each for each in proposals[:most] if each.entry is not None and (each.final or not target.minimize)]
    best, title = best or [each for each in proposals[:BEST] if each.entry is not None], target.title or source.stem
    if not quiet:
        console.print(_table(title, proposals))
        console.print(_sheet(best))
        for each in best if target.minimize else ():
            console.print(Text(printable(f"{each.candidate.name}: {words_of_wishes(each)}")), soft_wrap=True)
    say_where = partial(console.print, soft_wrap=True)
    say_where(Text(f"table of all {len(proposals)} candidates in {table}"))
    if not best:
        raise ComputationError(f"{folder}: no candidate satisfies the limits; the table says what was against each")
    try:
        say_where(Text(f"sheet in {draw_proposals(title, best, folder)}"))
    except NoPicture as error:
        say_where(Text(f"the sheet could not be drawn: {error}"))
    if front := draw_front(title, best, folder):
        say_where(Text(f"what one wish costs of the other: {front}"))
    say_where(Text(f"everything in one page: {write_page(title, best, folder)}"))
    first = best[0]
    where, problem = quote(str(first.run)), quote(f"{first.run}/problem.toml")
    again = f"pneumorph design {problem} --out {where} --resume --iterations 40"
    said = f"The best is {first.run}: {first.achieved}. To go on with it: {again}"
    say_where(Text(said if first.final else f"{said} ({first.lost}, so its motion is that of a coarse one)"))
    if reaches(first) in (None, Reached.NO) and first.run is not None:
        for line in _further(first.run):
            say(line)
    return 3 if reaches(first) is Reached.NO else 0


def _further(run: Path) -> Iterator[str]:
    """Where a further chamber would help a proposal, and how to go on with one; nothing where that is not known."""
    with suppress(ComputationError, ProblemError), doing.doing("finding where a further chamber would help"):
        for each in places_in(run)[0][:1]:
            yield f"A further chamber: {words(open_run(run).problem, each)}. For a problem with it:"
            yield f"pneumorph check {quote(str(run))} --quick --insert FILE.toml"


def _sheet(best: Sequence[Proposal]) -> Table:
    """What is known of the proposals."""
    table = Table()
    _column(table, "proposal", [each.run.name for each in best if each.run is not None])
    for heading in ("result", "pressures", "margin to ballooning", "rubber", "making", "time"):
        _column(table, heading)
    for values in sheet_rows(best):
        table.add_row(*(Text(printable(value)) for value in values))
    return table


def _table(title: str, proposals: Sequence[Proposal]) -> Table:
    table = Table(title=printable(title), title_style="bold")
    _column(table, "candidate", [each.candidate.name for each in proposals])
    for heading in ("body", "achieved", "why it did not go on"):
        _column(table, heading)
    for each in proposals[:SHOWN]:
        style = "green" if each.final else ""
        table.add_row(Text(each.candidate.name, style=style), each.candidate.words, each.achieved, printable(each.lost))
    return table


def _column(table: Table, heading: str, whole: Sequence[str] = ()) -> None:
    """Add a column in which no word of its heading is cut, nor any of these values, up to a third of the screen."""
    least = max(map(len, [*heading.split(), *whole]))
    table.add_column(heading, overflow="fold", min_width=min(least, 26))
