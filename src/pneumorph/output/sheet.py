"""Sheet of shapes: the final designs of several runs side by side, at rest and inflated, all to one scale."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pneumorph.output import render
from pneumorph.output.bodies import INCHES_PER_MM, MARGIN
from pneumorph.output.format import motion_of
from pneumorph.output.pictures import MOST, final_shapes, view_of
from pneumorph.output.view import Job
from pneumorph.run import RunDirectory

MOST_PER_ROW = 4
SCALE = 0.45
"""Size of the pictures, relative to those of single runs."""


@dataclass(frozen=True)
class Tile:
    """A finished run with its name and its caption."""

    name: str
    caption: str
    run: RunDirectory


def draw_sheet(path: Path, title: str, tiles: list[Tile]) -> None:
    """Save the sheet.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    shapes = [list(final_shapes(tile.run).values()) for tile in tiles]
    view = view_of(tiles[0].run.problem)
    everything = [shape for own in shapes for shape in own]
    extent = view.extent(everything) + MARGIN * np.array([-1.0, 1.0, -1.0, 1.0])
    highest = max(float(np.quantile(shape.field, MOST)) for shape in everything if shape.field is not None)
    pictures = iter(render.images(Job(everything, view, extent, (1.0, highest))))
    left, right, bottom, top = extent
    panels = max(len(own) for own in shapes)
    columns = _columns(len(tiles))
    rows = -(-len(tiles) // columns)
    wide = SCALE * INCHES_PER_MM * (right - left) * panels + 0.2
    high = SCALE * INCHES_PER_MM * (top - bottom) + 0.75
    figure = Figure(figsize=(columns * wide, rows * high + 0.4), facecolor="white")
    width, height = figure.get_size_inches()
    for number, (tile, own) in enumerate(zip(tiles, shapes, strict=True)):
        row, column = divmod(number, columns)
        base = height - 0.4 - (row + 1) * high
        for place, _ in enumerate(own):
            each = (wide - 0.2) / panels
            axes = figure.add_axes(
                ((column * wide + 0.1 + place * each) / width, base / height, each / width, (high - 0.75) / height)
            )
            axes.imshow(next(pictures), extent=(left, right, bottom, top), interpolation="lanczos")
            axes.set_axis_off()
        last = tile.run.history()[-1]
        motions = ", ".join(str(motion_of(task, last.tasks[task.name])) for task in tile.run.problem.task)
        figure.text(
            (column * wide + wide / 2) / width, (base + high - 0.1) / height,
            f"{tile.caption}\n{motions}, {last.iteration} designs", ha="center", va="top", fontsize=7, color="#333333",
        )  # fmt: skip
    figure.suptitle(title, fontsize=11, fontweight="bold", y=1.0 - 0.1 / height, va="top")
    figure.savefig(path, dpi=160)


def _columns(count: int) -> int:
    """The number of columns that leaves the fewest places empty; of several the largest."""
    if count <= MOST_PER_ROW:
        return count
    return min(range(MOST_PER_ROW, 2, -1), key=lambda columns: -count % columns)
