"""The columns of a design run on the screen: as many as fit its width."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.text import Text

from pneumorph.analysis import recorded_share
from pneumorph.limits.kinds.states import is_least
from pneumorph.limits.limit import Limit
from pneumorph.limits.table import in_history
from pneumorph.optimize.states import is_least_known
from pneumorph.problem import Problem, Task
from pneumorph.results import HistoryEntry

MARK = "!"
"""Beside a value beyond its limit, and at the start of its row."""

LONGEST_NAME = 12
"""Characters of a task's name that are shown."""


@dataclass(frozen=True)
class Column:
    """A column: its title, its width in characters, and what it shows of a design."""

    title: str
    width: int
    cell: Callable[[HistoryEntry], Text]


def columns_of(problem: Problem, width: int, verbose: bool) -> list[Column]:
    """The columns for a screen of a width: the number, the motions and the least ones always, the rest as far as there
    is room.

    Where the limits have no room, one column shows that of which most is used.
    """
    known = in_history(problem)
    least = [each for each in known if is_least(each[0])]
    always = [Column("it", 4, _number), *(_motion(task) for task in problem.task), *(_limit(*each) for each in least)]
    others = [each for each in known if each not in least]
    limits = [_limit(*each) for each in others]
    rest = [
        Column("s", 6, lambda entry: Text(f"{entry.seconds['total']:.1f}")),
        Column("elements", 8, lambda entry: Text(str(entry.elements))),
        Column("mesh", 7, lambda entry: _error(recorded_share(problem, entry))),
    ]
    if verbose:
        rest += [
            Column("step mm", 7, lambda entry: _or_none(entry.step, ".3f")),
            Column("gain", 5, lambda entry: _or_none(entry.ratio, ".2f")),
            Column("left", 6, lambda entry: _or_none(entry.optimality, ".3f")),
            Column("fact.", 5, lambda entry: Text(str(entry.factorisations))),
            Column("equiv.", 7, lambda entry: _or_none(entry.equivalents, ".1f")),
        ]
    widest = max((len(limit.word) + len(limit.suffix) + 8 for limit, _, _ in others), default=0)
    most_used = [Column("most used limit", max(17, widest), lambda entry: _most_used(_values(others, entry)))]
    for shown in (limits, most_used):
        for count in range(len(rest), -1, -1):
            columns = [*always, *shown, *rest[:count]]
            if width_of(columns) <= width:
                return columns
    return [*always, *most_used]


def width_of(columns: Sequence[Column]) -> int:
    """Characters of a row."""
    return 1 + sum(column.width for column in columns) + len(columns) - 1


def heading(columns: Sequence[Column]) -> Text:
    """The row of titles."""
    return Text(" " + " ".join(f"{column.title:>{column.width}}" for column in columns), style="bold")


def row(problem: Problem, columns: Sequence[Column], entry: HistoryEntry) -> Text:
    """The row of a design, marked if it is beyond a limit."""
    line = Text(MARK if any(_is_beyond(*each) for each in _values(in_history(problem), entry)) else " ", style="red")
    for index, column in enumerate(columns):
        cell = column.cell(entry)
        line.append(f"{'' if index == 0 else ' '}{cell.plain:>{column.width}}", style=cell.style)
    return line


def _number(entry: HistoryEntry) -> Text:
    return Text(str(entry.iteration))


def _motion(task: Task) -> Column:
    name = task.name if len(task.name) <= LONGEST_NAME else f"{task.name[: LONGEST_NAME - 1]}…"
    return Column(
        name, max(10, len(name)), lambda entry: Text(str(task.objective.achieved(entry.tasks[task.name])), style="bold")
    )


def _limit(limit: Limit, key: str, bound: float) -> Column:
    # The units of curvature and stretch have no room beside their words.
    title = limit.word if limit.unit == "/mm²" else f"{limit.word} {limit.unit}".rstrip()
    return Column(title, max(7, len(title)), lambda entry: _shown(limit, entry.limits.get(key), bound))


def _values(limits: Sequence[tuple[Limit, str, float]], entry: HistoryEntry) -> list[tuple[Limit, float | None, float]]:
    return [(limit, entry.limits.get(key), bound) for limit, key, bound in limits]


def _is_beyond(limit: Limit, value: float | None, bound: float) -> bool:
    """Whether a value is beyond its bound; one that is not known counts as beyond."""
    return value is None or not limit.satisfied(value, bound)


def _shown(limit: Limit, value: float | None, bound: float, unit: str = "") -> Text:
    """A limit's worst value: red and marked beyond its bound."""
    digits = 2 if limit.unit == "mm" else 3
    number = "–" if value is None else f"{limit.told * value:.{digits}f}{unit}"
    if value is not None and is_least_known(limit, value, bound):
        number = f"≥ {value:.3g}"
    if _is_beyond(limit, value, bound):
        return Text(number + MARK, style="red")
    assert value is not None
    return Text(number + " ", style="green")


def _most_used(values: Sequence[tuple[Limit, float | None, float]]) -> Text:
    def used(each: tuple[Limit, float | None, float]) -> float:
        limit, value, bound = each
        return float("inf") if value is None else limit.used(value, bound)

    limit, value, bound = max(values, key=used)
    shown = _shown(limit, value, bound, limit.suffix)
    return Text(f"{limit.word} {shown.plain}", style=shown.style)


def _error(share: float | None) -> Text:
    """The error of the mesh, relative to the motions; nothing where it is not estimated."""
    if share is None:
        return Text("")
    return Text(f"±{100 * share:.1f} %" if share < 1.0 else "> 100 %")


def _or_none(value: float | None, format: str) -> Text:
    return Text("–" if value is None else f"{value:{format}}")
