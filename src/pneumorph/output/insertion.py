"""A picture of where a further chamber would help: two cuts through the rubber, coloured by what a small one does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Circle

from pneumorph.output.figures import INK, PAGE, SMALL, TEXT, Figure, plain
from pneumorph.output.thickening import STOPS

SHOWN = 0.98
"""Share of the elements within the range of colours: next to corners and to the plate the field has no bound."""

Sphere = tuple[tuple[float, float, float], float]
"""Centre and radius, mm."""


def insertion_figure(title: str, corners: np.ndarray, gain: np.ndarray, spheres: Sequence[Sphere]) -> Figure:
    """Cuts along the axis and across it through the first of the spheres, which are drawn as circles.

    Parameters
    ----------
    title : of the picture.
    corners : (E, 4, 3) mm
        Of the tetrahedra of the whole body at rest.
    gain : (E,)
        By how much the objective falls per mm³ of a void in each.
    spheres : the best places, at least one.
    """
    place = np.array(spheres[0][0])
    away = float(np.hypot(*place[:2]))
    along = np.array([1.0, 0.0, 0.0]) if away < 1e-6 else np.array([*place[:2], 0.0]) / away
    axis, across = np.array([0.0, 0.0, 1.0]), np.array([-along[1], along[0], 0.0])
    most = float(np.quantile(np.abs(gain), SHOWN)) or 1.0
    colours = LinearSegmentedColormap.from_list("gain", STOPS)
    figure = Figure(figsize=(PAGE, 0.5 * PAGE), layout="constrained", facecolor="white")
    left, right = figure.subplots(1, 2)
    turn = np.degrees(np.arctan2(along[1], along[0])) + 0.0
    cuts = (
        (left, axis, along, np.zeros(3), "z (mm)", f"from the axis at {turn:.0f}° (mm)"),
        (right, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), place * axis, "x (mm)", "y (mm)"),
    )
    drawn = None
    for axes, one, other, origin, below, beside in cuts:
        normal = across if axes is left else axis
        polygons, owners = cut(corners, normal, origin)
        drawn = PolyCollection(
            [np.column_stack([each @ one, each @ other]) for each in polygons],
            array=gain[owners], cmap=colours, clim=(-most, most), linewidths=0.1, edgecolors="face",
        )  # fmt: skip
        axes.add_collection(drawn)
        for center, radius in spheres:
            inside = radius**2 - float(np.dot(np.array(center) - origin, normal)) ** 2
            if inside > 0.0:
                at = float(np.dot(center, one)), float(np.dot(center, other))
                axes.add_patch(Circle(at, float(np.sqrt(inside)), fill=False, color=INK, linewidth=1.0))
        axes.set_xlabel(below, fontsize=TEXT)
        axes.set_ylabel(beside, fontsize=TEXT)
        axes.set_aspect("equal")
        axes.autoscale_view()
        plain(axes)
    assert drawn is not None, "there are two cuts"
    bar = figure.colorbar(drawn, ax=[left, right], shrink=0.8, extend="both")
    bar.set_label("fall of the objective per mm³ of a small chamber", fontsize=TEXT)
    bar.ax.tick_params(labelsize=SMALL)
    figure.suptitle(title, fontsize=TEXT)
    return figure


def cut(corners: np.ndarray, normal: np.ndarray, origin: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Where a plane cuts tetrahedra (E, 4, 3): polygons (3 or 4, 3), and the tetrahedron of each."""
    height = (corners - origin) @ normal
    # A corner in the plane counts as above it, so that every cut one has corners on both sides.
    above = height >= 0.0
    owners = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    polygons = []
    for each in owners:
        up, down = np.flatnonzero(above[each]), np.flatnonzero(~above[each])
        # Around a quadrilateral neighbours share a corner.
        pairs = [(i, j) for i in up for j in down] if 1 in (len(up), len(down)) else [
            (up[0], down[0]), (up[0], down[1]), (up[1], down[1]), (up[1], down[0]),
        ]  # fmt: skip
        share = [height[each, i] / (height[each, i] - height[each, j]) for i, j in pairs]
        points = [
            corners[each, i] + s * (corners[each, j] - corners[each, i]) for (i, j), s in zip(pairs, share, strict=True)
        ]
        polygons.append(np.array(points))
    return polygons, owners
