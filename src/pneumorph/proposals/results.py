"""Results of a search: a table of all candidates, a sheet of the proposals, and a page with both."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pneumorph import atomic
from pneumorph.output.study_page import write_study_page
from pneumorph.proposals.search import Proposal
from pneumorph.results.targets import Reached, targets_reached
from pneumorph.run import open_run
from pneumorph.study import Member, Study, write_sheet
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
        problem = proposal.candidate.posed
        history = open_run(proposal.run).history()
        found |= {"designs": entry.iteration} | motions(problem, entry)
        for task in problem.task:
            result = entry.tasks[task.name]
            for name, value in result.pressures.items():
                found[f"{task.name} pressure {name} (kPa)"] = round(1e3 * value, 2)
            found[f"{task.name} stretch"] = round(result.max_stretch, 3)
        found["time (s)"] = round(sum(each.seconds["total"] for each in history), 1)
    return found | {"went on": "to the end" if proposal.final else "no", "why not": proposal.lost}


def reaches(proposal: Proposal) -> Reached | None:
    """Whether a proposal reaches the targets of all tasks that have one; None where none was stated."""
    if proposal.run is None or proposal.entry is None:
        return None
    found = targets_reached(proposal.candidate.posed, open_run(proposal.run).history()).values()
    order = (Reached.NO, Reached.NEARLY, Reached.YES)
    return min(found, key=order.index) if found else None


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


def write_page(proposals: Sequence[Proposal], out: Path) -> Path:
    """Write the page of proposals that have designs.

    Raises
    ------
    ProblemError
        If the file cannot be written.
    """
    return write_study_page(out, [open_run(each.run) for each in proposals if each.run is not None])


def draw_proposals(title: str, proposals: Sequence[Proposal], out: Path) -> Path:
    """Draw ``sheet.png``: proposals that have designs, at rest and inflated.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    members = tuple(Member(each.run.name, {}, each.candidate.posed) for each in proposals if each.run is not None)
    return write_sheet(Study(title, members), out, [each.name for each in members])
