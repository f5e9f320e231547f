"""Pictures of a design cut open: at rest and inflated side by side, coloured by the largest principal stretch."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from pneumorph.output import render
from pneumorph.output.view import Job, Shape, View, colour_map

MARGIN = 4.0
"""Around the bodies, mm."""

INCHES_PER_MM = 0.085
BAR = 10.0
"""Length of the scale bar, mm."""

LETTER = 0.08
"""Average width of a letter in the titles above the bodies, inches."""


def bodies_figure(
    shapes: dict[str, Shape], view: View, extent: np.ndarray, stretch: tuple[float, float], title: str
) -> Figure:
    """A figure of bodies side by side, to scale, to be saved with 160 dots per inch.

    Parameters
    ----------
    shapes : the bodies by their titles.
    view : how they are seen.
    extent : (4,) left, right, bottom, top of every panel in mm, see `View.extent`.
    stretch : least and largest stretch of the colours.
    title : of the figure.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    extent = extent + MARGIN * np.array([-1.0, 1.0, -1.0, 1.0])
    pictures = render.images(Job(list(shapes.values()), view, extent, stretch))
    left, right, bottom, top = extent
    wide, high = INCHES_PER_MM * (right - left), INCHES_PER_MM * (top - bottom)
    titles = [textwrap.fill(words, int(wide / LETTER)) for words in shapes]
    lines = max(words.count("\n") for words in titles) + 1
    side, above, below = 1.1, 0.38 + 0.17 * lines, 0.35
    size = (len(shapes) * wide + side, high + above + below)
    figure = Figure(figsize=size, facecolor="white")
    for place, (words, picture) in enumerate(zip(titles, pictures, strict=True)):
        axes = figure.add_axes((place * wide / size[0], below / size[1], wide / size[0], high / size[1]))
        axes.imshow(picture, extent=(left, right, bottom, top), interpolation="lanczos")
        axes.set_axis_off()
        axes.set_title(words, fontsize=10, color="#333333", pad=3)
        if place == 0:
            start = left + MARGIN
            axes.plot([start, start + BAR], [bottom, bottom], color="#333333", linewidth=2, clip_on=False)
            axes.text(start + BAR / 2, bottom - 0.8, f"{BAR:g} mm", ha="center", va="top", fontsize=8, color="#333333")
    figure.suptitle(
        title, fontsize=12, fontweight="bold", x=0.5 * (1.0 - side / size[0]), y=1.0 - 0.08 / size[1], va="top"
    )
    if any(shape.field is not None for shape in shapes.values()):
        colours = ScalarMappable(Normalize(*stretch), colour_map())
        tall = min(0.6 * high, 3.5)
        bar = figure.add_axes(
            ((size[0] - side + 0.15) / size[0], (below + (high - tall) / 2) / size[1], 0.16 / size[0], tall / size[1])
        )
        scale = figure.colorbar(colours, cax=bar, extend="max")
        scale.set_label("largest principal stretch", fontsize=9, color="#333333")
        scale.ax.tick_params(labelsize=8, colors="#333333")
    return figure
