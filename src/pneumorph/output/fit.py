"""Picture of a tension test and the rubber models fitted to it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pneumorph.mechanics.material.fit import Fit, TensionTest
from pneumorph.output.figures import COLOURS, COLUMN, INK, SMALL, TEXT, plain, save


def draw_fits(path: Path, test: TensionTest, fits: Sequence[Fit], title: str) -> None:
    """Save a picture of nominal stress over stretch; models that are not stable are dashed."""
    figure = Figure(figsize=(COLUMN, 2.4 + 0.14 * len(fits)), layout="constrained", facecolor="white")
    axes = figure.subplots()
    stretch = np.linspace(min(1.0, test.stretch.min()), test.stretch.max(), 200)
    for number, one in enumerate(fits):
        axes.plot(
            stretch,
            one.stress(stretch),
            "-" if one.is_stable else "--",
            color=COLOURS[number % len(COLOURS)],
            # Models that coincide are all seen.
            linewidth=1.0 + 0.4 * (len(fits) - 1 - number),
            label=f"{one.form.label}, R² {one.r2:.4f}" + ("" if one.is_stable else ", not stable"),
        )
    axes.plot(test.stretch, test.stress, "o", color=INK, markersize=2.5, label="test", zorder=0)
    axes.set_xlabel("stretch", fontsize=TEXT)
    axes.set_ylabel("nominal stress / MPa", fontsize=TEXT)
    axes.set_title(title, fontsize=TEXT)
    plain(axes)
    figure.legend(loc="outside lower center", fontsize=SMALL, frameon=False, labelspacing=0.3)
    save(figure, path)
