"""Pictures of target and achieved shape: centre lines of the body with its sections, in space and projected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from scipy.interpolate import make_interp_spline

from pneumorph.objective.features import equidistant
from pneumorph.objective.kinds import target_of
from pneumorph.output.figures import COLUMN, SMALL, TEXT, Figure, plain
from pneumorph.problem import Task
from pneumorph.results import TaskResult

FINE = 200
"""Points along the centre line of a body."""

AXES = ("x", "y", "z")
STYLES: Mapping[str, Mapping[str, Any]] = {
    "start": {"color": "#56b4e9", "linewidth": 1.2, "markersize": 2.5},
    "final": {"color": "#d55e00", "linewidth": 1.4, "markersize": 2.5},
    "target": {
        "color": "#000000",
        "linewidth": 0.8,
        "linestyle": (0, (5, 2.5)),
        "markersize": 4.5,
        "fillstyle": "none",
    },
}
LEAST = 0.3
"""Least width of a projection, as a fraction of the widest."""

SPACE, GAP, EDGE, LINE = 2.0, 0.4, 0.08, 0.14
"""Inches: height of the picture in space, space for labels, margin, and a line of the legend."""

LARGEST, MOST_ZOOMS = 1.15, 6
"""Largest zoom of the picture in space, and how often it is made smaller."""


class CentreLine(NamedTuple):
    """A curve (n, 3) that starts at the centre of the base, and the centres of the sections (S, 3) on it, in mm."""

    points: np.ndarray
    sections: np.ndarray


def achieved_centre_line(result: TaskResult, length: float) -> CentreLine:
    """The result of a task as a centre line: a smooth curve from the base through the sections to the tip."""
    sections = np.array(result.section_positions)
    heights = np.r_[0.0, equidistant(len(sections), length).middle, length]
    points = np.vstack([np.zeros(3), sections, np.array([0.0, 0.0, length]) + result.translation])
    return CentreLine(make_interp_spline(heights, points, k=3)(np.linspace(0.0, length, FINE)), sections)


def shape_figure(
    task: Task, length: float, first: TaskResult, last: TaskResult, names: tuple[str, str] = ("start", "final")
) -> Figure:
    """A figure, one column wide, of the target of a task and of the shapes that two designs take.

    Parameters
    ----------
    task : Task
        One whose target is a centre line.
    length : length of the body, mm.
    first, last : results of the two designs in this task.
    names : of the two designs.
    """
    target = target_of(task.objective, length)
    assert target is not None
    lines = {name: achieved_centre_line(result, length) for name, result in (("start", first), ("final", last))}
    lines["target"] = CentreLine(target.line, target.sections)
    limits = _limits(lines)
    span = np.ptp(limits, axis=1)
    x, y, z = span * (COLUMN - 2 * GAP - 2 * EDGE) / (span[1] + span[2])
    left, legend = GAP, 3 * LINE + 2 * EDGE
    bottom = legend + GAP
    height = bottom + y + GAP + x + SPACE + 2 * EDGE + LINE
    figure = Figure(figsize=(COLUMN, height), facecolor="white")

    def place(at: tuple[float, float], size: tuple[float, float], **options: Any) -> Any:
        return figure.add_axes((at[0] / COLUMN, at[1] / height, size[0] / COLUMN, size[1] / height), **options)

    space = place((0.1, bottom + y + GAP + x + EDGE), (COLUMN - 0.4, SPACE), projection="3d")
    _in_space(space, lines, limits)
    # Arranged like the three views of a technical drawing, to one scale.
    for axes, across, up in (
        (place((left, bottom + y + GAP), (z, x)), 2, 0),
        (place((left + z + GAP, bottom + y + GAP), (y, x)), 1, 0),
        (place((left, bottom), (z, y)), 2, 1),
    ):
        _projected(axes, lines, limits, across, up)
    words = {"target": "target"}
    for name, called, result in (("start", names[0], first), ("final", names[1], last)):
        motion = task.objective.achieved(result)
        words[name] = f"{called}, {motion.word} {motion.beside_target}"
    handles = [Line2D([], [], marker="o", label=words[name], **STYLES[name]) for name in words]
    figure.legend(handles=handles, fontsize=SMALL, frameon=False, loc="lower center", labelspacing=0.3, borderpad=0.2)
    figure.suptitle(f"{task.name}: target and achieved", fontsize=TEXT, y=1 - EDGE / height, va="top")
    _zoomed(space, figure, limits)
    return figure


def _limits(lines: Mapping[str, CentreLine]) -> np.ndarray:
    """The range (3, 2) shown along x, y and z."""
    points = np.concatenate([line.points for line in lines.values()])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, wide = (low + high) / 2, 1.1 * (high - low)
    wide = np.maximum(wide, LEAST * wide.max())
    return np.column_stack([middle - wide / 2, middle + wide / 2])


def _in_space(axes: Axes3D, lines: Mapping[str, CentreLine], limits: np.ndarray) -> None:
    # First, because choosing the vertical axis rotates the box.
    axes.view_init(elev=22.0, azim=-60.0, vertical_axis="x")
    axes.set(xlim=limits[0], ylim=limits[1], zlim=limits[2])
    _draw(axes, lines, [0, 1, 2])
    for axis, name, wide in zip((axes.xaxis, axes.yaxis, axes.zaxis), AXES, np.ptp(limits, axis=1), strict=True):
        axis.set_label_text(f"{name} / mm", fontsize=SMALL)
        axis.labelpad = {"x": -4.0, "y": -7.0, "z": 0.0}[name]
        axis.set_major_locator(MaxNLocator(max(2, round(5 * wide / np.ptp(limits, axis=1).max()))))
    axes.tick_params(labelsize=SMALL, pad=-3.0)


def _zoomed(axes: Axes3D, figure: Figure, limits: np.ndarray) -> None:
    """Make the picture in space as large as it may be without its labels leaving its height: other axes hide them."""
    room, zoom, share = axes.get_position(original=True).transformed(figure.transFigure), LARGEST, 1.0
    for _ in range(MOST_ZOOMS):
        zoom *= share
        axes.set_box_aspect(np.ptp(limits, axis=1), zoom=zoom)  # pyright: ignore[reportArgumentType]
        # Labels are placed when they are drawn.
        figure.draw_without_rendering()
        taken, middle = axes.get_tightbbox(), (room.y0 + room.y1) / 2
        assert taken is not None
        share = (room.height / 2) / max(taken.y1 - middle, middle - taken.y0)
        if share >= 1.0:
            return


def _projected(axes: Axes, lines: Mapping[str, CentreLine], limits: np.ndarray, across: int, up: int) -> None:
    _draw(axes, lines, [across, up])
    axes.set(xlim=limits[across], ylim=limits[up])
    axes.set_xlabel(f"{AXES[across]} / mm", fontsize=SMALL, labelpad=1)
    axes.set_ylabel(f"{AXES[up]} / mm", fontsize=SMALL, labelpad=0)
    # As many ticks as there is space for.
    span = np.ptp(limits, axis=1)
    axes.xaxis.set_major_locator(MaxNLocator(max(2, round(6 * span[across] / span.max()))))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, round(6 * span[up] / span.max()))))
    axes.grid(color="#e6e6e6", linewidth=0.5)
    plain(axes)


def _draw(axes: Axes, lines: Mapping[str, CentreLine], components: list[int]) -> None:
    """Draw all centre lines with markers at their sections, the last one in front."""
    for order, (name, line) in enumerate(lines.items()):
        style = STYLES[name]
        plain = {key: value for key, value in style.items() if key not in ("markersize", "fillstyle")}
        marks = {key: value for key, value in style.items() if key not in ("linewidth", "linestyle")}
        axes.plot(*line.points.T[components], zorder=3 + order, **plain)
        axes.plot(*line.sections.T[components], "o", zorder=3 + order, markeredgewidth=0.7, **marks)
