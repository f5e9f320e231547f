"""Pictures of an actuator along pressure sweeps: motion, force and torque where it is held, volumes and stretch."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from pneumorph.analysis import Curve
from pneumorph.analysis.pressures import FILLED, HELD, TIME
from pneumorph.mechanics import COMPONENTS
from pneumorph.output.figures import COLOURS, COLUMN, PAGE, SMALL, TEXT, Figure, plain
from pneumorph.output.sweeps import AXES, reactions, touched
from pneumorph.problem.components import MOTION_OF, is_turn
from pneumorph.problem.objectives.words import MOTION_WORDS
from pneumorph.results import SweepStep

DASHES = ("-", "--", ":", "-.")
SHOWN = 0.02
"""Components below this fraction of the largest in the same diagram are not drawn: a slightly unsymmetric mesh causes
them."""


@dataclass(frozen=True)
class Diagram:
    """One diagram: title, unit, lines by name, and the value below which the whole diagram is left out."""

    title: str
    unit: str
    lines: dict[str, Callable[[SweepStep], float]]
    least: float = 0.0


def curves_figure(curves: Sequence[Curve], title: str = "") -> Figure:
    """A figure of all sweeps that have an equilibrium."""
    curves = [curve for curve in curves if curve.found]
    diagrams = [diagram for diagram in _diagrams(curves) if _peak(diagram, curves) > diagram.least]
    columns = len(diagrams) if len(diagrams) < 4 else -(-len(diagrams) // 2)
    rows = -(-len(diagrams) // columns)
    figure = Figure(figsize=((COLUMN, 0.5 * (COLUMN + PAGE), PAGE)[columns - 1], 2.3 * rows + 0.3), facecolor="white")
    figure.set_layout_engine("constrained", h_pad=0.05, w_pad=0.05)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, diagram in zip(grid, diagrams, strict=False):
        _draw(axes, diagram, curves)
        axes.set_xlabel(_pressure(curves), fontsize=SMALL)
    for axes in grid[len(diagrams) :]:
        axes.set_axis_off()
    _name_curves(figure, curves)
    if title:
        figure.suptitle(textwrap.fill(title, 55 if columns == 1 else 110), fontsize=TEXT)
    return figure


def _diagrams(curves: Sequence[Curve]) -> list[Diagram]:
    def part(of: Callable[[SweepStep], Any], index: Any, factor: float = 1.0) -> Callable[[SweepStep], float]:
        return lambda step: factor * of(step)[index]

    def reaction_lines(names: Sequence[str]) -> dict[str, Callable[[SweepStep], float]]:
        """Reactions by axis: "shift_x" is along x, "bending_x" about x."""
        return {
            axis: part(lambda step: step.reaction, name)
            for axis, name in zip(AXES, names, strict=True)
            if name in blocked
        }

    blocked = reactions(curves)
    motion = {axis: part(lambda step: step.translation, number) for number, axis in enumerate(AXES)}
    turning = {axis: part(lambda step: step.rotation, number, 180.0 / np.pi) for number, axis in enumerate(AXES)}
    on_obstacles = {
        f"{name}, along {axis}": part(lambda step, name=name: step.contact[name], number)
        for name in touched(curves)
        for number, axis in enumerate(AXES)
    }
    volumes = {name: part(lambda step: step.volumes, name) for name in curves[0].found[0].volumes}
    filled = {name.removeprefix(FILLED) for curve in curves for name in curve.swept if name.startswith(FILLED)}
    found = volumes if any(curve.swept == (TIME,) for curve in curves) else filled
    unknown = {name: part(lambda step: step.pressures, name, 1e3) for name in volumes if name in found}
    return [
        Diagram("translation of the tip", "mm", _named("along", motion), 0.01),
        Diagram("rotation of the tip", "degrees", _named("about", turning), 0.1),
        Diagram("blocked force of the tip", "N", _named("along", reaction_lines(COMPONENTS[:3])), 1e-3),
        Diagram("blocked torque of the tip", "N·mm", _named("about", reaction_lines(COMPONENTS[3:])), 1e-2),
        Diagram("pressure of the chambers", "kPa", unknown),
        Diagram("volume of the chambers", "mm³", volumes),
        Diagram("force on obstacles", "N", on_obstacles, 1e-3),
        Diagram("largest stretch", "stretch (1)", {"": lambda step: step.max_stretch}),
    ]


def _named(preposition: str, lines: dict[str, Callable[[SweepStep], float]]) -> dict[str, Callable[[SweepStep], float]]:
    return {f"{preposition} {axis}": line for axis, line in lines.items()}


def _peak(diagram: Diagram, curves: Sequence[Curve], only: str | None = None) -> float:
    lines = [line for name, line in diagram.lines.items() if only in (None, name)]
    return max((abs(line(step)) for line in lines for curve in curves for step in curve.found), default=0.0)


def _draw(axes: Axes, diagram: Diagram, curves: Sequence[Curve]) -> None:
    """A line per curve and component: colours distinguish components if there is one curve, otherwise curves."""
    peak = _peak(diagram, curves)
    shown = [name for name in diagram.lines if _peak(diagram, curves, name) > SHOWN * peak]
    for number, curve in enumerate(curves):
        at = [_along(curve, step) for step in curve.found]
        # Earlier curves are wider, so that curves that coincide are all seen.
        width = 1.0 + 0.6 * (len(curves) - 1 - number)
        for place, name in enumerate(shown):
            values = [diagram.lines[name](step) for step in curve.found]
            colour, dashes = (
                (COLOURS[place % len(COLOURS)], "-")
                if len(curves) == 1
                else (COLOURS[number % len(COLOURS)], DASHES[place % 4])
            )
            axes.plot(at, values, dashes, color=colour, marker="o", markersize=2.5, linewidth=width)
    handles = [
        Line2D([], [], color="#444444" if len(curves) > 1 else COLOURS[place % len(COLOURS)], linewidth=1.0, label=name,
               linestyle=DASHES[place % 4] if len(curves) > 1 else "-")
        for place, name in enumerate(shown) if name
    ]  # fmt: skip
    if handles:
        axes.legend(handles=handles, fontsize=SMALL, frameon=False, labelspacing=0.3)
    axes.set_title(diagram.title, fontsize=TEXT)
    axes.set_ylabel(diagram.unit, fontsize=TEXT)
    plain(axes)
    axes.margins(y=0.08)
    for end in _ends(curves):
        axes.axvline(end.at, **end.style)
        axes.update_datalim([(end.last, axes.dataLim.y0)])
    axes.autoscale_view()


@dataclass(frozen=True)
class End:
    """Where a curve ends, the last step that was asked for, on the same axis, words, and how its line looks."""

    at: float
    last: float
    words: str
    style: dict[str, Any]


def _ends(curves: Sequence[Curve]) -> list[End]:
    """The ends of all curves that have not reached their last step."""
    ends = []
    for number, curve in enumerate(curves):
        beyond = [step for step in curve.steps if not step.converged]
        if not beyond:
            continue
        style = {"color": COLOURS[number % len(COLOURS)] if len(curves) > 1 else "#444444", "linewidth": 0.8}
        limit = beyond[0].limit.get(curve.swept[0])
        at = _along(curve, beyond[0]) if limit is None else 1e3 * limit
        words = "no equilibrium found from here on" if limit is None else f"no stable state beyond {at:.4g} kPa"
        ends.append(End(at, _along(curve, beyond[-1]), words, {**style, "linestyle": "--"}))
    return ends


def _along(curve: Curve, step: SweepStep) -> float:
    """What is swept first: time, s, pressure of a chamber, kPa, or what is filled into it, ml, motion of an obstacle or
    the plate, mm or degrees."""
    first = curve.swept[0]
    if first == TIME:
        return step.time or 0.0
    if first in step.pressures:
        return 1e3 * step.pressures[first]
    if first.startswith(FILLED):
        return 1e-3 * step.filled[first.removeprefix(FILLED)]
    if first.startswith(HELD):
        value = step.holds.get(first.removeprefix(HELD), 0.0)
        return np.degrees(value) if is_turn(first.removeprefix(HELD)) else value
    name, motion = first.rsplit(".", 1)
    given = step.turns if motion.startswith("turn_") else step.moves
    part = given.get(name, (0.0, 0.0, 0.0))[AXES.index(motion[-1])]
    return np.degrees(part) if given is step.turns else part


def _pressure(curves: Sequence[Curve]) -> str:
    """The label of the axis of what is swept."""
    swept = {curve.swept for curve in curves}
    if swept == {(TIME,)}:
        return "time, s"
    moved = {curve.swept[0] for curve in curves if curve.swept[0] not in curve.steps[0].pressures}
    if moved:
        if len(moved) > 1 or len({curve.swept[0] for curve in curves}) > 1:
            return "pressure, kPa, displacement, mm, or turn, °"
        name = moved.pop()
        if name.startswith(FILLED):
            return f"volume filled into {name.removeprefix(FILLED)}, ml"
        if name.startswith(HELD):
            component = name.removeprefix(HELD)
            words = MOTION_WORDS[MOTION_OF.get(component, component)]
            return f"{words} of the tip, {'°' if is_turn(component) else 'mm'}"
        return f"turn {name}, °" if ".turn_" in name else f"displacement {name}, mm"
    if len(swept) > 1:
        return "pressure of the swept chamber, kPa"
    first, *others = next(iter(swept))
    alike = all(len({step.pressures[n] for n in (first, *others)}) == 1 for c in curves for step in c.steps)
    if alike:
        return f"pressure in {' and '.join([first, *others])}, kPa"
    return f"pressure in {first}, kPa ({', '.join(others)} swept with it)"


def _name_curves(figure: Figure, curves: Sequence[Curve]) -> None:
    """A legend below all diagrams: curves by task, swept chambers, or both, where there are several, and their ends."""
    tasks, swept = {curve.task for curve in curves}, {curve.swept for curve in curves}
    handles = []
    for number, curve in enumerate(curves if len(curves) > 1 else ()):
        words = [curve.task] if len(tasks) > 1 else []
        words += [f"{'+'.join(curve.swept)} swept"] if len(swept) > 1 else []
        handles.append(
            Line2D([], [], color=COLOURS[number % len(COLOURS)], marker="o", markersize=3, label=", ".join(words))
        )
    handles += [Line2D([], [], label=end.words, **end.style) for end in _ends(curves)]
    if not handles:
        return
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(max(round(figure.get_figwidth() / 1.7), 1), len(handles)),
        fontsize=SMALL,
        frameon=False,
    )
