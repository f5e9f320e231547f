"""What the page of a run shows beside its shapes, as plain values: the typed records and words for them."""

from __future__ import annotations

import base64
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import pneumorph
from pneumorph.limits.kinds.states import beside
from pneumorph.limits.report import without_rounding
from pneumorph.limits.table import in_history
from pneumorph.mechanics import rubbers_of
from pneumorph.objective.kinds import target_of
from pneumorph.output.certainty import certainty, of_rubber, of_the_mesh
from pneumorph.output.cuts import view_of
from pneumorph.output.format import (
    balloons,
    balloons_perhaps,
    format_data,
    format_duration,
    format_pressures,
    stretches,
    warnings_of,
)
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting, words_of_own
from pneumorph.problem.materials import materials
from pneumorph.problem.sources import largest_deviation
from pneumorph.results import FineResult, HistoryEntry, RunResult, TaskResult, to_json
from pneumorph.run import RunDirectory

MOST_STEP = 3_000_000
"""Bytes of the exact CAD that are put into the page; a larger file is named instead."""

FINE = 60
"""Points of a target curve on the page."""


def facts_of(run: RunDirectory, history: list[HistoryEntry]) -> dict[str, Any]:
    """Everything but shapes, for a run with at least one design."""
    problem, result = run.problem, run.result()
    if result is not None and result.iterations < history[-1].iteration:
        # It is from before the run was resumed.
        result = None
    view, effector, loads = view_of(problem), problem.end_effector, acting(problem, problem.task[0])
    return {
        "title": problem.title or run.path.resolve().name,
        "made_by": f"pneumorph {pneumorph.__version__}",
        "directory": run.path.resolve().name,
        "length": problem.body.length,
        "gravity": None if loads.gravity is None else list(loads.gravity.direction),
        "plate": effector.kind == "plate",
        "force": list(loads.force),
        "envelope": None if problem.limits.envelope is None else problem.limits.envelope.radius,
        "view": {"normal": view.normal.tolist(), "offset": view.offset},
        "tasks": [_task(problem, task) for task in problem.task],
        "limits": [
            {"key": key, "word": limit.word, "unit": limit.unit, "bound": bound, "at_least": limit.at_least}
            for limit, key, bound in in_history(problem)
        ],
        "history": [
            *(_entry(problem, entry, entry.finer) for entry in history[:-1]),
            # Histories of earlier versions have no estimates.
            _entry(problem, history[-1], history[-1].finer if result is None else result.finer),
        ],
        "result": None if result is None else to_json(result) | {"spent": format_duration(result.seconds["total"])},
        "warnings": [
            *_warnings(problem, history[-1].tasks if result is None else result.tasks),
            *([] if result is None else _ballooning(result)),
        ],
        "material": [
            *_material(run.path / "problem.toml"),
            *((f"task {name}", stretches(rubbers_of(problem), last)) for name, last in history[-1].tasks.items()),
            *([] if result is None else _certainties(problem, result)),
            *_designed(history[-1]),
        ],
        "problem": _text(run.path / "problem.toml"),
        "files": _files(run.path / "make"),
    }


def _entry(problem: Problem, entry: HistoryEntry, finer: Mapping[str, FineResult]) -> dict[str, Any]:
    """A line of the history, and the results of its tasks in the units that users expect."""
    motions = {task.name: task.objective.achieved(entry.tasks[task.name]) for task in problem.task}
    texts = {name: motion.beside_target for name, motion in motions.items()}
    fine = {task.name: task.objective.achieved(finer[task.name]) for task in problem.task if task.name in finer}
    texts |= {name: motions[name].with_error(each) for name, each in fine.items()}
    least = {task.name: beside(problem, task, entry.tasks[task.name]) for task in problem.task}
    return to_json(entry) | {
        "limits": {key: None if value is None else without_rounding(value) for key, value in entry.limits.items()},
        "motions": {
            name: {"value": motion.value, "unit": motion.unit, "word": motion.word, "found": str(motion)}
            | ({"fine": fine[name].value} if name in fine else {})
            | {"text": f"{texts[name]}{least[name]}", "at": format_pressures(entry.tasks[name].pressures)}
            for name, motion in motions.items()
        },
    }


def _task(problem: Problem, task: Task) -> dict[str, Any]:
    loads = acting(problem, task)
    return {
        "name": task.name,
        "weight": task.weight,
        "kind": task.objective.kind,
        "target": _target(problem, task),
        "force": list(loads.force),
        "gravity": None if loads.gravity is None else list(loads.gravity.direction),
        "loads": words_of_own(task),
    }


def _target(problem: Problem, task: Task) -> dict[str, Any] | None:
    """The target of a task: a curve with sections on it, or a position and a direction of the plate; None without."""
    target = target_of(task.objective, problem.body.length)
    if target is None:
        return None
    line, place, axis = target.line, target.place, target.axis
    if len(line):
        some = line if len(line) <= FINE else line[:: len(line) // FINE]
        return {"line": np.round([*some, line[-1]], 3).tolist(), "sections": target.sections.tolist()}
    return {"place": None if place is None else place.tolist(), "axis": None if axis is None else axis.tolist()}


def _warnings(problem: Problem, tasks: Mapping[str, TaskResult]) -> list[str]:
    """Sentences that say where the results of the last design cannot be trusted."""
    rubbers = rubbers_of(problem)
    return [f"Task {name}: {sentence}." for name, result in tasks.items() for sentence in warnings_of(rubbers, result)]


def _ballooning(result: RunResult) -> list[str]:
    """Sentences on tasks that are near ballooning, or may be."""
    return [
        f"Task {name}: {words(result.tasks[name].pressures, load)}."
        for words, loads in ((balloons, result.margins), (balloons_perhaps, result.followed))
        for name, load in loads.items()
    ]


def _certainties(problem: Problem, result: RunResult) -> Iterator[tuple[str, str]]:
    """How far motions are off by the mesh, and what they depend on, task by task."""
    known = largest_deviation(materials(problem).values())
    for task in problem.task:
        last, sentences = result.tasks[task.name], list[str]()
        if finer := result.finer.get(task.name):
            sentences += of_the_mesh(task.objective, last, finer)
        if rates := result.rates.get(task.name):
            sentences += certainty(task.objective, last, rates)
            sentences += of_rubber(task.objective, rates, known)
        yield from ((f"task {task.name}", sentence) for sentence in sentences)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8-sig", errors="replace")


def _material(path: Path) -> list[tuple[str, str]]:
    """The table [material], those of regions and of reinforcements as in the file, with the units of quantities."""
    table = tomllib.loads(_text(path))
    rows = _said(table["material"])
    for region in table.get("region", []):
        shape = next({key: region[key]} for key in ("layer", "sleeve", "beyond", "within", "inside") if key in region)
        rows.append((f"region {region['name']}", _words(shape)))
        rows += [(f"{region['name']}: {key}", value) for key, value in _said(region["material"])]
    for each in [*table.get("membrane", []), *table.get("fibres", [])]:
        rows.append((each["name"], _words({key: value for key, value in each.items() if key != "name"})))
    return rows


def _said(material: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a rubber's table says, without keys that say nothing."""
    return [(key.replace("_", " "), _words(value)) for key, value in material.items() if value not in ("", False)]


def _designed(last: HistoryEntry) -> list[tuple[str, str]]:
    """What the last design has of sheets and fibres that are designed."""
    return [(f"design {last.iteration}", format_data(last.reinforcements))] if last.reinforcements else []


def _words(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_words, value))
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(part)}" for key, part in value.items())
    return str(value)


def _files(folder: Path) -> list[dict[str, Any]]:
    """The exact CAD that `make` has written: in the page where it is small, else its name alone.

    What links lead to is none: a page is passed on, and would have any file of its author's in it.
    """
    files = []
    for path in [] if folder.is_symlink() else sorted(folder.glob("*.step")):
        if path.is_symlink() or not path.is_file():
            continue
        small = path.stat().st_size <= MOST_STEP
        content = base64.b64encode(path.read_bytes()).decode("ascii") if small else None
        files.append({"name": path.name, "bytes": path.stat().st_size, "content": content})
    return files
