"""The map of the wall thickness: unrolled, and on the body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from pneumorph.make.mould.plan import Plan


def draw_walls(plan: Plan, path: Path) -> None:
    """Draw the distance of every point of the exterior from the nearest chamber.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    exterior = plan.samples[0]
    rows, columns = exterior.x.shape[:2]
    thickness = plan.thickness.reshape(rows, columns)
    around, along = np.linspace(0.0, 360.0, columns + 1), np.linspace(0.0, plan.length, rows)
    # Above the largest thickness beside the chambers everything looks the same: the ends are thick.
    span = Normalize(float(thickness.min()), float(np.quantile(thickness, 0.98)))

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    flat = figure.add_subplot(1, 2, 1)
    closed = np.concatenate([thickness, thickness[:, :1]], axis=1)
    drawn = flat.pcolormesh(around, along, closed, norm=span, cmap="viridis", shading="gouraud")
    flat.set(xlabel="position around the body, ° (360 q)", ylabel="position along the body, mm (length × r)")
    flat.set_xticks(range(0, 361, 90))
    flat.set_title(f"unrolled; least {thickness.min():.2f} mm", fontsize=10)
    figure.colorbar(drawn, ax=flat, label="wall thickness, mm")
    solid = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    x, y, z = np.moveaxis(np.concatenate([exterior.x, exterior.x[:, :1]], axis=1), -1, 0)
    solid.plot_surface(  # pyright: ignore[reportAttributeAccessIssue]
        x, y, z, facecolors=colormaps["viridis"](span(closed)), rcount=110, ccount=64, shade=False
    )
    solid.set_box_aspect([float(np.ptp(each)) for each in (x, y, z)])  # pyright: ignore[reportArgumentType]
    solid.set_axis_off()
    # Meridians at 0° and 270°, which are on the sides that are seen, a little outside the body.
    for quarter in (0, 3):
        line = exterior.x[:, quarter * columns // 4] * [1.02, 1.02, 1.0]
        solid.plot(*line.T, color="white", linewidth=2.5, zorder=9)
        solid.plot(*line.T, color="black", linewidth=0.9, zorder=10)
        # Above the far side of the rim too, since the body is seen from above.
        above = 0.02 * plan.length + 0.6 * float(np.linalg.norm(line[:, :2], axis=1).max())
        x, y, z = line[np.argmax(line[:, 2])] + [0.0, 0.0, above]
        solid.text(x, y, z, f"{90 * quarter}°", fontsize=9, ha="center", va="bottom", zorder=11)
    x, y = exterior.x[:, 0, :2].mean(axis=0)
    turn = float(np.degrees(np.arctan2(y, x)))
    solid.view_init(elev=20.0, azim=turn - 45.0)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=160)
