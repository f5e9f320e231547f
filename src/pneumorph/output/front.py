"""Picture of a trade-off between two amounts: every design, and the front of those that nothing beats in both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.output.figures import COLOURS, COLUMN, INK, SMALL, TEXT, Figure, plain


@dataclass(frozen=True)
class Trade:
    """A design: its name, the two amounts that are shown, and the values that were minimised for them."""

    name: str
    amounts: tuple[float, float]
    minimised: tuple[float, float]


def undominated(values: np.ndarray) -> np.ndarray:
    """Which of k designs (k, 2), smaller being better, no other one equals or beats in both and beats in one."""
    no_worse = (values[None] <= values[:, None]).all(axis=2)
    better = (values[None] < values[:, None]).any(axis=2)
    return ~np.asarray(np.any(no_worse & better, axis=-1))


def front_figure(title: str, labels: Sequence[str], trades: Sequence[Trade]) -> Figure:
    """The designs as points with their names, and a line through those of the Pareto front.

    Parameters
    ----------
    title : of the picture.
    labels : (2,) of the axes, with units.
    trades : the designs.
    """
    figure = Figure(figsize=(COLUMN, 0.8 * COLUMN), layout="constrained", facecolor="white")
    axes = figure.subplots()
    points, best = np.array([each.amounts for each in trades]), undominated(np.array([t.minimised for t in trades]))
    front = points[best][np.argsort(points[best, 0], kind="stable")]
    axes.plot(*front.T, color=COLOURS[0], linewidth=1.0, zorder=1)
    for on_front, colour in ((True, COLOURS[0]), (False, COLOURS[1])):
        axes.plot(*points[best == on_front].T, "o" if on_front else "s", color=colour, markersize=4.2)
    for trade in trades:
        axes.annotate(
            trade.name, trade.amounts, xytext=(3, 3), textcoords="offset points", fontsize=SMALL - 1, color=INK
        )
    axes.set_xlabel(labels[0], fontsize=TEXT)
    axes.set_ylabel(labels[1], fontsize=TEXT)
    axes.set_title(title, fontsize=TEXT)
    axes.margins(0.12)
    plain(axes)
    return figure
