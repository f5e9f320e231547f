"""Picture of a run's history: results of the tasks, limits and time, design by design."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pneumorph.analysis import HistoryEntry
from pneumorph.constraint.table import in_history
from pneumorph.output.format import motion_of
from pneumorph.problem import Custom, Limits, Maximize, Problem

PHASES = {
    "geometry": ("mesh", "#8da0b3"),
    "equilibrium": ("equilibrium", "#3b6ea5"),
    "gradient": ("gradient", "#7fb3d5"),
    "subproblem": ("sub-problem", "#e0a458"),
}
UNITS = {"mm": "mm", "°": "degrees", "": "objective"}
History = Sequence[HistoryEntry]


def draw_history(path: Path, problem: Problem, history: History) -> None:
    """Save a picture of a history."""
    figure = Figure(figsize=(12.5, 4.2), layout="constrained", facecolor="white")
    motions, limits, seconds = figure.subplots(1, 3)
    draw_motions(motions, problem, history)
    _limits(limits, problem.limits, history)
    _seconds(seconds, history)
    for axes in (motions, limits, seconds):
        axes.set_xlabel("design")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    figure.savefig(path, dpi=150)


def _designs(history: History) -> np.ndarray:
    return np.array([entry.iteration for entry in history])


def draw_motions(axes: Axes, problem: Problem, history: History) -> None:
    """Draw one curve per task, with an axis for each unit, the first on the left."""
    found = {task.name: [motion_of(task, entry.tasks[task.name]) for entry in history] for task in problem.task}
    units = list(dict.fromkeys(motions[0].unit for motions in found.values()))
    scales: dict[str, Axes] = {}
    for number, unit in enumerate(units):
        scales[unit] = axes if number == 0 else axes.twinx()
        scales[unit].set_ylabel(UNITS[unit], fontsize=9)
        scales[unit].tick_params(labelsize=8)
        if number > 0:
            scales[unit].spines[["top", "left"]].set_visible(False)
            scales[unit].spines["right"].set_position(("outward", 48 * (number - 1)))
    handles = []
    for number, (name, motions) in enumerate(found.items()):
        word, unit = motions[0].word, motions[0].unit
        label = f"{name}: {word}" if len(found) > 1 else word
        label += f" ({unit})" if len(units) > 1 and unit else ""
        values = [motion.value for motion in motions]
        handles += scales[unit].plot(
            _designs(history), values, "o-", color=f"C{number}", markersize=3, linewidth=1.5, label=label
        )
    for unit, scale in scales.items():
        # Errors are compared with zero.
        if not any(
            isinstance(task.objective, Maximize | Custom) for task in problem.task if found[task.name][0].unit == unit
        ):
            scale.set_ylim(bottom=0.0)
    remeshed = [entry.iteration for entry in history if entry.remeshed]
    if remeshed:
        marks = {"marker": "^", "color": "#999999", "markersize": 5, "linestyle": "", "clip_on": False}
        at_the_bottom = axes.get_xaxis_transform()
        handles += axes.plot(remeshed, [0.0] * len(remeshed), label="remeshed", transform=at_the_bottom, **marks)
    axes.set_title(_heading(problem), fontsize=10)
    _legend(axes, handles, 1 if len(handles) > 2 else 2)


def _heading(problem: Problem) -> str:
    """The title of the panel: what the curves of all tasks show."""
    words = {
        "motion of the tip" if isinstance(task.objective, Maximize)
        else "objective" if isinstance(task.objective, Custom)
        else "error"
        for task in problem.task
    }  # fmt: skip
    return words.pop() if len(words) == 1 else "results of the tasks"


def _legend(axes: Axes, handles: list[Any], columns: int) -> None:
    """Put the legend below the axes, where it hides nothing."""
    axes.legend(
        handles=handles,
        fontsize=8,
        frameon=False,
        ncols=columns,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        columnspacing=1.0,
        handlelength=1.2,
    )


def _limits(axes: Axes, limits: Limits, history: History) -> None:
    """Draw the fraction of each limit that is used at the worst place of the body."""
    for number, (limit, key, bound) in enumerate(in_history(limits)):
        values = [entry.limits[key] for entry in history]
        used = [np.nan if value is None else limit.used(value, bound) for value in values]
        axes.plot(_designs(history), used, "-", color=f"C{number}", linewidth=1.5, label=limit.word)
    axes.axhline(1.0, color="#444444", linewidth=1.0)
    top = max(1.2, 1.05 * axes.get_ylim()[1])
    axes.axhspan(1.0, top, color="#c0392b", alpha=0.07, linewidth=0)
    axes.set_ylim(0.0, top)
    axes.set_title("limits: fraction used at the worst place", fontsize=10)
    _legend(axes, axes.get_legend_handles_labels()[0], 6)


def _seconds(axes: Axes, history: History) -> None:
    """Draw the time of every design, by phase."""
    designs, base = _designs(history), np.zeros(len(history))
    for phase, (word, colour) in PHASES.items():
        spent = np.array([entry.seconds.get(phase) or 0.0 for entry in history])
        axes.bar(designs, spent, bottom=base, width=0.85, color=colour, label=word)
        base += spent
    axes.set_title("seconds per design", fontsize=10)
    _legend(axes, axes.get_legend_handles_labels()[0], 4)
