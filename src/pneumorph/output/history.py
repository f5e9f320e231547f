"""Picture of a run's history: results of the tasks, limits and time, design by design."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pneumorph.limits.kinds.states import least_motions
from pneumorph.limits.table import in_history
from pneumorph.output.figures import COLUMN, SMALL, TEXT, Figure, every, line_style, plain
from pneumorph.problem import Problem, Task
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.results import HistoryEntry

PHASES = {
    "geometry": ("mesh", "#8da0b3"),
    "equilibrium": ("equilibrium", "#0072b2"),
    "gradient": ("gradient", "#56b4e9"),
    "subproblem": ("sub-problem", "#e69f00"),
}
UNITS = {"°": "degrees", "": "objective"}
OVER = 1.15
"""Where the diagram of the limits ends; larger values are written as numbers."""

TO_FINE = {"marker": "_", "markersize": 5.0, "linewidth": 0.9, "zorder": 3.0}
"""Strokes to the values on infinitely fine meshes."""

History = Sequence[HistoryEntry]


def history_figure(problem: Problem, history: History) -> Figure:
    """A figure of a history, one column wide."""
    figure = Figure(figsize=(COLUMN, 6.4), layout="constrained", facecolor="white")
    motions, limits, seconds = figure.subplots(3, 1, height_ratios=(1.1, 1.1, 0.8))
    draw_motions(motions, problem, history)
    draw_limits(limits, problem, history)
    _seconds(seconds, history)
    for axes in (motions, limits, seconds):
        axes.set_xlabel("design", fontsize=TEXT, labelpad=1)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        plain(axes)
    return figure


def _designs(history: History) -> np.ndarray:
    return np.array([entry.iteration for entry in history])


def draw_motions(axes: Axes, problem: Problem, history: History) -> None:
    """Draw one curve per task, and one per motion that it must have at least, with an axis for each unit, the first on
    the left.

    Where they are known, values on infinitely fine meshes are the other ends of strokes from the curves.
    """
    curves, errors = _curves(problem, history), list[Line2D]()
    units = list(dict.fromkeys(curve.amounts[0].unit for curve in curves))
    scales: dict[str, Axes] = {}
    for number, unit in enumerate(units):
        scales[unit] = axes if number == 0 else axes.twinx()
        scales[unit].set_ylabel(UNITS.get(unit, unit), fontsize=TEXT, labelpad=2)
        if number > 0:
            scales[unit].tick_params(labelsize=SMALL, length=2.5, pad=2)
            scales[unit].spines[["top", "left"]].set_visible(False)
            scales[unit].spines["right"].set_position(("outward", 34 * (number - 1)))
    handles, targets = [], []
    for number, curve in enumerate(curves):
        word, unit = curve.amounts[0].word, curve.amounts[0].unit
        label = f"{curve.task.name}: {word}" if len(problem.task) > 1 else word
        told = curve.asked or (unit if len(units) > 1 else "")
        label += f" ({told})" if told else ""
        values = [amount.value for amount in curve.amounts]
        style = line_style(number, len(curves))
        at = every(number, len(curves), len(history))
        handles += scales[unit].plot(_designs(history), values, label=label, markevery=at, **style)
        for iteration, ends in curve.to_fine:
            errors = scales[unit].plot([iteration] * 2, ends, color=style["color"], **TO_FINE)
        if curve.amounts[-1].target is not None:
            # Of the colour of its curve; the first says what such lines are.
            dotted = {"color": style["color"], "linestyle": (0, (1, 1.5)), "linewidth": 1.0}
            targets.append(scales[unit].axhline(curve.amounts[-1].target, **dotted))
    for unit, scale in scales.items():
        # Errors are compared with zero.
        if all(curve.is_error for curve in curves if curve.amounts[0].unit == unit):
            scale.set_ylim(bottom=0.0)
    remeshed = [entry.iteration for entry in history if entry.remeshed]
    if remeshed:
        marks = {"marker": "|", "color": "#777777", "markersize": 6, "linestyle": "", "clip_on": False}
        at_the_bottom = axes.get_xaxis_transform()
        handles += axes.plot(remeshed, [0.0] * len(remeshed), label="remeshed", transform=at_the_bottom, **marks)
    if errors:
        errors[0].set_label("error of the mesh")
        handles += errors
    if targets:
        bounded = [bool(curve.asked) for curve in curves if curve.amounts[-1].target is not None]
        targets[0].set_label("least motion" if all(bounded) else "target, least motion" if any(bounded) else "target")
        handles.append(targets[0])
    axes.set_title(_heading(curves), fontsize=TEXT)
    _legend(axes, handles, 1 if len(curves) > 1 else 2)


@dataclass(frozen=True)
class _Curve:
    """What a task achieves in every design, or a motion that it must have at least, with what is asked in words.

    And at some designs the value there and on an infinitely fine mesh.
    """

    task: Task
    amounts: list[Amount]
    to_fine: list[tuple[int, list[float]]]
    asked: str = ""

    @property
    def is_error(self) -> bool:
        """Whether it is the task's distance from the target, and not a value beside its target."""
        return self.task.objective.curve == "error" and self.amounts[0].target is None


def _curves(problem: Problem, history: History) -> list[_Curve]:
    """Those of every task: what it achieves, then the motions that it must have at least."""
    return [curve for task in problem.task for curve in _of_task(problem, task, history)]


def _of_task(problem: Problem, task: Task, history: History) -> Iterator[_Curve]:
    def shown(result: Result) -> list[tuple[Amount, str]]:
        return [(task.objective.achieved(result), ""), *least_motions(problem, task, result)]

    designs = [shown(entry.tasks[task.name]) for entry in history]
    finer = {entry.iteration: shown(entry.finer[task.name]) for entry in history if task.name in entry.finer}
    for number, (_, asked) in enumerate(designs[0]):
        amounts = [design[number][0] for design in designs]
        values = {entry.iteration: amount.value for entry, amount in zip(history, amounts, strict=True)}
        to_fine = [(iteration, [values[iteration], fine[number][0].value]) for iteration, fine in finer.items()]
        yield _Curve(task, amounts, to_fine, asked)


def _heading(curves: Sequence[_Curve]) -> str:
    """The title of the panel: what all curves show."""
    if any(curve.asked for curve in curves):
        return "results of the tasks"
    plainly = (curve.task.objective.curve != "error" or curve.is_error for curve in curves)
    words = {
        curve.task.objective.curve if plain else curve.amounts[-1].word
        for curve, plain in zip(curves, plainly, strict=True)
    }
    return words.pop() if len(words) == 1 else "results of the tasks"


def _legend(axes: Axes, handles: list[Any], columns: int) -> None:
    """Put the legend below the axes, where it hides nothing."""
    axes.legend(
        handles=handles,
        fontsize=SMALL,
        frameon=False,
        ncols=columns,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        # Below the ticks and their label, in sizes of letters.
        borderaxespad=3.7,
        columnspacing=1.0,
        handlelength=1.8,
        labelspacing=0.3,
    )


def draw_limits(axes: Axes, problem: Problem, history: History) -> None:
    """Draw the fraction of each limit that is used at the worst place of the body.

    A value far above its limit is written as a number above the diagram: otherwise it would flatten all other curves.
    """
    shown = in_history(problem)
    designs = _designs(history)
    for number, (limit, key, bound) in enumerate(shown):
        values = [entry.limits.get(key) for entry in history]
        used = np.array([np.nan if value is None else limit.used(value, bound) for value in values])
        at, style = every(number, len(shown), len(history)), line_style(number, len(shown))
        axes.plot(designs, used, label=limit.word, markevery=at, **style)
        _tell_peak(axes, designs, used, str(style["color"]))
    axes.axhline(1.0, color="#444444", linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
    axes.axhspan(1.0, OVER, color="#d55e00", alpha=0.08, linewidth=0)
    axes.set_ylim(0.0, OVER)
    axes.set_ylabel("share used", fontsize=TEXT, labelpad=2)
    axes.set_title("limits, worst value of the body", fontsize=TEXT, pad=12)
    _legend(axes, axes.get_legend_handles_labels()[0], 3)


def _tell_peak(axes: Axes, designs: np.ndarray, used: np.ndarray, colour: str) -> None:
    """Write the largest value above the diagram, where it has left it."""
    if np.nanmax(used, initial=0.0) <= OVER:
        return
    peak = int(np.nanargmax(used))
    words = {"ha": "center", "va": "bottom", "fontsize": SMALL, "color": colour, "annotation_clip": False}
    axes.annotate(f"↑ {used[peak]:.3g}", (designs[peak], OVER), (0, 1), textcoords="offset points", **words)


def _seconds(axes: Axes, history: History) -> None:
    """Draw the time of every design, by phase."""
    designs, base = _designs(history), np.zeros(len(history))
    for phase, (word, colour) in PHASES.items():
        spent = np.array([entry.seconds.get(phase) or 0.0 for entry in history])
        axes.bar(designs, spent, bottom=base, width=0.85, color=colour, label=word)
        base += spent
    axes.set_title("time of each design", fontsize=TEXT)
    axes.set_ylabel("s", fontsize=TEXT, labelpad=2)
    _legend(axes, axes.get_legend_handles_labels()[0], 4)
