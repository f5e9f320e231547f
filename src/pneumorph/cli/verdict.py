"""The first line of a run's summary: whether the targets are reached, and how nearly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.text import Text

from pneumorph.limits.kinds.states import beside
from pneumorph.problem import Problem
from pneumorph.results import HistoryEntry
from pneumorph.results.targets import Reached, distances, targets_reached


def verdict(problem: Problem, history: Sequence[HistoryEntry]) -> Text:
    """Whether the targets are reached; where no task has one, what the first task achieves."""
    reached = targets_reached(problem, history)
    if not reached:
        task = problem.task[0]
        last = history[-1].tasks[task.name]
        done, least = task.objective.achieved(last), beside(problem, task, last)
        more = f", and {len(problem.task) - 1} more below" if len(problem.task) > 1 else ""
        return Text(f"\nNo target was stated; {task.name}: {done.word} of {done}{least}{more}.", style="bold")
    said = [_sentence(problem, name, each, history) for name, each in reached.items()]
    return Text("\n" + " ".join(said), style="bold red" if Reached.NO in reached.values() else "bold")


def all_reached(reached: Mapping[str, Reached]) -> bool:
    """Whether no target is missed."""
    return Reached.NO not in reached.values()


def _sentence(problem: Problem, name: str, reached: Reached, history: Sequence[HistoryEntry]) -> str:
    objective = next(task.objective for task in problem.task if task.name == name)
    left, before = (
        _words(objective.errors(distances(objective, each.tasks[name]))) for each in (history[-1], history[0])
    )
    which = f" of task {name}" if len(problem.task) > 1 else ""
    if reached is Reached.YES:
        return f"Target{which} reached, {left} away."
    if reached is Reached.NEARLY:
        return f"Target{which} reached within {left}."
    return f"Target{which} not reached: still {left} away, {before} at the start."


def _words(away: Sequence[object]) -> str:
    return " and ".join(map(str, away))
