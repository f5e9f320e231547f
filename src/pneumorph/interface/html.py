"""What notebooks show of problems, runs, designs, sweeps and fits: tables in HTML. Nothing is solved for them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from pneumorph.limits.kinds.states import beside
from pneumorph.limits.report import LimitReading
from pneumorph.limits.table import BY_NAME
from pneumorph.mechanics.material.judge import Fit, faults
from pneumorph.output.format import format_pressures
from pneumorph.problem import Problem
from pneumorph.results import HistoryEntry, RunResult

MOST_ROWS = 60
"""Longer tables are shown without their middle."""


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """An HTML table; its contents are escaped."""
    cells = [[escape(str(cell)) for cell in row] for row in rows]
    if len(cells) > MOST_ROWS:
        cells = [*cells[: MOST_ROWS // 2], ["…"] * len(headings), *cells[-MOST_ROWS // 2 :]]
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def heading(text: str) -> str:
    """A line above a table."""
    return f"<p><b>{escape(text)}</b></p>"


def design_html(problem: Problem, iteration: int, entry: HistoryEntry | None, limits: Iterable[LimitReading]) -> str:
    """What a design achieves, if it is known, and its limits.

    Parameters
    ----------
    problem : of the design.
    iteration : its number.
    entry : its results, if they are known.
    limits : the worst values of its limits.
    """
    parts = [heading(", ".join(part for part in (problem.title, f"design {iteration}") if part))]
    if entry is not None:
        rows = []
        for task in problem.task:
            result = entry.tasks[task.name]
            motion = task.objective.achieved(result)
            state = "stable" if result.stable else "not stable"
            told = f"{motion.beside_target}{beside(problem, task, result)}"
            rows.append((task.name, motion.word, told, format_pressures(result.pressures), state))
        parts.append(table(("task", "", "result", "pressure", "state"), rows))
    rows = []
    for reading in limits:
        limit = BY_NAME[reading.limit]
        kept = "kept" if reading.satisfied() else "not kept"
        asked = f"{'at least' if limit.at_least else 'at most'} {reading.bound:g}"
        rows.append((limit.word, f"{reading.value:.3g}{limit.suffix}", asked, reading.surface, kept))
    parts.append(table(("limit", "worst", "asked", "on", ""), rows))
    return "".join(parts)


def run_html(problem: Problem, title: str, history: Sequence[HistoryEntry], result: RunResult | None) -> str:
    """The history of a run, and how it ended.

    Parameters
    ----------
    problem : of the run.
    title : above the table.
    history : its designs.
    result : how it ended; None while it goes on.
    """
    tasks = problem.task
    rows = [
        (
            entry.iteration,
            *(task.objective.achieved(entry.tasks[task.name]) for task in tasks),
            "yes" if entry.held else "no",
        )
        for entry in history
    ]
    words = (*(task.name for task in tasks), "limits kept")
    end = "The run has not ended." if result is None else f"It ended because {result.reason}."
    return heading(title) + table(("design", *words), rows) + f"<p>{escape(end)}</p>"


def fit_html(fits: Iterable[Fit], reports: Iterable[str]) -> str:
    """The models of a fit, the best first, and what the tests do not decide, in sentences."""
    rows = [
        (one.form.label, f"{one.r2:.4f}", f"{1e3 * one.rms:.3g}", ", ".join(faults(one)) or "acceptable")
        for one in fits
    ]
    said = "".join(f"<p>{escape(sentence)}</p>" for sentence in reports)
    return table(("model", "R²", "RMS / kPa", "verdict"), rows) + said
