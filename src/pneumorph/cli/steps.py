"""The steps of a simulation as rows of numbers, whose units are in the headings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from rich.text import Text

from pneumorph.mechanics import COMPONENTS
from pneumorph.output.certainty import of_step
from pneumorph.output.format import SELF_INTERSECTS, format_pressures
from pneumorph.problem import Task
from pneumorph.problem.components import is_turn
from pneumorph.results import SweepStep

LEAST = 1e-6
"""Forces in N, and a tenth of torques in N·mm, below which they are rounding."""

NOTHING = {"mm": 1e-3, "°": 1e-2}
"""Deviations of motions below which they are those of a body at rest."""

NARROWEST = 7
"""Characters of a column of numbers at least."""

AXES = ("x", "y", "z")


class Cell(NamedTuple):
    """A number with the heading of its column."""

    title: str
    text: str

    def __str__(self) -> str:
        return f"{self.text:>{self.width}}"

    @property
    def width(self) -> int:
        """Characters of the column."""
        return max(len(self.title), NARROWEST)


class Rows:
    """Writes steps one after another, with a row of headings before the first and wherever the columns change."""

    def __init__(self, tasks: Mapping[str, Task]):
        self._tasks = tasks
        self._first = max(len("task"), *map(len, tasks))
        self._titles: list[str] = []

    def lines(self, step: SweepStep) -> Iterator[Text]:
        """The lines of a step."""
        cells = given(step) + (found(step, self._tasks[step.task]) if step.converged else [])
        titles = [cell.title for cell in cells]
        if step.converged and titles != self._titles:
            self._titles = titles
            yield Text(self._line("task", (f"{cell.title:>{cell.width}}" for cell in cells)), style="bold")
        said = remarks(step) if step.converged else [step.reason]
        row = self._line(step.task, map(str, cells))
        style = "red" if not step.converged else "yellow" if is_doubtful(step) else ""
        yield Text("  ".join([row, ", ".join(said)]).rstrip(), style=style)
        # Only the last step of a sweep has the error of the mesh, and a line of its own.
        if step.fine_translation is not None and (told := of_step(step)):
            yield Text(f"{step.task}: {told}")

    def _line(self, first: str, others: Iterable[str]) -> str:
        return "  ".join([f"{first:<{self._first}}", *others])


def given(step: SweepStep) -> list[Cell]:
    """Time, pressures, what is filled in, and where obstacles and the plate are held."""
    return [
        *([] if step.time is None else [Cell("time s", f"{step.time:.4g}")]),
        *(Cell(f"{name} kPa", f"{1e3 * value:.4g}") for name, value in sorted(step.pressures.items())),
        *(Cell(f"{name} filled ml", f"{1e-3 * value:.4g}") for name, value in step.filled.items()),
        *(cell for name, by in step.moves.items() for cell in _vector(f"{name} moved ", by, 3, "mm")),
        *(cell for name, by in step.turns.items() for cell in _vector(f"{name} turned ", np.degrees(by), 2, "°")),
        *(
            Cell(f"{name} held {'°' if is_turn(name) else 'mm'}", f"{np.degrees(at) if is_turn(name) else at:.4g}")
            for name, at in step.holds.items()
        ),
    ]


def found(step: SweepStep, task: Task) -> list[Cell]:
    """Motion of the tip, distances from the target, forces, motions of free obstacles, and the largest stretch."""
    cells = [*_vector("", step.translation, 3, "mm"), *_vector("about ", np.degrees(step.rotation), 2, "°")]
    cells += [
        Cell(f"{error.word} {error.unit}", _fixed(error.value, 2)) for error in task.objective.errors(step.errors)
    ]
    for name, value in step.reaction.items():
        turns = name in COMPONENTS[3:]
        shown = 0.0 if abs(value) < (10 * LEAST if turns else LEAST) else value
        cells.append(Cell(f"{name} {'N·mm' if turns else 'N'}", f"{shown:.4g}"))
    for name, force in step.contact.items():
        cells += _vector(f"on {name} ", force, 4, "N")
        cells.append(Cell(f"on {name} mm²", f"{step.contact_area[name]:.3g}"))
    cells += [Cell(f"pull on {name} N", f"{force:.4g}") for name, force in step.pull.items()]
    for name, by in step.pose_translations.items():
        turned = np.degrees(step.pose_rotations[name])
        cells += [*_vector(f"{name} moved ", by, 3, "mm"), *_vector(f"{name} turned ", turned, 2, "°")]
    if step.self_contact >= LEAST:
        cells.append(Cell("self-contact N", f"{step.self_contact:.4g}"))
    return [*cells, Cell("stretch", f"{step.max_stretch:.3f}")]


def remarks(step: SweepStep) -> list[str]:
    """What is to be known of a state besides its numbers."""
    said = []
    if step.rubber_translation is not None and step.rubber_rotation is not None:
        place, turn = (float(np.linalg.norm(each)) for each in (step.rubber_translation, step.rubber_rotation))
        if place >= NOTHING["mm"] or np.degrees(turn) >= NOTHING["°"]:
            said.append(f"rubber ± {place:.2g} mm, {np.degrees(turn):.2g}°")
    said += ["beyond the range of the rubber's parameters"] if step.beyond_validity else []
    said += [f"buckled at {format_pressures(step.buckled)}"] if step.buckled else []
    said += [f"does not touch {name}: a real cup leaks" for name in step.pull if _leaks(step, name)]
    said += [] if step.stable else ["not stable: the body would buckle"]
    return said + ([SELF_INTERSECTS] if step.self_intersecting else [])


def is_doubtful(step: SweepStep) -> bool:
    """Whether no real body may be in this state, or its rubber be known there."""
    leaks = any(_leaks(step, name) for name in step.pull)
    return step.beyond_validity or not step.stable or step.self_intersecting or leaks


def _leaks(step: SweepStep, obstacle: str) -> bool:
    """Whether the rim of a chamber does not touch what closes it."""
    return step.contact_normal[obstacle] < LEAST


def _vector(before: str, parts: Iterable[float], digits: int, unit: str) -> list[Cell]:
    return [Cell(f"{before}{axis} {unit}", _fixed(part, digits)) for axis, part in zip(AXES, parts, strict=True)]


def _fixed(value: float, digits: int) -> str:
    """Rounded before it is written, so that no -0.000 is shown."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}"
