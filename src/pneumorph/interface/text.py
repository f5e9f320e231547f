"""What `print` shows of problems' runs, designs and sweeps: a few lines, with units. Nothing is solved for them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pneumorph.limits.kinds.states import beside
from pneumorph.output.certainty import of_step
from pneumorph.output.format import format_duration, format_pressures
from pneumorph.problem import Problem
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.objectives.words import motion_amount
from pneumorph.results import HistoryEntry, RunResult, SweepStep

MOST = 3
"""Tasks, or steps of a sweep, that are shown; of more, the others are counted."""


def design_text(problem: Problem, iteration: int, entry: HistoryEntry | None, pressures: int) -> str:
    """A design: its title and number, what each task achieves, and whether its limits are satisfied.

    Parameters
    ----------
    problem : of the design.
    iteration : its number.
    entry : its results, if they are known.
    pressures : number of tasks for which it has pressures.
    """
    lines = [f"design {iteration} of {problem.title or 'a problem without a title'}"]
    if entry is None:
        return "\n".join([*lines, f"  not analysed yet; {_tasks(pressures)}"])
    for task in problem.task[:MOST]:
        result = entry.tasks[task.name]
        motion, state = task.objective.achieved(result), "stable" if result.stable else "not stable"
        at = format_pressures(result.pressures)
        lines.append(
            f"  {task.name}: {motion.word} {motion.beside_target}{beside(problem, task, result)} at {at}, {state}"
        )
    lines += _more(len(problem.task), "tasks")
    kept = "all limits satisfied" if entry.held else "not all limits satisfied"
    return "\n".join([*lines, f"  {kept}; {entry.elements} elements"])


def run_text(problem: Problem, path: Path, history: Sequence[HistoryEntry], result: RunResult | None) -> str:
    """A run: where it is, how far each task has come, how it ended.

    Parameters
    ----------
    problem : of the run.
    path : its directory.
    history : its designs.
    result : how it ended; None while it goes on.
    """
    lines = [f"run of {problem.title or 'a problem without a title'} in {path}"]
    if not history:
        return "\n".join([*lines, "  no design is finished yet"])
    for task in problem.task[:MOST]:
        before, after = (task.objective.achieved(history[k].tasks[task.name]) for k in (0, -1))
        finer = None if result is None else result.finer.get(task.name)
        found = str(after) if finer is None else after._replace(target=None).with_error(task.objective.achieved(finer))
        target = f", target {result.targets[task.name]}" if result and task.name in result.targets else ""
        lines.append(f"  {task.name}: {after.word} {before} → {found} in {history[-1].iteration} designs{target}")
    lines += _more(len(problem.task), "tasks")
    lines.append("  it has not ended" if result is None else f"  it ended because {result.reason}")
    return "\n".join(lines)


def sweep_text(steps: Sequence[SweepStep], seconds: float) -> str:
    """A sweep: how many steps have an equilibrium, and the tip's motion at the last ones.

    Parameters
    ----------
    steps : of all its curves.
    seconds : that it took.
    """
    converged = [step for step in steps if step.converged]
    lines = [f"sweep of {len(steps)} steps, {len(converged)} with an equilibrium, in {format_duration(seconds)}"]
    for step in converged[-MOST:]:
        moved = (motion_amount(name, 1.0, step) for name in MOTIONS)
        told = ", ".join(f"{amount.word} {amount}" for amount in moved if abs(amount.value) >= 5e-3)
        lines.append(f"  {format_pressures(step.pressures)}: {of_step(step) or told or 'no motion'}")
    failed = next((step for step in steps if not step.converged), None)
    return "\n".join(lines if failed is None else [*lines, f"  {format_pressures(failed.pressures)}: {failed.reason}"])


def _tasks(count: int) -> str:
    return f"pressures for {count} task{'' if count == 1 else 's'}"


def _more(count: int, what: str) -> list[str]:
    return [f"  and {count - MOST} more {what}"] if count > MOST else []
