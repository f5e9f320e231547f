"""Picture of the walls in profile: radius of exterior and chambers along z, of the start and the final design."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumorph.geometry import Body, TubeSurface

EXTERIOR = "#3b6ea5"
CHAMBERS = ("#c0653c", "#5b8c5a", "#8a5a9e", "#b09030")
HEIGHTS = 400


def radius_along_z(tube: TubeSurface, density: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Heights z (n,) in mm, and the least, mean and largest radius (3, n) over q, about the tube's centre line.

    All lines of constant q are evaluated at the same heights; where a wall overhangs, the largest radius counts.
    """
    q = np.linspace(0.0, 1.0, density * tube.net.shape[1], endpoint=False)
    r = np.linspace(0.0, 1.0, density * tube.net.shape[0])
    points = tube.sample(q, r)
    centre = points.mean(axis=1, keepdims=True)
    radius = np.hypot(*np.moveaxis(points - centre, -1, 0)[:2])
    heights = np.linspace(points[..., 2].min(), points[..., 2].max(), HEIGHTS)
    at_heights = np.array([_outermost(heights, points[:, k, 2], radius[:, k]) for k in range(len(q))])
    bounded = np.ma.masked_invalid(at_heights)
    found = np.ma.stack([bounded.min(axis=0), bounded.mean(axis=0), bounded.max(axis=0)])
    return heights, found.filled(np.nan)


def _outermost(heights: np.ndarray, z: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """The largest radius at which a polygon (z, radius) crosses each height; NaN where it does not."""
    low, high = np.minimum(z[:-1], z[1:]), np.maximum(z[:-1], z[1:])
    crossed = (heights[:, None] >= low) & (heights[:, None] <= high)
    part = (heights[:, None] - z[:-1]) / np.where(z[1:] == z[:-1], 1.0, z[1:] - z[:-1])
    values = np.where(crossed, radius[:-1] + part * (radius[1:] - radius[:-1]), -np.inf)
    outermost = values.max(axis=1)
    return np.where(np.isfinite(outermost), outermost, np.nan)


def draw_profile(path: Path, start: Body, final: Body, envelope: float | None) -> None:
    """Save the profiles of the starting and the final body."""
    figure = Figure(figsize=(10.0, 4.3), layout="constrained", facecolor="white")
    upper, lower = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, body, words in ((upper, start, "start"), (lower, final, "final")):
        _bodies(axes, body)
        if envelope is not None:
            axes.axhline(envelope, color="#888888", linewidth=0.8, linestyle=":", label="envelope")
        axes.set_title(words, fontsize=10, loc="left")
        axes.set_ylabel("radius / mm", fontsize=9)
        axes.set_aspect("equal", adjustable="box")
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    # Both panels share it, so it is set when both are drawn.
    lower.set_ylim(0.0, 1.05 * lower.get_ylim()[1])
    lower.set_xlabel("z / mm (base at 0)", fontsize=9)
    handles, labels = lower.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, frameon=False, loc="outside lower center", ncols=len(labels))
    figure.savefig(path, dpi=150)


def _bodies(axes: Axes, body: Body) -> None:
    colours = [EXTERIOR, *(CHAMBERS[k % len(CHAMBERS)] for k in range(len(body.chambers)))]
    for tube, colour in zip(body.surfaces, colours, strict=True):
        word = "exterior" if not tube.cavity else f"chamber {tube.name}"
        heights, (least, mean, largest) = radius_along_z(tube)
        axes.fill_between(
            heights, least, largest, color=colour, alpha=0.25, linewidth=0, label=f"{word}, least to largest"
        )
        axes.plot(heights, mean, color=colour, linewidth=1.5, label=f"{word}, mean")
