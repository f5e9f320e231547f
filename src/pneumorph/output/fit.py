"""Picture of tension tests and the rubber models fitted to them, in all three modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.mechanics.material.fit import TensionTest
from pneumorph.mechanics.material.judge import Fit, band
from pneumorph.output.figures import COLOURS, INK, PAGE, SMALL, TEXT, Figure, plain

TITLES = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "planar": "planar (pure shear)"}


def fits_figure(tests: Sequence[TensionTest], fits: Sequence[Fit], title: str) -> Figure:
    """Nominal stress over stretch in each mode.

    The band covers the models that are as good as the first, within two standard deviations; models that are not
    acceptable are dashed.
    """
    figure = Figure(figsize=(PAGE, 2.6 + 0.07 * len(fits)), layout="constrained", facecolor="white")
    for axes, mode in zip(figure.subplots(1, 3), TITLES, strict=True):
        stretch = fits[0].curves[mode].stretch
        axes.fill_between(stretch, *band(fits, mode), color=COLOURS[0], alpha=0.18, linewidth=0, label="undecided")
        for number, one in enumerate(fits):
            axes.plot(
                stretch,
                one.curves[mode].stress,
                "-" if one.is_acceptable else "--",
                color=COLOURS[number % len(COLOURS)],
                # Models that coincide are all seen.
                linewidth=0.8 + 0.25 * (len(fits) - 1 - number),
                label=f"{one.form.label}, R² {one.r2:.4f}" + ("" if one.is_acceptable else ", not acceptable"),
            )
        measured = [test for test in tests if test.mode == mode]
        for test in measured:
            axes.plot(test.stretch, test.stress, "o", color=INK, markersize=2.5, label="test", zorder=5)
        # A model without bounds would squeeze the others onto the axis.
        top = max([float(np.max(band(fits, mode)[1])), *(float(test.stress.max()) for test in measured)])
        axes.set_ylim(0.0, 1.15 * top)
        axes.set_title(TITLES[mode] + ("" if measured else ", not measured"), fontsize=TEXT)
        axes.set_xlabel("stretch", fontsize=TEXT)
        plain(axes)
    figure.axes[0].set_ylabel("nominal stress / MPa", fontsize=TEXT)
    figure.suptitle(title, fontsize=TEXT)
    handles = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False,
        labelspacing=0.3,
    )  # fmt: skip
    return figure
