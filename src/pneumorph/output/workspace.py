"""Where the tip of a body can go: its places from in front, from the side and from above, and how finely it moves and
how stiff it is there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.patches import Ellipse

from pneumorph.output.figures import INK, PAGE, SMALL, TEXT, Figure, plain, save
from pneumorph.surrogate.workspace import Workspace

VIEWS = ((0, 2), (1, 2), (0, 1))
"""Axes to the right and upwards, of every picture."""

AXES = ("x", "y", "z")

ELLIPSES = 12
"""How many compliances are drawn as ellipses, at places far from each other."""

SIZE = 0.12
"""Length of the largest ellipse, over the extent of the places."""


def workspace_figure(found: Workspace) -> Figure:
    """Places of the tip relative to where it is without motion, mm, coloured by dexterity and by least stiffness.

    An ellipse is where small forces of one size in all directions move the tip to, so the tip is soft along its longer
    axis; all are drawn to one scale, which the title says.
    """
    places = found.motions[:, :3]
    maps = (("least motion (mm/kPa)", 1e-3 * found.finest), ("least stiffness (N/mm)", found.stiffness[:, 0]))
    figure = Figure(figsize=(PAGE, 0.8 * PAGE), layout="constrained")
    panels = figure.subplots(len(maps), len(VIEWS))
    chosen = apart(places, ELLIPSES)
    extent = max(float(np.ptp(places, axis=0).max()), 1e-3)
    longest = float(np.sqrt(np.max([np.linalg.eigvalsh(found.soft[k] @ found.soft[k])[-1] for k in chosen])))
    force = SIZE * extent / (2.0 * longest)
    for number, (words, values) in enumerate(maps):
        colours = None
        for axes, (right, up) in zip(panels[number], VIEWS, strict=True):
            colours = axes.scatter(places[:, right], places[:, up], c=values, s=1.5, linewidths=0, rasterized=True)
            for k in chosen if number else ():
                axes.add_patch(_ellipse(places[k], found.soft[k], (right, up), force))
            axes.plot(0, 0, "+", color=INK, markersize=6)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_xlabel(f"{AXES[right]} (mm)", fontsize=SMALL)
            axes.set_ylabel(f"{AXES[up]} (mm)", fontsize=SMALL)
            plain(axes)
        assert colours is not None
        bar = figure.colorbar(colours, ax=list(panels[number]), shrink=0.8)
        bar.set_label(words, fontsize=SMALL)
        bar.ax.tick_params(labelsize=SMALL)
    figure.suptitle(f"motion of the tip, + at rest; ellipses: what {force:.2g} N move it by", fontsize=TEXT)
    return figure


def draw_workspace(found: Workspace, path: Path) -> None:
    """Save the figure, as PDF or SVG by the suffix, otherwise as PNG."""
    save(workspace_figure(found), path)


def apart(points: np.ndarray, count: int) -> list[int]:
    """Numbers of points (n, 3) far from each other: each the farthest from those before it."""
    chosen = [int(np.argmin(np.linalg.norm(points, axis=1)))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def _ellipse(centre: np.ndarray, soft: np.ndarray, view: tuple[int, int], force: float) -> Ellipse:
    """The shadow of the ellipsoid {C f : |f| = force}, which is that of the matrix C Cᵀ."""
    values, axes = np.linalg.eigh((soft @ soft.T)[np.ix_(view, view)])
    width, height = 2.0 * force * np.sqrt(np.maximum(values[::-1], 0.0))
    angle = float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1])))
    return Ellipse(tuple(centre[list(view)]), width, height, angle=angle, fill=False, color=INK, linewidth=0.7)
