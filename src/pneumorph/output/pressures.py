"""Picture of pressures that are design variables: their values in every design, and their bounds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pneumorph.analysis import HistoryEntry
from pneumorph.problem import Problem, Task

PER_ROW = 3
KILO = 1e3
"""kPa in a MPa."""

GREY = "#666666"


def has_free_pressures(problem: Problem) -> bool:
    """Whether any pressure is a design variable."""
    return any(pressure.free for task in problem.task for pressure in task.pressure.values())


def draw_pressures(path: Path, problem: Problem, history: Sequence[HistoryEntry]) -> None:
    """Save a picture with a panel for every task, a curve for every chamber, and dashed lines at the bounds."""
    columns = min(PER_ROW, len(problem.task))
    rows = -(-len(problem.task) // columns)
    figure = Figure(figsize=(1.2 + 3.6 * columns, 0.7 + 2.8 * rows), layout="constrained", facecolor="white")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for number, axes in enumerate(grid.flat):
        if number >= len(problem.task):
            axes.set_axis_off()
            continue
        _task(axes, problem.task[number], history)
        # The lowest panel of a column has the tick labels, even if the place below it is empty.
        if number + columns >= len(problem.task):
            axes.set_xlabel("design", fontsize=9)
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel("pressure / kPa", fontsize=9)
    handles, _ = grid[0, 0].get_legend_handles_labels()
    handles.append(Line2D([], [], label="bounds", color=GREY, linewidth=0.8, linestyle="--"))
    figure.legend(handles=handles, fontsize=9, frameon=False, loc="outside lower center", ncols=min(len(handles), 8))
    figure.savefig(path, dpi=150)


def _task(axes: Axes, task: Task, history: Sequence[HistoryEntry]) -> None:
    designs = [entry.iteration for entry in history]
    bounds = {(pressure.min, pressure.max) for pressure in task.pressure.values() if pressure.free}
    for number, (chamber, pressure) in enumerate(task.pressure.items()):
        colour = f"C{number % 10}"
        values = [KILO * entry.tasks[task.name].pressures[chamber] for entry in history]
        axes.plot(designs, values, "o-", color=colour, markersize=3, linewidth=1.5, label=f"chamber {chamber}")
        if pressure.free:
            # Bounds that all chambers share are grey.
            shade = GREY if len(bounds) == 1 else colour
            for bound in (pressure.min, pressure.max):
                axes.axhline(KILO * bound, color=shade, linewidth=0.8, linestyle="--", zorder=1)
    axes.set_title(task.name, fontsize=10)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
