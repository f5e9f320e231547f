"""Picture of a tension test and the rubber models fitted to it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pneumorph.mechanics.material.fit import Fit, TensionTest


def draw_fits(path: Path, test: TensionTest, fits: Sequence[Fit], title: str) -> None:
    """Save a picture of nominal stress over stretch; models that are not stable are dashed."""
    figure = Figure(figsize=(7.5, 5.0), layout="constrained", facecolor="white")
    axes = figure.subplots()
    stretch = np.linspace(min(1.0, test.stretch.min()), test.stretch.max(), 200)
    for one in fits:
        axes.plot(
            stretch,
            one.stress(stretch),
            "-" if one.is_stable else "--",
            linewidth=1.5,
            label=f"{one.form.label}, R² {one.r2:.4f}" + ("" if one.is_stable else ", not stable"),
        )
    axes.plot(test.stretch, test.stress, "o", color="#333333", markersize=4, label="test", zorder=0)
    axes.set_xlabel("stretch")
    axes.set_ylabel("nominal stress / MPa")
    axes.set_title(title, fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=150)
