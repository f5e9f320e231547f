"""Pressures for motions of a design: read as users write them, found, and said in words."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.analysis.explore import Explorer
from pneumorph.analysis.reaching import Reached, Reaching
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.problem import Problem
from pneumorph.problem.components import MOTION_OF, MOTIONS
from pneumorph.problem.objectives.words import MOTION_WORDS
from pneumorph.units import ANGLE, LENGTH, PRESSURE, parse

NO_NEARER = 1e-3
"""Part of the distance below which it is no smaller at other pressures."""

Bounds = dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False, repr=False)
class PressuresFound:
    """The pressures for a motion of the tip.

    Attributes
    ----------
    wanted : {motion: float}
        mm and rad.
    found : Reached
        The pressures (MPa), the motion there, and how far it is from what is wanted.
    """

    wanted: Mapping[str, float]
    found: Reached

    @property
    def pressures(self) -> Mapping[str, float]:
        """By chamber, MPa."""
        return self.found.pressures

    def __str__(self) -> str:
        found = self.found
        named = ", ".join(f"{name} = {_number(1e3 * value)} kPa" for name, value in found.pressures.items())
        first = "reached with" if found.reached else "out of reach; the nearest is at"
        lines = [f"{first} {named} ({found.solves} equilibria)"]
        for motion, value in self.wanted.items():
            achieved = value + found.off[motion]
            lines.append(f"{MOTION_WORDS[motion]} {_amount(motion, achieved)} (wanted {_amount(motion, value)})")
        if not found.reached:
            bound = f"; at a bound: {', '.join(found.at_bounds)}" if found.at_bounds else ""
            lines.append(f"it misses by {found.distance:.3g} mm, where 1° counts as 1 mm{bound}")
            nothing = f"nothing nearer was found from {found.starts} starts"
            if found.nearer <= NO_NEARER * found.distance:
                lines.append(f"to first order no pressures within the bounds bring it nearer, and {nothing}")
            else:
                lines.append(
                    f"{nothing}; to first order others bring it nearer by {found.nearer:.2g} mm, but the search "
                    "came to pressures without a stable state, or to its largest number of steps"
                )
        return "\n".join(lines)

    __repr__ = __str__


def inverse(
    explorer: Explorer, problem: Problem, bounds: Mapping[str, Any] | None, wanted: Sequence[Mapping[str, float]]
) -> list[PressuresFound]:
    """The pressures for motions, one after another.

    Parameters
    ----------
    explorer : of the body.
    problem : of the design.
    bounds : {chamber: "0:60 kPa"} or None
    wanted : {motion: mm or rad}, for each.

    Raises
    ------
    ProblemError
        If bounds are no pressures.
    ComputationError
        If the body has no stable equilibrium within the bounds.
    """
    search = Reaching(explorer, bounds_of(problem, bounds or {}))
    answers = []
    for each in wanted:
        found = search.reach(each)
        if found is None:
            raise ComputationError("no stable equilibrium was found within the bounds of the pressures; lower them")
        answers.append(PressuresFound(each, found))
    return answers


def motions_wanted(given: Mapping[str, Any]) -> dict[str, float]:
    """Motions in mm and rad, from text with units.

    Raises
    ------
    ProblemError
        If there is none, or one is unknown or no quantity.
    """
    if not given:
        raise ProblemError(f"no motion is asked for; give one of {', '.join(MOTIONS)}, such as bending_y=30deg")
    wanted = {}
    for key, text in given.items():
        name = MOTION_OF.get(key, key)
        if name not in MOTIONS:
            raise ProblemError(f"{key}: is no motion of the tip; use one of {', '.join(MOTIONS)}")
        try:
            wanted[name] = parse(text, LENGTH if MOTIONS.index(name) < 3 else ANGLE)
        except ValueError as error:
            raise ProblemError(f"{key}: {error}") from None
    return wanted


def bounds_of(problem: Problem, given: Mapping[str, Any]) -> Bounds:
    """The range of every chamber in MPa: as given, or else from 0 to what tasks have.

    Parameters
    ----------
    problem : of the design.
    given : {chamber: "60 kPa" from 0, or "-10:60 kPa"}

    Raises
    ------
    ProblemError
        If a chamber is unknown, a bound is no pressure, or no chamber has a pressure.
    """
    names = [chamber.name for chamber in problem.body.chamber]
    for name in given:
        if name not in names:
            raise ProblemError(f"{name}: there is no such chamber; there are {', '.join(names)}")
    found: Bounds = {}
    for name in names:
        if name in given:
            found[name] = range_of(name, given[name])
            continue
        ranges = [task.pressure[name] for task in problem.task]
        ends = [0.0, *(end for each in ranges for end in ((each.min, each.max) if each.free else (each.start,)))]
        if min(ends) < max(ends):
            found[name] = (min(ends), max(ends))
    if not found:
        raise ProblemError("no chamber has a pressure in the tasks; give bounds, such as A=0:60kPa")
    return found


def read_motions(path: Path) -> list[dict[str, float]]:
    """Motions in mm and rad from a CSV file with a line of titles, "bending_y (deg),extension (mm)", and one a line.

    Raises
    ------
    ProblemError
        If the file cannot be read, or a title or number is missing.
    """
    try:
        rows = [row for row in csv.reader(path.read_text(encoding="utf-8-sig").splitlines()) if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ProblemError(f"{path}: cannot be read as CSV ({error}); check the path") from None
    if len(rows) < 2:
        raise ProblemError(f"{path}: has no motions; write a line of titles, as bending_y (deg), and one motion a line")
    units = {}
    for title in rows[0]:
        name, _, unit = title.strip().removesuffix(")").partition("(")
        [(motion, one)] = motions_wanted({name.strip(): f"1 {unit.strip()}"}).items()
        units[motion] = one
    return [_motions_of(path, number, row, units) for number, row in enumerate(rows[1:], 2)]


def _motions_of(path: Path, number: int, row: Sequence[str], units: Mapping[str, float]) -> dict[str, float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError as error:
        raise ProblemError(f"{path}, line {number}: {error}; give numbers only") from None
    if len(values) != len(units) or not np.isfinite(values).all():
        raise ProblemError(f"{path}, line {number}: needs a finite number for each of {', '.join(units)}")
    return {motion: value * one for value, (motion, one) in zip(values, units.items(), strict=True)}


def range_of(name: str, text: Any) -> tuple[float, float]:
    parts = str(text).split(":")
    if len(parts) > 2:
        raise ProblemError(f'{name}: "{text}" is no range; write {name}=0:60kPa')
    try:
        upper = parse(parts[-1], PRESSURE)
        unit = parts[-1].strip().lstrip("+-0123456789.eE ")
        lower = parse(f"{parts[0]} {unit}", PRESSURE) if len(parts) == 2 else min(0.0, upper)
    except ValueError as error:
        raise ProblemError(f"{name}: {error}") from None
    upper = max(0.0, upper) if len(parts) == 1 else upper
    if not lower < upper:
        raise ProblemError(f'{name}: "{text}" is an empty range; write {name}=0:60kPa')
    return lower, upper


def _amount(motion: str, value: float) -> str:
    return f"{value:.2f} mm" if MOTIONS.index(motion) < 3 else f"{np.degrees(value):.2f}°"


def _number(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"
