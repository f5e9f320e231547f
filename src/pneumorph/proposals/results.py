"""Results of a search: a table of all candidates, a sheet of the proposals, and a page with both."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph import atomic
from pneumorph.output.figures import save
from pneumorph.output.front import Trade, front_figure
from pneumorph.output.sheet import Tile, draw_sheet
from pneumorph.output.study_page import write_study_page
from pneumorph.problem import Problem, Task
from pneumorph.proposals.making import difficulty, rubber_volume
from pneumorph.proposals.proposal import Proposal
from pneumorph.proposals.stage import reached_in
from pneumorph.proposals.wishes import HEADINGS, minimised
from pneumorph.results import HistoryEntry, RunResult
from pneumorph.results.targets import Reached
from pneumorph.run import RunDirectory, open_run
from pneumorph.study.summary import motions


def row(proposal: Proposal) -> dict[str, Any]:
    """The row of a candidate in the table."""
    found: dict[str, Any] = {
        "candidate": proposal.candidate.name,
        "layout": proposal.candidate.layout,
        "body": proposal.candidate.words,
        "run": "" if proposal.run is None else proposal.run.name,
    }
    entry = proposal.entry
    if entry is not None and proposal.run is not None:
        problem, run = proposal.candidate.posed, open_run(proposal.run)
        result = run.result()
        found |= {"designs": entry.iteration} | motions(problem, entry)
        for task in problem.task:
            state = entry.tasks[task.name]
            if (fine := entry.finer.get(task.name)) is not None:
                here, there = task.objective.achieved(state), task.objective.achieved(fine)
                found[f"{task.name} error of the mesh"] = float(f"{abs(there.value - here.value):.2g}")
            for name, value in state.pressures.items():
                found[f"{task.name} pressure {name} (kPa)"] = round(1e3 * value, 2)
            found[f"{task.name} stretch"] = round(state.max_stretch, 3)
            if proposal.final and result is not None and result.completed and result.best == entry.iteration:
                found[f"{task.name} margin"] = margin(problem, result, task.name)
        found["rubber (cm3)"] = round(1e-3 * rubber_volume(run.load_design(entry.iteration).body(problem)), 2)
        found["time (s)"] = round(sum(each.seconds["total"] for each in run.history()), 1)
        if proposal.final:
            found["making"] = difficulty(problem, run.load_design(entry.iteration).body(problem))
    found |= {HEADINGS[wish]: float(f"{value:.4g}") for wish, value in proposal.amounts.items()}
    return found | {"went on": "to the end" if proposal.final else "no", "why not": proposal.lost}


def margin(problem: Problem, result: RunResult, task: str) -> str:
    """How far a task is from ballooning, as a multiple of its pressures: found, or followed without any."""
    if task in result.margins:
        return f"{result.margins[task]:.2f}"
    if task in result.followed:
        return f"above {result.followed[task]:.2f}"
    least = problem.limits.margin
    return "not near" if least is None else f"above {least:g}"


def words_of_wishes(proposal: Proposal) -> str:
    """The amounts of a proposal, and which of them no other one has less of, or more of what is to be large."""
    if not proposal.amounts:
        return "not compared"
    told = ", ".join(f"{HEADINGS[wish]} {value:.3g}" for wish, value in proposal.amounts.items())
    won = ", ".join(wish.removeprefix("-") for wish in proposal.wins)
    beaten = "" if proposal.unbeaten else "; another one is as good in all and better in one"
    return f"{told}; best in {won}" if won else told + (beaten or "; best in none, beaten by none")


def draw_front(title: str, proposals: Sequence[Proposal], out: Path) -> Path | None:
    """Draw ``pareto.png`` of the first two wishes; None where fewer than two proposals have amounts of both."""
    compared = [
        each for each in proposals if each.run is not None and np.isfinite(list(each.amounts.values())[:2]).all()
    ]
    compared = [each for each in compared if len(each.amounts) > 1]
    if len(compared) < 2:
        return None
    one, other = list(compared[0].amounts)[:2]
    trades = [
        Trade(
            each.candidate.name,
            (each.amounts[one], each.amounts[other]),
            (minimised(one, each.amounts[one]), minimised(other, each.amounts[other])),
        )
        for each in compared
    ]
    save(front_figure(title, [HEADINGS[one], HEADINGS[other]], trades), out / "pareto.png")
    return out / "pareto.png"


def sheet_rows(proposals: Sequence[Proposal]) -> Iterator[tuple[str, ...]]:
    """Of those that have designs: name, result with the error of the mesh, pressures, margins, rubber, making, time."""
    for each in proposals:
        if each.run is None or each.entry is None:
            continue
        found, tasks = row(each), each.candidate.posed.task
        pressures = (
            ", ".join(f"{name} {1e3 * value:.3g}" for name, value in each.entry.tasks[task.name].pressures.items())
            for task in tasks
        )
        yield (
            each.run.name,
            "; ".join(_with_error(each.entry, task) for task in tasks),
            "; ".join(pressures) + " kPa",
            "; ".join(found.get(f"{task.name} margin", "not known") for task in tasks),
            f"{found['rubber (cm3)']:g} cm³",
            found.get("making", ""),
            f"{found['time (s)'] / 60.0:.1f} min",
        )


def _with_error(entry: HistoryEntry, task: Task) -> str:
    """What a design achieves in a task, with the error of the mesh where it is known."""
    here, fine = task.objective.achieved(entry.tasks[task.name]), entry.finer.get(task.name)
    told = here.beside_target if fine is None else here.with_error(task.objective.achieved(fine))
    return f"{task.name}: {told}"


def reaches(proposal: Proposal) -> Reached | None:
    """Whether a proposal reaches the targets of all tasks that have one; None where none was stated."""
    if proposal.run is None or proposal.entry is None:
        return None
    found, tasks = reached_in(proposal.run, proposal.candidate.posed), proposal.candidate.posed.task
    # One that was designed for a wish holds the motions of one that reaches them, nearly at least.
    return Reached.NEARLY if found is None and any(each.objective.aimed for each in tasks) else found


def write_table(proposals: Sequence[Proposal], out: Path) -> Path:
    """Write ``proposals.csv`` into the directory of a search, the best candidate first."""
    rows = [row(each) for each in proposals]
    columns = list(dict.fromkeys(key for each in rows for key in each))
    columns.append(columns.pop(columns.index("why not")))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path = out / "proposals.csv"
    atomic.write_bytes(path, text.getvalue().encode())
    return path


def write_page(title: str, proposals: Sequence[Proposal], out: Path) -> Path:
    """Write the page of proposals that have designs, headed by the title of their target.

    Raises
    ------
    ProblemError
        If the file cannot be written.
    """
    return write_study_page(out, [open_run(each.run) for each in proposals if each.run is not None], title=title)


def draw_proposals(title: str, proposals: Sequence[Proposal], out: Path) -> Path:
    """Draw ``sheet.png``: proposals that have designs, at rest and inflated.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    runs = [(each, open_run(each.run)) for each in proposals if each.run is not None]
    path = out / "sheet.png"
    draw_sheet(path, title, [Tile(run.path.name, "\n".join(_caption(each, run)), run) for each, run in runs])
    return path


def _caption(proposal: Proposal, run: RunDirectory) -> Iterator[str]:
    """Name of a proposal and, where it was compared by wishes, its amounts, with a star at those that it wins."""
    yield run.path.name
    if run.problem.task[0].objective != proposal.candidate.posed.task[0].objective:
        yield proposal.achieved
    for wish, value in proposal.amounts.items():
        yield f"{HEADINGS[wish]} {value:.3g}{' *' * (wish in proposal.wins)}"
