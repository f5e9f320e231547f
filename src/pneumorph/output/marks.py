"""What is marked on pictures of bodies: clamp, axes, gravity, loads, target, and the outline of the body at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import withStroke
from scipy.spatial import ConvexHull

from pneumorph.mesh.tets import area_vectors
from pneumorph.objective.kinds import target_of
from pneumorph.objective.kinds.kind import Target
from pneumorph.output.figures import INK, SMALL
from pneumorph.output.view import Shape, Shell, View
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting
from pneumorph.results import TaskResult

LOAD = "#7b2d8b"
"""Colour of forces and moments."""

ARROW = 0.22
"""Length of an arrow, as a fraction of the body's."""

CLAMP = 0.03
"""Thickness of the clamp below the base, as a fraction of the body's length."""

MARK = 5.0
"""Half the size of the mark at a target, in points."""

HALO = (withStroke(linewidth=2.2, foreground="white"),)
NOTHING = np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Arrow:
    """A force, or a moment with two heads, of a length and direction (3,) in mm at a point (3,), with its value."""

    at: np.ndarray
    vector: np.ndarray
    word: str
    heads: int = 1

    @property
    def ends(self) -> np.ndarray:
        """Tail and head (2, 3): one that points down ends in its point, so that it is not hidden by the body."""
        return np.array([self.at - self.vector, self.at] if self.vector[2] < 0 else [self.at, self.at + self.vector])


@dataclass(frozen=True, eq=False)
class Marks:
    """Marks on one picture.

    Attributes
    ----------
    arrows : loads at the tip.
    target : (n, 3) mm, centre line that is the target.
    wanted, reached : (S, 3) mm, sections of the target, and of the body.
    place : (1, 3) mm, where the tip should be; (0, 3) without.
    looks : (2, 3) mm, an arrow in the direction that the plate should face; (0, 3) without.
    outlined : whether the outline of the body at rest is drawn.
    """

    arrows: Sequence[Arrow] = ()
    target: np.ndarray = field(default_factory=lambda: NOTHING)
    wanted: np.ndarray = field(default_factory=lambda: NOTHING)
    reached: np.ndarray = field(default_factory=lambda: NOTHING)
    place: np.ndarray = field(default_factory=lambda: NOTHING)
    looks: np.ndarray = field(default_factory=lambda: NOTHING)
    outlined: bool = False

    @property
    def points(self) -> np.ndarray:
        """All points (n, 3) that a picture has to hold."""
        arrows = [arrow.ends for arrow in self.arrows]
        return np.concatenate([*arrows, self.target, self.wanted, self.place, self.looks])


def loads_at(problem: Problem, task: Task, tip: np.ndarray) -> list[Arrow]:
    """Force and moment on the plate in a task, the centre of which is at `tip` (3,)."""
    loads, length = acting(problem, task), ARROW * problem.body.length
    arrows = []
    for given, unit, heads in ((loads.force, "N", 1), (loads.moment, "N·mm", 2)):
        size = float(np.linalg.norm(given))
        if size:
            arrows.append(Arrow(tip, length / size * np.array(given), f"{size:.3g} {unit}", heads))
    return arrows


def task_marks(problem: Problem, task: Task, result: TaskResult) -> Marks:
    """Loads and target of a task, on the body that it moves."""
    length = problem.body.length
    tip = problem.body.ends[1] + result.translation
    motion = np.array([*result.translation, *result.rotation])
    target = target_of(task.objective, length, motion) or Target()
    reached = np.reshape(result.section_positions, (-1, 3)) if len(target.line) else NOTHING
    looks, place = NOTHING, target.place
    if target.axis is not None:
        at = tip if place is None else place
        looks = np.array([at, at + ARROW * length * target.axis])
    return Marks(
        loads_at(problem, task, tip),
        target.line,
        target.sections,
        reached,
        place=NOTHING if place is None else place[None],
        looks=looks,
        outlined=True,
    )


def clamp_of(shape: Shape | Shell) -> np.ndarray:
    """Corners (n, 3) of the ground to which the base is clamped."""
    points = shape.rest
    low, high = points[:, 2].min(), points[:, 2].max()
    base, outwards = points[points[:, 2] < low + 1e-6 * (high - low)], np.array([0.0, 0.0, -1.0])
    if isinstance(shape, Shape) and "base" in shape.mesh.faces:
        faces = shape.mesh.faces["base"]
        base, normal = points[np.unique(faces)], area_vectors(points, faces)[1].sum(axis=(0, 1))
        outwards = normal / np.linalg.norm(normal)
    along = np.linalg.svd(outwards[None])[2][1:]
    disc = base[ConvexHull(base @ along.T).vertices]
    middle = disc.mean(axis=0)
    disc = middle + 1.08 * (disc - middle)
    return np.concatenate([disc, disc + CLAMP * float(np.ptp(points, axis=0).max()) * outwards])


def draw_clamp(axes: Axes, view: View, shape: Shape | Shell) -> None:
    """Draw the ground behind the body; from above it would be hidden."""
    if view.along:
        return
    flat = view.flat(clamp_of(shape))
    corners = flat[ConvexHull(flat).vertices]
    axes.add_patch(Polygon(corners, **_CLAMP, zorder=0))


def draw_outline(axes: Axes, view: View, pieces: np.ndarray) -> None:
    """Draw the outline (n, 2, 3) of the body at rest in front of the moved one."""
    axes.add_collection(LineCollection(list(view.flat(pieces)), colors=INK, linewidths=0.5, alpha=0.7, zorder=3))


def draw_marks(axes: Axes, view: View, marks: Marks) -> None:
    """Draw loads and target in front of the body."""
    if len(marks.target):
        axes.plot(*view.flat(marks.target).T, **_TARGET, path_effects=HALO, zorder=4)
        axes.plot(*view.flat(marks.wanted).T, **_WANTED, zorder=5)
    if len(marks.reached):
        axes.plot(*view.flat(marks.reached).T, **_REACHED, zorder=5)
    if len(marks.place):
        axes.plot(*view.flat(marks.place).T, **_PLACE, path_effects=HALO, zorder=5)
    if len(marks.looks):
        _arrow(axes, view.flat(marks.looks), "black", (0, (4, 2)))
    pointed = view.flat(np.concatenate([marks.place, marks.wanted, marks.reached]))
    for arrow in marks.arrows:
        _load(axes, view, arrow, pointed)


def _load(axes: Axes, view: View, arrow: Arrow, others: np.ndarray) -> None:
    """Draw a load, whose word keeps clear of the marks at other points (n, 2)."""
    flat = view.flat(arrow.ends)
    shift = flat[1] - flat[0]
    if np.linalg.norm(shift) < 0.25 * np.linalg.norm(arrow.vector):
        # Seen along itself: a dot for a head, a cross for a tail.
        near = float(arrow.vector @ view.axes()[2]) > 0
        inner = {"marker": "o", "markersize": 2.5} if near else {"marker": "x", "markersize": 4.5}
        axes.plot(*flat[:1].T, "o", color=LOAD, markersize=8, fillstyle="none", path_effects=HALO, zorder=6)
        axes.plot(*flat[:1].T, color=LOAD, linestyle="", zorder=6, **inner)
        _word(axes, arrow.word, flat[0], (6, 4), others)
        return
    for part in (1.0, 0.78)[: arrow.heads]:
        _arrow(axes, np.array([flat[0], flat[0] + part * shift]), LOAD)
    free = flat[0] if arrow.vector[2] < 0 else flat[1]
    _word(axes, arrow.word, free, (4, 2), others)


def _word(axes: Axes, text: str, at: np.ndarray, offset: tuple[float, float], others: np.ndarray) -> None:
    """Write a word beside a point (2,), on the first of its four sides that is clear of other points (n, 2).

    The axes have their limits already: sizes are compared in points.
    """
    points = (axes.transData.transform(others) - axes.transData.transform(at)) * 72.0 / axes.figure.dpi
    size = np.array([0.6 * SMALL * len(text), SMALL])
    for side in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        corner = np.array(side) * offset
        low, high = np.minimum(corner, corner + side * size) - MARK, np.maximum(corner, corner + side * size) + MARK
        if not np.any(np.all((low < points) & (points < high), axis=1)):
            break
    else:
        side, corner = (1, 1), np.array(offset)
    axes.annotate(
        text, (at[0], at[1]), tuple(corner), textcoords="offset points", color=LOAD, fontsize=SMALL,
        path_effects=HALO, zorder=7,
        ha="left" if side[0] > 0 else "right", va="bottom" if side[1] > 0 else "top",
    )  # fmt: skip


def _arrow(axes: Axes, ends: np.ndarray, colour: str, dashes: Any = "-") -> None:
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "linestyle": dashes, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", ends[1], ends[0], arrowprops=look | {"mutation_scale": 8, "path_effects": HALO}, zorder=6)


def axes_width(gravity: np.ndarray | None) -> float:
    """Inches that the directions of x, y and z take, with that of gravity beside them where it acts."""
    return 0.5 if gravity is None else 0.95


def draw_axes(axes: Axes, view: View, gravity: np.ndarray | None) -> None:
    """Draw the directions of x, y and z, and of gravity beside them, on axes in inches; see `axes_width`."""
    length, origin = 0.2, np.array([0.16, 0.17])
    for name, direction in zip("xyz", view.flat(length * np.eye(3)), strict=True):
        _direction(axes, origin, direction, name, INK)
    if gravity is not None:
        _direction(axes, origin + np.array([0.5, 0.08]), view.flat(0.85 * length * gravity), "g", LOAD)


def _direction(axes: Axes, origin: np.ndarray, flat: np.ndarray, name: str, colour: str) -> None:
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
    size = float(np.linalg.norm(flat))
    if size > 0.03:
        axes.annotate("", tuple(origin + flat), tuple(origin), arrowprops=look)
        at = origin + flat * (1.0 + 0.065 / size)
    else:
        # Towards the reader or away.
        axes.plot(*origin, "o", color=colour, markersize=3, fillstyle="none")
        at = origin - [0.08, 0.06]
    axes.text(at[0], at[1], name, ha="center", va="center", fontsize=SMALL, color=colour)


def legend_handles(views: Sequence[View], marks: Sequence[Marks]) -> list[Line2D | Patch]:
    """A line for every kind of mark that some picture has."""
    handles: list[Line2D | Patch] = []
    if not all(view.along for view in views):
        handles.append(Patch(label="clamped base", **_CLAMP))
    if any(each.outlined and view.offset is not None for view, each in zip(views, marks, strict=True)):
        handles.append(Line2D([], [], color=INK, linewidth=0.6, label="exterior at rest"))
    if any(len(each.target) for each in marks):
        handles.append(Line2D([], [], **_WANTED | _TARGET, label="target"))
    if any(len(each.reached) for each in marks):
        handles.append(Line2D([], [], **_REACHED, label="sections of the body"))
    if any(len(each.place) for each in marks):
        handles.append(Line2D([], [], **_PLACE, label="target of the tip"))
    if any(len(each.looks) for each in marks):
        handles.append(
            Line2D([], [], color="black", linewidth=1.2, linestyle=(0, (4, 2)), label="target of its direction")
        )
    if any(arrow.heads == 1 for each in marks for arrow in each.arrows):
        handles.append(Line2D([], [], color=LOAD, linewidth=1.2, label="force on the tip"))
    if any(arrow.heads == 2 for each in marks for arrow in each.arrows):
        handles.append(Line2D([], [], color=LOAD, linewidth=1.2, label="moment on the tip"))
    return handles


_CLAMP: dict[str, Any] = {"facecolor": "#e2e2e2", "edgecolor": "#8a8a8a", "hatch": "//////", "linewidth": 0.5}
_TARGET: dict[str, Any] = {"color": "black", "linewidth": 1.0, "linestyle": (0, (4, 2))}
_WANTED: dict[str, Any] = {
    "marker": "o", "linestyle": "", "markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": "black",
    "markeredgewidth": 0.8,
}  # fmt: skip
_REACHED: dict[str, Any] = {
    "marker": "D", "linestyle": "", "markersize": 2.6, "markerfacecolor": "#0072b2", "markeredgecolor": "white",
    "markeredgewidth": 0.4,
}  # fmt: skip
_PLACE: dict[str, Any] = {
    "marker": "+", "linestyle": "", "markersize": 9, "markeredgecolor": "black", "markeredgewidth": 1.5,
}  # fmt: skip
