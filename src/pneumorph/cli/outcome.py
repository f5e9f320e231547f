"""The summary of a design run: what was achieved, within which limits, which design is the best, and where it is."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from pneumorph.analysis import result_share
from pneumorph.cli.columns import MARK
from pneumorph.cli.verdict import verdict
from pneumorph.interface.runs import Run
from pneumorph.limits.kinds.states import least_motions
from pneumorph.limits.limit import Limit
from pneumorph.limits.report import LimitReading, without_rounding
from pneumorph.limits.table import BY_NAME, OF_SHAPE, in_history
from pneumorph.mechanics import rubbers_of
from pneumorph.optimize.states import in_words
from pneumorph.output.certainty import certainty, of_rubber, of_the_asked, of_the_mesh
from pneumorph.output.chambers import of_chambers
from pneumorph.output.format import (
    balloons,
    balloons_perhaps,
    format_data,
    format_duration,
    format_pressures,
    stretches,
)
from pneumorph.problem import Problem, Task
from pneumorph.problem.materials import materials
from pneumorph.problem.sources import largest_deviation, told
from pneumorph.results import HistoryEntry, RunResult


def outcome(run: Run, start: HistoryEntry, result: RunResult) -> Iterator[RenderableType]:
    """The summary, to be printed one after another; `start` is the history's first entry."""
    best = run.best
    yield verdict(run.problem, run.history)
    yield Text(how_many(run.problem.optimizer.iterations, result))
    yield tasks_table(run.problem, start, result)
    rubbers = rubbers_of(run.problem)
    known = largest_deviation(materials(run.problem).values())
    for task in run.problem.task:
        if finer := result.finer.get(task.name):
            here = result.tasks[task.name]
            for sentence in of_the_mesh(task.objective, here, finer):
                yield Text(f"{task.name}: {sentence}")
        if rates := result.rates.get(task.name):
            for sentence in certainty(task.objective, result.tasks[task.name], rates):
                yield Text(f"{task.name}: {sentence}")
            for sentence in of_rubber(task.objective, rates, known):
                yield Text(f"{task.name}: {sentence}")
        if off := castings_off(run.problem, task, run.history[-1]):
            yield Text(f"{task.name}: {off}")
        yield Text(f"{task.name}: {stretches(rubbers, result.tasks[task.name])}")
        if margin := result.margins.get(task.name):
            yield Text(f"{task.name}: {balloons(result.tasks[task.name].pressures, margin)}", style="bold")
        if followed := result.followed.get(task.name):
            yield Text(f"{task.name}: {balloons_perhaps(result.tasks[task.name].pressures, followed)}", style="bold")
    if (asked := run.problem.mesh.error) is not None:
        yield Text(of_the_asked(asked, result_share(run.problem, result)))
    yield from map(Text, of_chambers(result.chambers))
    if any(use.idle or use.same_as for use in result.chambers.values()):
        shown = shlex.quote(str(run.path))
        yield Text(f"For a problem without what is not needed: pneumorph check {shown} --quick --fewer FILE.toml")
    for material in materials(run.problem).values():
        yield from map(Text, told(material))
    last = run.history[-1]
    if last.reinforcements:
        yield Text(f"{format_data(start.reinforcements)} → {format_data(last.reinforcements)}")
    of_states = [each for each in in_history(run.problem) if each[0] not in OF_SHAPE]
    yield limits_table(best.limits, [(limit, last.limits.get(key), bound) for limit, key, bound in of_states])
    number = best.iteration
    which = "the start" if number == 0 else f"number {number}, the last"
    stored = run.path / "designs" / f"{number:04d}.npz"
    yield Text(f"The best design is {which}: {stored}. To view it: pneumorph view {shlex.quote(str(run.path))}")


def castings_off(problem: Problem, task: Task, last: HistoryEntry) -> str:
    """How far castings of a robust design may be off in a task, in words; empty without any."""
    if problem.robust is None:
        return ""
    off = [result for name, result in last.castings.items() if name.rpartition(", casting ")[0] == task.name]
    motions = " and ".join(str(task.objective.achieved(each)) for each in off)
    return f"castings perturbed by {problem.robust.deviations:g} standard deviation(s): {motions}" if off else ""


def how_many(asked: int, result: RunResult) -> str:
    """How many designs were made, and why the loop ended."""
    spent, made = format_duration(result.seconds["total"]), result.iterations
    designs = f"{made} design{'' if made == 1 else 's'}"
    of_most = "" if made == asked else f" of at most {asked}"
    return f"{designs}{of_most} in {spent}; the loop ended because {result.reason}."


def tasks_table(problem: Problem, start: HistoryEntry, result: RunResult) -> Table:
    """Task by name: its motion at the start and at the end, the pressures, and what is to be known of its state."""
    table = _table("task", "", "start", "best", "pressure", "state")
    for task in problem.task:
        ended = result.tasks[task.name]
        before, after = task.objective.achieved(start.tasks[task.name]), task.objective.achieved(ended)
        finer = result.finer.get(task.name)
        told = after.beside_target if finer is None else after.with_error(task.objective.achieved(finer))
        state = Text("stable") if ended.stable else Text(f"not stable {MARK}", style="red")
        if ended.self_intersecting:
            state.append(f", self-intersecting {MARK}", style="red")
        shown = (f"{before} →", Text(told, style="bold"), format_pressures(ended.pressures))
        table.add_row(task.name, after.word, *shown, state)
        least = (least_motions(problem, task, each) for each in (start.tasks[task.name], ended))
        for (began, _), (ends, asked) in zip(*least, strict=True):
            table.add_row("", ends.word, f"{began} →", Text(f"{ends} ({asked})", style="bold"))
    return table


def limits_table(
    readings: tuple[LimitReading, ...], of_states: Iterable[tuple[Limit, float | None, float]] = ()
) -> Table:
    """Every limit: its worst value, what it must be, and where the worst value is at rest; marked if it is not kept.

    Limits that nobody has asked for, such as that no surface folds onto itself, are shown only if they are not kept.
    """
    table = _table("limit", "worst", "must be", "on", "x mm", "y mm", "z mm")
    for reading in readings:
        limit = BY_NAME[reading.limit]
        if limit.key is None and reading.satisfied():
            continue
        unit = limit.suffix
        kept = reading.satisfied()
        worst = Text(
            f"{without_rounding(reading.value):.3g}{unit}{'' if kept else ' ' + MARK}",
            style="" if kept else "red",
        )
        bound = f"{'≥' if limit.at_least else '≤'} {reading.bound:g}{unit}"
        # Rounded before it is written, so that no -0.0 is shown.
        place = (Text(f"{round(part, 1) + 0.0:.1f}", justify="right") for part in reading.point)
        table.add_row(limit.word, worst, bound, reading.surface, *place)
    for limit, value, bound in of_states:
        kept = value is not None and limit.satisfied(value, bound)
        shown = "–" if value is None else in_words(limit, value, bound)
        worst = Text(shown if kept else f"{shown} {MARK}", style="" if kept else "red")
        # A motion the other way is as far as asked, or farther.
        at_least = limit.at_least == (limit.told > 0.0)
        asked = f"{'≥' if at_least else '≤'} {limit.told * bound:g}{limit.suffix}"
        table.add_row(limit.word, worst, asked, "all tasks")
    return table


def _table(*titles: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for number, title in enumerate(titles):
        # Narrow screens fold what rows say, not their names.
        table.add_column(title, overflow="fold", no_wrap=number == 0)
    return table
