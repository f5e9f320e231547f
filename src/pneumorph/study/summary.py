"""Results of a study: a table of all members, and a sheet of their final shapes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumorph import atomic, units
from pneumorph.limits.kinds.states import least_motions
from pneumorph.limits.table import BY_NAME
from pneumorph.output.sheet import Tile, draw_sheet
from pneumorph.problem import Problem, Task
from pneumorph.results import HistoryEntry
from pneumorph.run import open_run
from pneumorph.study.file import Member, Study


def summary(study: Study, out: Path) -> list[dict[str, Any]]:
    """A row for every member, in the order of the study; values that a member does not have yet are missing."""
    changes = [dict(_leaves(member.changes)) for member in study.members]
    keys = dict.fromkeys(key for each in changes for key in each)
    columns = dict(_column(key, [each.get(key) for each in changes]) for key in keys)
    rows = []
    for number, member in enumerate(study.members):
        changed = {heading: values[number] for heading, values in columns.items()}
        rows.append({"member": member.name} | changed | _row(member, out / member.name))
    return rows


def _leaves(changes: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """The changes of a member, and those within tables and lists one by one: "limits.wall", "body.center[0]"."""
    for key, value in changes.items():
        name = f"{before}.{key}" if before and not key.startswith("[") else before + key
        if isinstance(value, list | tuple):
            value = {f"[{number}]": each for number, each in enumerate(value)}
        if isinstance(value, Mapping):
            yield from _leaves(value, name)
        else:
            yield name, value


def _column(key: str, values: Sequence[Any]) -> tuple[str, list[Any]]:
    """Heading and values of a change: numbers, the unit in the heading, where all members have the same unit."""
    split = [units.split(value) for value in values]
    given = {each[1] for each in split if each is not None}
    if len(given) != 1 or any((each is None) is not (value is None) for value, each in zip(values, split, strict=True)):
        return key, list(values)
    return f"{key} ({given.pop()})", [each and each[0] for each in split]


def _row(member: Member, directory: Path) -> dict[str, Any]:
    if not (directory / "problem.toml").exists():
        return {"state": "not begun"}
    run = open_run(directory)
    history, result = run.history(), run.result()
    if not history:
        return {"state": "failed" if result else "begun"}
    last = history[-1]
    row: dict[str, Any] = {
        "state": "begun" if result is None else "finished" if result.completed else "failed",
        "reason": None if result is None else result.reason,
        "designs": last.iteration,
    }
    for task in member.problem.task:
        row |= task_motions(member.problem, task, last)
        for name, pressure in task.pressure.items():
            if pressure.free:
                row[f"{task.name} pressure {name} (kPa)"] = round(1e3 * last.tasks[task.name].pressures[name], 4)
        row[f"{task.name} stretch"] = round(last.tasks[task.name].max_stretch, 4)
    for name, data in last.reinforcements.items():
        if "stiffness" in data:
            row[f"{name} stiffness (N/mm)"] = round(data["stiffness"], 4)
        if "coverage" in data:
            row[f"{name} coverage"] = round(data["coverage"], 4)
        if "winding" in data:
            row[f"{name} winding (deg)"] = round(math.degrees(data["winding"]), 4)
    row |= {"limits held": last.held, **{_heading_of(key): value for key, value in last.limits.items()}}
    row["time (s)"] = round(sum(entry.seconds["total"] for entry in history), 1)
    return row


def motions(problem: Problem, entry: HistoryEntry) -> dict[str, float]:
    """What a design achieves in each task, by headings with units, such as "extend extension (mm)"."""
    return {heading: value for task in problem.task for heading, value in task_motions(problem, task, entry).items()}


def task_motions(problem: Problem, task: Task, entry: HistoryEntry) -> dict[str, float]:
    """The same of one task: what it achieves, and the motions that it must have at least."""
    found, result = {}, entry.tasks[task.name]
    least = (amount for amount, _ in least_motions(problem, task, result))
    for amount in (task.objective.achieved(result), *least):
        unit = "deg" if amount.unit == "°" else amount.unit
        heading = f"{task.name} {amount.word}" + (f" ({unit})" if unit else "")
        found[heading] = round(amount.value, 4) if unit else float(f"{amount.value:.6g}")
    return found


def _heading_of(key: str) -> str:
    """The heading of a limit's worst value by its key in the history, such as "wall (mm)"."""
    limit = next((each for each in BY_NAME.values() if each.key == key), None)
    if limit is None:
        return key
    return f"{limit.word} ({limit.unit})" if limit.unit else limit.word


def write_summary(study: Study, out: Path) -> Path:
    """Write ``summary.csv`` into a study's directory."""
    rows = summary(study, out)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path = out / "summary.csv"
    atomic.write_bytes(path, text.getvalue().encode())
    return path


def write_sheet(study: Study, out: Path, finished: Iterable[str]) -> Path:
    """Draw ``sheet.png``: the final shape of every member that has one, at rest and inflated.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    done = set(finished)
    members = [member for member in study.members if member.name in done]
    tiles = [
        Tile(member.name, caption, open_run(out / member.name))
        for member, caption in zip(members, captions(members), strict=True)
    ]
    path = out / "sheet.png"
    draw_sheet(path, study.title, tiles)
    return path


def captions(members: Sequence[Member]) -> list[str]:
    """A caption for each member: the changes that not all members share, or its name if these do not distinguish it."""
    common = [item for item in members[0].changes.items() if all(item in each.changes.items() for each in members)]
    words = [
        "\n".join(f"{key.split('.')[-1]}: {_short(value)}" for key, value in changes) or each.name
        for each in members
        for changes in [[item for item in each.changes.items() if item not in common]]
    ]
    return words if len(set(words)) == len(members) else [each.name for each in members]


def _short(value: Any) -> str:
    if value is False:
        return "none"
    if isinstance(value, dict):
        value = list(value.values())
    return ", ".join(map(_short, value)) if isinstance(value, list | tuple) else str(value)
