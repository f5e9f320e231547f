"""Pictures of bodies cut open, side by side and to one scale, mostly coloured by the largest principal stretch."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from pneumorph.output import render
from pneumorph.output.figures import DOTS, INK, PAGE, SMALL, TEXT, Figure
from pneumorph.output.marks import axes_width, draw_axes, draw_clamp, draw_marks, draw_outline, legend_handles
from pneumorph.output.reinforcements import covering_handles
from pneumorph.output.scenes import Scene
from pneumorph.output.view import STRETCH, Colours, Job, Panel

MARGIN = 0.03
"""Around the bodies, as a fraction of the larger side of the picture."""

LARGEST = 0.085
"""Inches per mm of small bodies; large ones are drawn smaller."""

TALLEST, NARROWEST = 4.2, 1.3
"""Inches: largest height and smallest width of a panel."""

PER_ROW = 5
"""Panels in a row at most."""
STRIP, SIDE = 0.42, 0.68
"""Inches: height of the strip with axes and scale below each panel, and width of the colour scale on the right."""

BAR_ROOM, BAR_LINE = 0.5, 0.26
"""Inches: width beside the axes below which the scale has a line of its own, and the height of that."""

LETTER = 0.0083
"""Width of a letter in inches, per point of its size."""

BOLD = 1.25 * LETTER * TEXT
"""Width of a letter of the figure's title in inches."""


@dataclass(frozen=True, eq=False)
class Layout:
    """How panels are laid out: panels in a row, extent of every panel in mm, and inches per mm."""

    columns: int
    extents: Sequence[np.ndarray]
    scale: float

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of a panel in inches."""
        left, right, bottom, top = self.extents[0]
        return self.scale * (right - left), self.scale * (top - bottom)


def lay_out(
    scenes: Sequence[Scene],
    wide: float,
    tall: float = TALLEST,
    columns: int | None = None,
    narrowest: float = NARROWEST,
) -> Layout:
    """Lay out panels of one size and scale, with the bases at one height.

    Parameters
    ----------
    scenes : sequence of Scene
    wide, tall : float
        Width of all panels in a row and largest height of one, inches.
    columns : int, optional
        Panels in a row; by default by their number.
    narrowest : float
        Least width of a panel, inches, where there is room.
    """
    own = np.array([scene.extent() for scene in scenes])
    columns = columns or _columns(len(scenes))
    width, bottom, top = (own[:, 1] - own[:, 0]).max(), own[:, 2].min(), own[:, 3].max()
    margin = MARGIN * max(width, top - bottom)
    width, bottom, top = width + 2 * margin, bottom - margin, top + margin
    scale = min(LARGEST, wide / columns / width, tall / (top - bottom))
    width = max(width, min(narrowest, wide / columns) / scale)
    middle = own[:, :2].mean(axis=1)
    return Layout(columns, [np.array([at - width / 2, at + width / 2, bottom, top]) for at in middle], scale)


def _columns(count: int) -> int:
    rows = -(-count // PER_ROW)
    return -(-count // rows)


@dataclass(frozen=True, eq=False)
class Row:
    """Scenes to be drawn side by side, with the least and largest value of their colours and a title."""

    scenes: Sequence[Scene]
    ends: tuple[float, float]
    title: str
    colours: Colours = STRETCH

    @cached_property
    def layout(self) -> Layout:
        """At most as wide as a page of a journal."""
        return lay_out(self.scenes, PAGE - SIDE)

    @property
    def job(self) -> Job:
        """What is to be drawn for it."""
        return job_of(self.scenes, self.layout, self.ends, colours=self.colours)

    def figure(self, pictures: Sequence[np.ndarray]) -> Figure:
        """The figure, with the pictures of its job."""
        return compose(self.scenes, self.layout, pictures, self.ends, self.title, colours=self.colours)


def bodies_figure(scenes: Sequence[Scene], stretch: tuple[float, float], title: str) -> Figure:
    """The figure of a `Row`.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    row = Row(scenes, stretch, title)
    return row.figure(render.images(row.job))


def job_of(
    scenes: Sequence[Scene],
    layout: Layout,
    ends: tuple[float, float],
    dots: float = DOTS,
    colours: Colours = STRETCH,
) -> Job:
    """The pictures of scenes, to be drawn.

    Parameters
    ----------
    scenes : sequence of Scene
    layout : Layout
        Of their panels.
    ends : (2,)
        Ends of the scale of colours.
    dots : float
        Per inch.
    colours : Colours
        The scale.
    """
    panels = [
        Panel(scene.shape, scene.view, extent, scene.obstacles, scene.coverings)
        for scene, extent in zip(scenes, layout.extents, strict=True)
    ]
    return Job(panels, ends, dots * layout.scale, colours)


def compose(
    scenes: Sequence[Scene],
    layout: Layout,
    pictures: Sequence[np.ndarray],
    ends: tuple[float, float],
    title: str,
    lines: int = 0,
    colours: Colours = STRETCH,
) -> Figure:
    """The figure of drawn pictures with titles, marks, scales and legend.

    Parameters
    ----------
    scenes : sequence of Scene
    layout : Layout
        Of their panels.
    pictures : sequence of arrays
        What was drawn of the `job_of` them.
    ends : (2,)
        Ends of the scale of colours.
    title : str
        Of the figure; it may be empty.
    lines : int
        For how many lines the titles of panels have space at least.
    colours : Colours
        The scale.
    """
    wide, high = layout.size
    coloured = any(getattr(scene.shape, "field", None) is not None for scene in scenes)
    total = layout.columns * wide + (SIDE if coloured else 0.1)
    rows = -(-len(scenes) // layout.columns)
    titles = [panel_title(scene, wide) for scene in scenes]
    above = 0.08 + line_height(SMALL) * max(lines, *(title_lines(scene, layout) for scene in scenes))
    heading = textwrap.fill(title, max(12, int(total / BOLD)))
    head = line_height(TEXT) * (heading.count("\n") + 1) + 0.06 if title else 0.0
    foot = legend_height(scenes, total)
    strip = strip_height(scenes[0], wide)
    row = above + high + strip
    figure = Figure(figsize=(total, head + rows * row + foot), facecolor="white")
    height = head + rows * row + foot
    for number, (scene, picture) in enumerate(zip(scenes, pictures, strict=True)):
        line, column = divmod(number, layout.columns)
        bottom = height - head - line * row - above - high
        axes = figure.add_axes((column * wide / total, bottom / height, wide / total, high / height))
        draw_scene(axes, scene, picture, layout.extents[number])
        axes.set_title(titles[number], fontsize=SMALL, color=INK, pad=3)
        draw_strip(
            figure.add_axes((column * wide / total, (bottom - strip) / height, wide / total, strip / height)),
            scene, (wide, strip), layout.scale if number == 0 else None,
        )  # fmt: skip
    if title:
        fits = BOLD * max(map(len, heading.splitlines())) < layout.columns * wide
        middle = 0.5 * layout.columns * wide / total if fits else 0.5
        figure.suptitle(heading, fontsize=TEXT, fontweight="bold", x=middle, y=1.0 - 0.05 / height, va="top")
    if coloured:
        long = min(0.7 * high, 2.4)
        at = (layout.columns * wide + 0.08, height - head - above - (high + long) / 2)
        draw_colours(figure.add_axes((at[0] / total, at[1] / height, 0.1 / total, long / height)), ends, colours)
    draw_legend(figure, scenes)
    return figure


def legend_height(scenes: Sequence[Scene], width: float) -> float:
    """Inches that the legend takes below a figure of this width."""
    return line_height(SMALL) * -(-len(_handles(scenes)) // _per_line(width)) + 0.12


def draw_legend(figure: Figure, scenes: Sequence[Scene]) -> None:
    """Explain at the bottom of a figure what is marked in its pictures."""
    figure.legend(
        handles=_handles(scenes), loc="lower center", ncols=_per_line(figure.get_figwidth()), fontsize=SMALL,
        frameon=False, borderpad=0.2, labelspacing=0.3, columnspacing=1.2,
    )  # fmt: skip


def _handles(scenes: Sequence[Scene]) -> list[Any]:
    marked = legend_handles([scene.view for scene in scenes], [scene.marks for scene in scenes])
    return [*marked, *covering_handles([each for scene in scenes for each in scene.coverings])]


def _per_line(width: float) -> int:
    return max(1, int(width / 1.65))


def line_height(points: float) -> float:
    """Inches from one line of letters to the next."""
    return 1.3 * points / 72.0


def panel_title(scene: Scene, wide: float) -> str:
    """The title of a panel of this width in inches, with its cut; numbers stay with their words and units."""
    letters = max(10, int(wide / (LETTER * SMALL)))
    words = re.sub(r" (?=[-−]?(?:\d|[xyz]\b))|(?<=\d) (?=mm|kPa|N\b)", "\u00a0", f"{scene.title}\n{scene.view}")
    return "\n".join(textwrap.fill(line, letters) for line in words.splitlines())


def title_lines(scene: Scene, layout: Layout) -> int:
    """How many lines the title of a panel takes."""
    return panel_title(scene, layout.size[0]).count("\n") + 1


def draw_scene(axes: Axes, scene: Scene, picture: np.ndarray, extent: np.ndarray) -> None:
    """Draw a picture with its marks.

    Parameters
    ----------
    axes : Axes
        In mm.
    scene : Scene
    picture : array
        What was drawn of it.
    extent : (4,) array
        Left, right, bottom and top, mm.
    """
    left, right, bottom, top = extent
    axes.set(xlim=(left, right), ylim=(bottom, top))
    draw_clamp(axes, scene.view, scene.shape)
    axes.imshow(picture, extent=(left, right, bottom, top), zorder=2)
    if scene.marks.outlined:
        # Loads VTK, of which there is no need before bodies are drawn.
        from pneumorph.output.section import outline

        draw_outline(axes, scene.view, outline(scene.shape, scene.view.normal, scene.view.offset))
    draw_marks(axes, scene.view, scene.marks)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()


def strip_height(scene: Scene, wide: float) -> float:
    """Inches of the strips below panels of a width, the first of which has the bar, on a line of its own where there is
    no room beside the axes."""
    return STRIP if wide - axes_width(scene.gravity) >= BAR_ROOM else STRIP + BAR_LINE


def draw_strip(axes: Axes, scene: Scene, size: tuple[float, float], scale: float | None) -> None:
    """Draw the directions of the axes and, where inches per mm are given, a bar with its length.

    The bar is beside the axes or, in a high strip, below them; see `strip_height`.

    Parameters
    ----------
    axes : Axes
        Below a panel, in inches.
    scene : Scene
    size : (2,)
        Width and height, inches.
    scale : float or None
        Inches per mm; None for no bar.
    """
    wide, below = size[0], size[1] - STRIP
    axes.set(xlim=(0.0, wide), ylim=(-below, STRIP))
    axes.set_axis_off()
    draw_axes(axes, scene.view, scene.gravity)
    if scale is not None:
        start = 0.06 if below else axes_width(scene.gravity)
        length = _round(0.8 * min(wide - start, 1.0) / scale)
        axes.plot([start, start + scale * length], [0.2 - below] * 2, color=INK, linewidth=1.5, solid_capstyle="butt")
        axes.text(start, 0.16 - below, f"{length:g} mm", ha="left", va="top", fontsize=SMALL, color=INK)


def _round(length: float) -> float:
    """The largest of 1, 2, 5, 10, … that is not longer."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(next(part * power for part in (5.0, 2.0, 1.0) if part * power <= length))


def draw_colours(axes: Axes, ends: tuple[float, float], colours: Colours = STRETCH) -> None:
    """Draw the scale of colours on the axes given."""
    beyond = "both" if ends[0] < 0.0 else "max"
    scale = axes.figure.colorbar(ScalarMappable(Normalize(*ends), colours.map()), cax=axes, extend=beyond)
    scale.set_label(colours.label, fontsize=SMALL, color=INK)
    scale.ax.tick_params(labelsize=SMALL, colors=INK, length=2.5, pad=2)
