"""Picture of the walls in profile: radius of exterior and chambers along z, of the start and the final design."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.output.figures import COLOURS, COLUMN, SMALL, TEXT, Figure, plain

HEIGHTS = 400
"""Heights at which radii are evaluated: more than a printed line shows."""
WIDE, TALL = 2.9, 2.2
"""Inches: largest width and height of a panel."""


def radius_along_z(tube: TubeSurface, density: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Heights z (n,) in mm, and the least, mean and largest radius (3, n) over q, about the tube's centre line.

    All lines of constant q are evaluated at the same heights; where a wall overhangs, the largest radius counts. There
    is a mean where all of them reach, or it would jump where one ends.
    """
    q = np.linspace(0.0, 1.0, density * tube.net.shape[1], endpoint=False)
    r = np.linspace(0.0, 1.0, density * tube.net.shape[0])
    points = tube.sample(q, r)
    centre = points.mean(axis=1, keepdims=True)
    radius = np.hypot(*np.moveaxis(points - centre, -1, 0)[:2])
    heights = np.linspace(points[..., 2].min(), points[..., 2].max(), HEIGHTS)
    at_heights = _outermost(heights, points[..., 2], radius)
    bounded = np.ma.masked_invalid(at_heights)
    bands = np.ma.stack([bounded.min(axis=0), np.ma.masked_invalid(at_heights.mean(axis=0)), bounded.max(axis=0)])
    return heights, bands.filled(np.nan)


def _outermost(heights: np.ndarray, z: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """The largest radius (m, H) at which each of m polygons (z, radius), (n, m), crosses rising heights (H,).

    NaN where a polygon does not cross the height.
    """
    outermost = np.full((z.shape[1], len(heights)), -np.inf)
    every = np.arange(z.shape[1])
    for z0, z1, radius0, radius1 in zip(z[:-1], z[1:], radius[:-1], radius[1:], strict=True):
        # Pieces are short, so that each crosses few heights: the first, the second, …, of every polygon at once.
        first = np.searchsorted(heights, np.minimum(z0, z1))
        end = np.searchsorted(heights, np.maximum(z0, z1), side="right")
        slope = (radius1 - radius0) / np.where(z1 == z0, 1.0, z1 - z0)
        for number in range(int((end - first).max(initial=0))):
            chosen = every[first + number < end]
            at = first[chosen] + number
            value = radius0[chosen] + slope[chosen] * (heights[at] - z0[chosen])
            outermost[chosen, at] = np.maximum(outermost[chosen, at], value)
    return np.where(np.isfinite(outermost), outermost, np.nan)


def profile_figure(start: Body, final: Body, envelope: float | None, words: tuple[str, str]) -> Figure:
    """A figure of the profiles of two bodies, one column wide.

    Parameters
    ----------
    start, final : Body
        Both bodies.
    envelope : float or None
        The envelope's radius, mm.
    words : (2,) of str
        Their titles.
    """
    length = max(np.ptp(body.exterior.net[..., 2]) for body in (start, final))
    radius = 1.08 * max(envelope or 0.0, *(radius_along_z(body.exterior)[1][2].max() for body in (start, final)))
    high = min(TALL, WIDE * radius / length)
    handles = _handles(final, envelope)
    columns = 3
    figure = Figure(figsize=(COLUMN, 2 * high + 0.9 + 0.14 * -(-len(handles) // columns)), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, body, title in ((upper, start, words[0]), (lower, final, words[1])):
        _bodies(axes, body)
        if envelope is not None:
            axes.axhline(envelope, color="#777777", linewidth=0.8, linestyle=":")
        axes.set_title(title, fontsize=TEXT, loc="left", pad=3)
        axes.set_aspect("equal", adjustable="box")
        plain(axes)
    # One label for both panels, which may be lower than it is long.
    figure.supylabel("radius / mm", fontsize=TEXT)
    lower.set_ylim(0.0, radius)
    lower.set_xlabel("z / mm (base at 0)", fontsize=TEXT)
    figure.legend(
        handles=handles, fontsize=SMALL, frameon=False, loc="outside lower center", ncols=columns, columnspacing=1.0,
        handlelength=1.6, labelspacing=0.3,
    )  # fmt: skip
    return figure


def _handles(body: Body, envelope: float | None) -> list[Line2D | Patch]:
    """A line for every surface, one for what the bands are, and one for the envelope."""
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=_word(tube))
        for k, tube in enumerate(body.surfaces)
    ]
    handles.append(Patch(color="#777777", alpha=0.3, linewidth=0, label="least to largest"))
    if envelope is not None:
        handles.append(Line2D([], [], color="#777777", linewidth=0.8, linestyle=":", label="envelope"))
    return handles


def _word(tube: TubeSurface) -> str:
    return f"chamber {tube.name}" if tube.cavity else "exterior"


def _bodies(axes: Axes, body: Body) -> None:
    """Draw least to largest radius as a band, and the mean as a line."""
    count = len(body.surfaces)
    for number, tube in enumerate(body.surfaces):
        colour = COLOURS[number % len(COLOURS)]
        heights, (least, mean, largest) = radius_along_z(tube)
        axes.fill_between(heights, least, largest, color=colour, alpha=0.25, linewidth=0)
        # Those of earlier chambers are wider, so that chambers of equal radius are all seen.
        axes.plot(heights, mean, color=colour, linewidth=1.2 + 0.5 * (count - 1 - number if tube.cavity else 0))
