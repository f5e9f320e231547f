"""How a run went: the motion, the limits and the time of every design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pneumorph.output.limits import bounds
from pneumorph.output.words import motion_of
from pneumorph.problem import Limits, Problem

PHASES = {
    "geometry": ("mesh", "#8da0b3"),
    "equilibrium": ("equilibrium", "#3b6ea5"),
    "gradient": ("gradient", "#7fb3d5"),
    "subproblem": ("sub-problem", "#e0a458"),
}
Lines = Sequence[Mapping[str, Any]]


def draw_history(path: Path, problem: Problem, lines: Lines) -> None:
    """Save the picture of a history."""
    figure = Figure(figsize=(12.5, 3.9), layout="constrained", facecolor="white")
    motions, limits, seconds = figure.subplots(1, 3)
    _motions(motions, problem, lines)
    _limits(limits, problem.limits, lines)
    _seconds(seconds, lines)
    for axes in (motions, limits, seconds):
        axes.set_xlabel("design")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    figure.savefig(path, dpi=150)


def _designs(lines: Lines) -> np.ndarray:
    return np.array([line["iteration"] for line in lines])


def _motions(axes: Axes, problem: Problem, lines: Lines) -> None:
    """One curve per task; millimetres on the left, degrees on the right where there are both."""
    by_unit: dict[str, Axes] = {}
    for number, task in enumerate(problem.task):
        found = [motion_of(task, line["tasks"][task.name]) for line in lines]
        unit = found[0].unit
        if unit not in by_unit:
            by_unit[unit] = axes if not by_unit else axes.twinx()
            by_unit[unit].set_ylabel("mm" if unit == "mm" else "degrees")
        label = f"{task.name}: {found[0].word}" if len(problem.task) > 1 else found[0].word
        values = [motion.value for motion in found]
        by_unit[unit].plot(_designs(lines), values, "o-", color=f"C{number}", markersize=3, linewidth=1.5, label=label)
    remeshed = [line["iteration"] for line in lines if line["remeshed"]]
    axes.plot(remeshed, np.zeros(len(remeshed)), "^", color="#999999", markersize=5, label="meshed anew", clip_on=False)
    axes.set_title("motion of the tip", fontsize=10)
    handles = [handle for one in by_unit.values() for handle in one.get_legend_handles_labels()[0]]
    axes.legend(handles=handles, fontsize=8, frameon=False)


def _limits(axes: Axes, limits: Limits, lines: Lines) -> None:
    """The part of each limit that the worst place on the body uses."""
    for number, bound in enumerate(bounds(limits)):
        values = [line["limits"][bound.key] for line in lines]
        used = [np.nan if value is None else bound.used(value) for value in values]
        axes.plot(_designs(lines), used, "-", color=f"C{number}", linewidth=1.5, label=bound.word)
    axes.axhline(1.0, color="#444444", linewidth=1.0)
    top = max(1.2, 1.05 * axes.get_ylim()[1])
    axes.axhspan(1.0, top, color="#c0392b", alpha=0.07, linewidth=0)
    axes.set_ylim(0.0, top)
    axes.set_title("limits: part used at the worst place (1 is the limit)", fontsize=10)
    axes.legend(
        fontsize=8,
        frameon=False,
        ncols=6,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        columnspacing=1.0,
        handlelength=1.2,
    )


def _seconds(axes: Axes, lines: Lines) -> None:
    """Where the time of every design went."""
    designs, base = _designs(lines), np.zeros(len(lines))
    for phase, (word, colour) in PHASES.items():
        spent = np.array([line["seconds"].get(phase) or 0.0 for line in lines])
        axes.bar(designs, spent, bottom=base, width=0.85, color=colour, label=word)
        base += spent
    axes.set_title("seconds per design", fontsize=10)
    axes.legend(fontsize=8, frameon=False)
