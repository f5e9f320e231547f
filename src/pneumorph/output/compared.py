"""Measured curves beside predicted ones: their picture, and their table."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from pneumorph.output.figures import COLOURS, COLUMN, MARKERS, SMALL, TEXT, Figure, plain
from pneumorph.validation.comparison import Comparison

HEAD = ("body", "rubber", "compared", "points", "RMSE", "of largest", "measured ±", "predicted ±", "agree")
"""Titles of the table."""


def compared_figure(comparisons: Sequence[Comparison]) -> Figure:
    """The curves of one body with one rubber: measured points, and the prediction as a line with a band.

    Bars and bands are two standard deviations; points by which the rubber was found are hollow.
    """
    first = comparisons[0]
    figure = Figure(figsize=(COLUMN + 1.0, 2.9), layout="constrained", facecolor="white")
    axes = figure.subplots()
    for number, one in enumerate(comparisons):
        colour, case = COLOURS[number % len(COLOURS)], f" {one.case}" if one.case else ""
        axes.fill_between(
            one.at, one.predicted - 2 * one.error, one.predicted + 2 * one.error, color=colour, alpha=0.18, linewidth=0
        )
        axes.plot(one.at, one.predicted, color=colour, linewidth=1.2, label=f"predicted{case}")
        for points, fill, word in ((~one.fitted, colour, "measured"), (one.fitted, "white", "fitted")):
            if points.any():
                axes.errorbar(
                    one.at[points],
                    one.measured[points],
                    2 * one.scatter[points],
                    fmt=MARKERS[number % len(MARKERS)],
                    color=colour,
                    markerfacecolor=fill,
                    markersize=3.5,
                    elinewidth=0.8,
                    capsize=1.5,
                    label=f"{word}{case}",
                )
    axes.set_xlabel(first.along, fontsize=SMALL)
    axes.set_ylabel(f"{first.quantity}, {first.unit}", fontsize=SMALL)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.set_title(f"{first.body}, {first.rubber}", fontsize=TEXT)
    axes.legend(fontsize=SMALL, frameon=False)
    plain(axes)
    return figure


def grouped(comparisons: Sequence[Comparison]) -> dict[str, list[Comparison]]:
    """The curves with points that belong in one picture, by a name for its file."""
    groups: dict[str, list[Comparison]] = {}
    for one in comparisons:
        if len(one.at):
            groups.setdefault(re.sub(r"\W+", "_", f"{one.body} {one.rubber}".lower()).strip("_"), []).append(one)
    return groups


def row(one: Comparison) -> list[str]:
    """The cells of a line of the table, under `HEAD`."""
    compared = f"{one.quantity} {one.case}".strip()
    if one.rms is None:
        return [one.body, one.rubber, compared, "0", "–", "–", "–", "–", f"no state: {one.missing}"]
    free = ~one.fitted
    share = "–" if one.normalised is None else f"{100 * one.normalised:.1f} %"
    counted = f"{free.sum()}" + (f" of {len(one.at)}, others fitted" if one.fitted.any() else "")
    ended = f", then no state: {one.missing}" if one.missing else ""
    return [
        one.body,
        one.rubber,
        compared,
        counted,
        f"{one.rms:.3g} {one.unit}",
        share,
        f"{one.scatter[free].mean():.2g} {one.unit}" if one.scatter[free].any() else "–",
        f"{one.error[free].mean():.2g} {one.unit}",
        f"{one.within} of {free.sum()}{ended}",
    ]


def markdown(comparisons: Sequence[Comparison]) -> str:
    """The table in Markdown."""
    lines = [f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row(one))} |" for one in comparisons), ""])


def points(one: Comparison) -> Iterator[str]:
    """The points of a curve as text: measured beside predicted, in columns."""
    yield f"  {one.along:<24}{'measured ± ' + one.unit:>20}{'predicted ± ' + one.unit:>20}"
    for at, seen, scatter, there, error, fitted in zip(
        one.at, one.measured, one.scatter, one.predicted, one.error, one.fitted, strict=True
    ):
        pair = (_with_deviation(seen, scatter), _with_deviation(there, error))
        yield f"  {at:<24.5g}{pair[0]:>20}{pair[1]:>20}{'  fitted' if fitted else ''}"


def _with_deviation(value: float, deviation: float) -> str:
    """A value and its standard deviation; the value alone where none is known, which is 0."""
    return f"{value:.4g} ± {deviation:.2g}" if deviation else f"{value:.4g}"


def csv_lines(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """All points as lines of a table with titles."""
    yield "body,rubber,compared,along,at,unit,measured,measured_sd,predicted,predicted_sd,fitted"
    for one in comparisons:
        words = ",".join(
            f'"{each}"' for each in (one.body, one.rubber, f"{one.quantity} {one.case}".strip(), one.along)
        )
        for values in zip(one.at, one.measured, one.scatter, one.predicted, one.error, one.fitted, strict=True):
            at, *rest, fitted = values
            numbers = ",".join(f"{value:.9g}" for value in np.array(rest))
            yield f"{words},{at:.9g},{one.unit},{numbers},{int(fitted)}"
