"""The Pareto front of a study that varies how much two tasks count: what more of one wish costs of the other."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from pneumorph.output.figures import save
from pneumorph.output.front import Trade, front_figure
from pneumorph.problem import Task
from pneumorph.problem.objectives.words import Amount
from pneumorph.results import TaskResult
from pneumorph.run import open_run
from pneumorph.study.file import Study

_WEIGHT = re.compile(r"task\[\d+\]\.weight")


def write_front(study: Study, out: Path, finished: Iterable[str]) -> Path | None:
    """Draw ``pareto.png`` from the last designs that satisfy their limits.

    None is drawn for other studies: those without two tasks whose weights differ among members, or with less than two
    such designs.

    Parameters
    ----------
    study, out : the study and its directory.
    finished : names of the members whose runs have ended.
    """
    done, trades, labels = set(finished), [], list[str]()
    if not any(_WEIGHT.fullmatch(key) for member in study.members for key in member.changes):
        return None
    for member in study.members:
        tasks = member.problem.task
        history = open_run(out / member.name).history() if member.name in done and len(tasks) == 2 else []
        if not history or not history[-1].held:
            continue
        results = [history[-1].tasks[task.name] for task in tasks]
        one, other = (_wish(task, result) for task, result in zip(tasks, results, strict=True))
        named = [
            f"{task.name}: {each.word}" + (f" / {each.unit}" if each.unit else "")
            for task, each in zip(tasks, (one, other), strict=True)
        ]
        if labels and named != labels:
            return None
        labels = named
        minimised = results[0].objective, results[1].objective
        trades.append(Trade(member.name, (one.value, other.value), minimised))
    if len(trades) < 2:
        return None
    path = out / "pareto.png"
    save(front_figure(study.title, labels, trades), path)
    return path


def _wish(task: Task, result: TaskResult) -> Amount:
    """What a task is to have as much or as little of as possible: of one with a target, how far it is from that."""
    asked = task.objective
    return asked.errors(result.errors)[0] if asked.aimed else asked.achieved(result)
