"""Sheet of shapes: the final designs of several runs side by side, at rest and inflated, all to one scale."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pneumorph.output import render
from pneumorph.output.bodies import (
    LETTER,
    SIDE,
    draw_colours,
    draw_legend,
    draw_scene,
    draw_strip,
    job_of,
    lay_out,
    legend_height,
    line_height,
    strip_height,
)
from pneumorph.output.figures import INK, PAGE, SMALL, TEXT, Figure, save
from pneumorph.output.format import format_pressures
from pneumorph.output.pictures import final_scenes
from pneumorph.output.scenes import Scene, highest_stretch
from pneumorph.run import RunDirectory

MOST_PER_ROW = 4
"""Tiles in a row of a page."""
TALLEST, NARROWEST, GAP = 2.6, 1.45, 0.12
"""Inches: largest height of a panel, smallest width of a tile, and space between tiles."""


@dataclass(frozen=True)
class Tile:
    """A finished run with its name and its caption."""

    name: str
    caption: str
    run: RunDirectory


def draw_sheet(path: Path, title: str, tiles: Sequence[Tile]) -> None:
    """Save the sheet.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    scenes = [final_scenes(tile.run) for tile in tiles]
    captions = [_caption(tile, own) for tile, own in zip(tiles, scenes, strict=True)]
    save(sheet_figure(title, captions, scenes), path)


def sheet_figure(title: str, captions: Sequence[str], scenes: Sequence[Sequence[Scene]]) -> Figure:
    """A page of tiles, each with a caption and the scenes of one design; raises NoPicture as `draw_sheet` does."""
    everything = [scene for own in scenes for scene in own]
    stretch = 1.0, highest_stretch(scene.shape for scene in everything)
    panels = max(len(own) for own in scenes)
    columns = _columns(len(scenes), panels)
    least = min(NARROWEST, (PAGE - SIDE) / columns - GAP) / panels
    layout = lay_out(everything, PAGE - SIDE - columns * GAP, TALLEST, columns * panels, least)
    pictures = render.images(job_of(everything, layout, stretch))
    wide, high = layout.size
    words = ["\n".join(textwrap.fill(line, int(panels * wide / (LETTER * SMALL))) for line in caption.splitlines())
             for caption in captions]  # fmt: skip
    above = 0.08 + line_height(SMALL) * max(each.count("\n") + 1 for each in words)
    width = columns * (panels * wide + GAP) + SIDE
    head, foot = line_height(TEXT) + 0.1, legend_height(everything, width)
    rows = -(-len(scenes) // columns)
    strip = strip_height(everything[0], wide)
    height = head + rows * (above + high + strip) + foot
    figure = Figure(figsize=(width, height), facecolor="white")
    for column, row, number, scene in _places(scenes, columns):
        tile, place = divmod(column, panels)
        left = tile * (panels * wide + GAP) + place * wide + GAP / 2
        bottom = height - head - row * (above + high + strip) - above - high
        axes = figure.add_axes((left / width, bottom / height, wide / width, high / height))
        draw_scene(axes, scene, pictures[number], layout.extents[number])
        if place == 0:
            at = (left + panels * wide / 2) / width, (bottom + high + above - 0.04) / height
            figure.text(*at, words[row * columns + tile], ha="center", va="top", fontsize=SMALL, color=INK)
        draw_strip(
            figure.add_axes((left / width, (bottom - strip) / height, wide / width, strip / height)),
            scene, (wide, strip), layout.scale if number == 0 else None,
        )  # fmt: skip
    long = min(0.8 * (height - head - foot), 2.4)
    at = (width - SIDE + 0.08) / width, (height - head + foot - long) / 2 / height
    draw_colours(figure.add_axes((*at, 0.1 / width, long / height)), stretch)
    draw_legend(figure, everything)
    figure.suptitle(title, fontsize=TEXT, fontweight="bold", y=1.0 - 0.05 / height, va="top")
    return figure


def _places(scenes: Sequence[Sequence[Scene]], columns: int) -> Iterator[tuple[int, int, int, Scene]]:
    """Column (of panels), row, number and scene of every panel."""
    panels, number = max(len(own) for own in scenes), 0
    for tile, own in enumerate(scenes):
        for place, scene in enumerate(own):
            yield tile % columns * panels + place, tile // columns, number, scene
            number += 1


def _caption(tile: Tile, scenes: Sequence[Scene]) -> str:
    """The caption of a tile, with its results, pressures if all tasks have the same, and cuts."""
    last = tile.run.history()[-1]
    tasks = tile.run.problem.task
    motions = ", ".join(str(task.objective.achieved(last.tasks[task.name])) for task in tasks)
    pressures = {format_pressures(last.tasks[task.name].pressures) for task in tasks}
    at = f" at {pressures.pop()}" if len(pressures) == 1 else ""
    cuts = ", ".join(dict.fromkeys(str(scene.view) for scene in scenes))
    return f"{tile.caption}\n{motions}{at}, {last.iteration} designs\n{cuts}"


def _columns(count: int, panels: int) -> int:
    """The number of columns that leaves the fewest places empty; of several the largest."""
    most = max(1, min(MOST_PER_ROW, int((PAGE - SIDE) / NARROWEST), 8 // panels))
    if count <= most:
        return count
    return min(range(most, max(most - 2, 0), -1), key=lambda columns: -count % columns)
