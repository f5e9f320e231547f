"""Picture of pressures that are design variables: their values in every design, and their bounds."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pneumorph.output.figures import COLUMN, SMALL, TEXT, Figure, every, line_style, plain
from pneumorph.problem import Problem, Task
from pneumorph.results import HistoryEntry

PER_ROW = 2
"""Tasks side by side in a column of a paper."""
KILO = 1e3
"""kPa in a MPa."""

GREY = "#666666"


def has_free_pressures(problem: Problem) -> bool:
    """Whether any pressure is a design variable."""
    return any(pressure.free for task in problem.task for pressure in task.pressure.values())


def pressures_figure(problem: Problem, history: Sequence[HistoryEntry]) -> Figure:
    """A figure, one column wide, with a panel for every task, a curve for every chamber, and dashed bounds."""
    columns = min(PER_ROW, len(problem.task))
    rows = -(-len(problem.task) // columns)
    figure = Figure(figsize=(COLUMN, 0.6 + 1.6 * rows), layout="constrained", facecolor="white")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    chambers = [chamber.name for chamber in problem.body.chamber]
    for number, axes in enumerate(grid.flat):
        if number >= len(problem.task):
            axes.set_axis_off()
            continue
        _task(axes, problem.task[number], chambers, history)
        # The lowest panel of a column has the tick labels, even if the place below it is empty.
        if number + columns >= len(problem.task):
            axes.set_xlabel("design", fontsize=TEXT)
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel("pressure / kPa", fontsize=TEXT)
    handles, _ = grid[0, 0].get_legend_handles_labels()
    handles.append(Line2D([], [], label="bounds", color=GREY, linewidth=0.8, linestyle="--"))
    figure.legend(
        handles=handles, fontsize=SMALL, frameon=False, loc="outside lower center", ncols=min(len(handles), 4),
        columnspacing=1.0, handlelength=1.8,
    )  # fmt: skip
    return figure


def _task(axes: Axes, task: Task, chambers: Sequence[str], history: Sequence[HistoryEntry]) -> None:
    designs = [entry.iteration for entry in history]
    bounds = {(pressure.min, pressure.max) for pressure in task.pressure.values() if pressure.free}
    for number, chamber in enumerate(chambers):
        pressure, style = task.pressure[chamber], line_style(number, len(chambers))
        values = [KILO * entry.tasks[task.name].pressures[chamber] for entry in history]
        at = every(number, len(chambers), len(history))
        axes.plot(designs, values, label=f"chamber {chamber}", markevery=at, **style)
        if pressure.free:
            # Bounds that all chambers share are grey.
            shade = GREY if len(bounds) == 1 else str(style["color"])
            for bound in (pressure.min, pressure.max):
                axes.axhline(KILO * bound, color=shade, linewidth=0.8, linestyle="--", zorder=1)
    axes.set_title(task.name, fontsize=TEXT, pad=3)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    plain(axes)
