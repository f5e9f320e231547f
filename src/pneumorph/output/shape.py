"""Pictures of target and achieved shape: centre lines of the body with its sections, in space and projected."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from scipy.interpolate import make_interp_spline

from pneumorph.analysis import TaskResult
from pneumorph.mechanics import rotation
from pneumorph.objective.curve import section_targets
from pneumorph.objective.features import equidistant
from pneumorph.output.format import motion_of
from pneumorph.problem import MatchCurve, MatchSections, Task

FINE = 200
"""Points along every centre line."""

AXES = ("x", "y", "z")
STYLES: Mapping[str, Mapping[str, Any]] = {
    "start": {"color": "#9db0c0", "linewidth": 1.6, "markersize": 4.0},
    "final": {"color": "#c0653c", "linewidth": 1.9, "markersize": 4.0},
    "target": {"color": "#222222", "linewidth": 1.1, "linestyle": (0, (5, 2.5)), "markersize": 7, "fillstyle": "none"},
}
LEAST = 0.3
"""Least width of a projection, as a fraction of the widest."""

WIDE, SPACE, GAP, EDGE = 4.6, 4.4, 0.75, 0.25
"""Inches: longest side of the projections, side of the picture in space, space for labels, and margin."""


class CentreLine(NamedTuple):
    """A curve (n, 3) that starts at the centre of the base, and the centres of the sections (S, 3) on it, in mm."""

    points: np.ndarray
    sections: np.ndarray


def target_centre_line(asked: MatchCurve | MatchSections, length: float) -> CentreLine:
    """The target of a task as a centre line.

    Orientations alone do not determine one: it is drawn as straight pieces of length/n, each along the axis of its
    section and with the section in its middle.
    """
    if isinstance(asked, MatchCurve):
        points, fractions = np.array(asked.control_points), equidistant(asked.sections, length).middle / length
        line, _ = section_targets(points, asked.degree, np.linspace(0.0, 1.0, FINE))
        sections, _ = section_targets(points, asked.degree, fractions)
        return CentreLine(line, sections)
    axes = np.array([np.asarray(rotation(jnp.array(turn)))[:, 2] for turn in asked.rotations])
    joints = np.vstack([np.zeros(3), np.cumsum(axes * length / len(axes), axis=0)])
    return CentreLine(joints, (joints[:-1] + joints[1:]) / 2)


def achieved_centre_line(found: TaskResult, length: float) -> CentreLine:
    """The result of a task as a centre line: a smooth curve from the base through the sections to the tip."""
    sections = np.array(found.section_positions)
    heights = np.r_[0.0, equidistant(len(sections), length).middle, length]
    points = np.vstack([np.zeros(3), sections, np.array([0.0, 0.0, length]) + found.translation])
    return CentreLine(make_interp_spline(heights, points, k=3)(np.linspace(0.0, length, FINE)), sections)


def draw_shape(path: Path, task: Task, length: float, first: TaskResult, last: TaskResult) -> None:
    """Save a picture of the target of a task and of the shapes that the start and the final design take.

    Parameters
    ----------
    task : Task
        With the objective `match_curve` or `match_sections`.
    length : length of the body, mm.
    first, last : results of the first and the last design in this task.
    """
    assert isinstance(task.objective, MatchCurve | MatchSections)
    lines = {name: achieved_centre_line(found, length) for name, found in (("start", first), ("final", last))}
    lines["target"] = target_centre_line(task.objective, length)
    limits = _limits(lines)
    x, y, z = WIDE * np.ptp(limits, axis=1) / np.ptp(limits, axis=1).max()
    left, bottom = SPACE + GAP, 2 * EDGE + GAP / 2
    width, height = left + z + GAP + y + EDGE, bottom + y + GAP + x + 2 * EDGE
    figure = Figure(figsize=(width, height), facecolor="white")

    def place(at: tuple[float, float], size: tuple[float, float], **options: Any) -> Any:
        return figure.add_axes((at[0] / width, at[1] / height, size[0] / width, size[1] / height), **options)

    tall = height - bottom - EDGE
    _in_space(place((-EDGE, bottom - EDGE), (SPACE + EDGE / 2, tall + EDGE), projection="3d"), lines, limits)
    # Arranged like the three views of a technical drawing, to one scale.
    for axes, across, up in (
        (place((left, bottom + y + GAP), (z, x)), 2, 0),
        (place((left + z + GAP, bottom + y + GAP), (y, x)), 1, 0),
        (place((left, bottom), (z, y)), 2, 1),
    ):
        _projected(axes, lines, limits, across, up)
    words = {"target": "target"}
    for name, found in (("start", first), ("final", last)):
        motion = motion_of(task, found)
        words[name] = f"{name}, {motion.word} {motion}"
    handles = [Line2D([], [], marker="o", label=words[name], **STYLES[name]) for name in words]
    figure.legend(handles=handles, fontsize=9, frameon=False, loc="lower center", ncols=len(handles))
    figure.suptitle(f"{task.name}: target and achieved", fontsize=11, y=1 - 0.6 * EDGE / height, va="top")
    figure.savefig(path, dpi=150)


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
    axes.set_box_aspect(np.ptp(limits, axis=1))
    _draw(axes, lines, [0, 1, 2])
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), AXES, strict=True):
        axis.set_label_text(f"{name} / mm", fontsize=9)
        axis.set_major_locator(MaxNLocator(5))
    axes.tick_params(labelsize=8)


def _projected(axes: Axes, lines: Mapping[str, CentreLine], limits: np.ndarray, across: int, up: int) -> None:
    _draw(axes, lines, [across, up])
    axes.set(xlim=limits[across], ylim=limits[up])
    axes.set_xlabel(f"{AXES[across]} / mm", fontsize=9)
    axes.set_ylabel(f"{AXES[up]} / mm", fontsize=9)
    # As many ticks as there is space for: every 25 mm where 160 mm are 4.6 inches.
    span = np.ptp(limits, axis=1)
    axes.xaxis.set_major_locator(MaxNLocator(max(2, round(8 * span[across] / span.max()))))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, round(8 * span[up] / span.max()))))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def _draw(axes: Axes, lines: Mapping[str, CentreLine], components: list[int]) -> None:
    """Draw all centre lines with markers at their sections, the last one in front."""
    for order, (name, line) in enumerate(lines.items()):
        style = STYLES[name]
        plain = {key: value for key, value in style.items() if key not in ("markersize", "fillstyle")}
        marks = {key: value for key, value in style.items() if key not in ("linewidth", "linestyle")}
        axes.plot(*line.points.T[components], zorder=3 + order, **plain)
        axes.plot(*line.sections.T[components], "o", zorder=3 + order, markeredgewidth=1.0, **marks)
