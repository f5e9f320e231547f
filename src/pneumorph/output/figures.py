"""What all pictures share: their widths, colours and fonts, and how they are saved for screens and for papers."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure as PlainFigure

from pneumorph.atomic import write_bytes
from pneumorph.interrupts import stop_if_asked

COLUMN = 3.5
"""Inches: the width of a column in a journal of two columns."""

PAGE = 7.16
"""Inches: both columns and the space between them."""

DOTS = 300
"""Per inch, where a picture is made of dots."""

TEXT, SMALL = 8.0, 7.0
"""Points: font sizes of titles and labels, and of ticks and legends."""

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Of lines, in their order. Okabe and Ito chose them so that they differ with every kind of colour vision."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
"""Of lines, so that they differ without colours too."""

INK = "#333333"

SETTINGS: Any = {"pdf.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "pneumorph"}
"""TrueType fonts in PDF, outlines of letters in SVG: both look the same where the font is not installed."""

PLOTS = ("png", "pdf", "svg")
"""Formats of pictures that do not move."""


class Figure(PlainFigure):
    """A matplotlib figure that notebooks show as it is, without pyplot."""

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, dpi=DOTS / 2, format="png")
        return stream.getvalue()


def save(figure: PlainFigure, path: Path) -> None:
    """Save a figure as PDF or SVG by the suffix, otherwise as PNG; the same figure gives the same file."""
    format = path.suffix.removeprefix(".").lower()
    # Without the date.
    metadata = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(format)
    stop_if_asked()
    content = BytesIO()
    with rc_context(SETTINGS):
        figure.savefig(content, dpi=DOTS, format=format if format in PLOTS else "png", metadata=metadata)
    write_bytes(path, content.getvalue())


def plain(axes: Axes) -> None:
    """The look of every diagram: no frame at the top and on the right, small ticks."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=SMALL, length=2.5, pad=2.0)


def line_style(number: int, count: int) -> dict[str, Any]:
    """Style of one of several lines: earlier ones are wider, so that lines that coincide are all seen.

    Where there are more lines than colours, colours come again with other markers, hollow ones on broken lines.
    """
    again, first = divmod(number, len(COLOURS))
    colour = COLOURS[first]
    return {
        "color": colour,
        "linewidth": 1.0 + 0.3 * min(count - 1 - number, 6),
        "linestyle": ("-", (0, (4, 1.5)), (0, (1, 1)))[min(again, 2)],
        "marker": MARKERS[(first + 3 * again) % len(MARKERS)],
        "markersize": 4.2,
        "markerfacecolor": "white" if again else colour,
        "markeredgewidth": 0.9 if again else 0.4,
        "markeredgecolor": colour if again else "white",
        "zorder": 2.0 + number / 100,
    }


def every(number: int, count: int, designs: int) -> tuple[int, int]:
    """At which designs one of several lines has markers: lines that coincide have theirs at different ones."""
    step = max(count, -(-designs // 24))
    return number * step // count, step
