"""Pressures for motions and forces of a design: read as users write them, found, and said in words."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.analysis.explore import Explorer
from pneumorph.analysis.reaching import WANTED, Reached, Reaching
from pneumorph.errors import Hopeless, ProblemError
from pneumorph.problem import Problem
from pneumorph.problem.components import COMPONENT_OF, MOTION_OF, MOTIONS, PUSH, PUSHES, is_turn
from pneumorph.problem.objectives.words import MOTION_WORDS
from pneumorph.units import ANGLE, FORCE, LENGTH, MOMENT, PRESSURE, Kind, parse, split

NO_NEARER = 1e-3
"""Part of the distance below which it is no smaller at other pressures."""

Bounds = dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False, repr=False)
class PressuresFound:
    """The pressures for a motion of the tip, or for a force with which it pushes where it is held.

    Attributes
    ----------
    wanted : {name: float}
        mm and rad; N and N·mm of what begins with "push_".
    found : Reached
        The pressures (MPa), the motion and forces there, and how far they are from what is wanted.
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
        for name, value in self.wanted.items():
            achieved = value + found.off[name]
            lines.append(f"{_words(name)} {_amount(name, achieved)} (wanted {_amount(name, value)})")
        if not found.reached:
            bound = f"; at a bound: {', '.join(found.at_bounds)}" if found.at_bounds else ""
            lines.append(f"it misses by {self._missed()}{bound}")
            nothing = f"nothing nearer was found from {found.starts} starts"
            if found.nearer <= NO_NEARER * found.distance:
                lines.append(f"to first order no pressures within the bounds bring it nearer, and {nothing}")
            else:
                part = f"{100 * found.nearer / found.distance:.2g} %"
                lines.append(
                    f"{nothing}; to first order others bring it nearer by {part} of that, but the search "
                    "came to pressures without a stable state, or to its largest number of steps"
                )
        return "\n".join(lines)

    def _missed(self) -> str:
        """By how much, in the unit of what is wanted, or in mm where that is several things."""
        found, pushed = self.found, any(name in PUSHES for name in self.wanted)
        if len(self.wanted) == 1 and (pushed or not is_turn(next(iter(self.wanted)))):
            [(name, off)] = found.off.items()
            return f"{abs(off):.3g} {_unit(name)}"
        counted = "1° and 1 % of a force count" if pushed else "1° counts"
        return f"{found.distance:.3g} mm, where {counted} as 1 mm"

    __repr__ = __str__


def inverse(
    explorer: Explorer, problem: Problem, bounds: Mapping[str, Any] | None, wanted: Sequence[Mapping[str, float]]
) -> list[PressuresFound]:
    """The pressures for motions and forces, one after another.

    Parameters
    ----------
    explorer : of the body.
    problem : of the design.
    bounds : {chamber: "0:60 kPa"} or None
    wanted : {name: mm, rad, N or N·mm}, for each; see `motions_wanted`.

    Raises
    ------
    ProblemError
        If bounds are no pressures, or a motion is to change that is held.
    Hopeless
        If the body has no stable equilibrium within the bounds.
    """
    for each in wanted:
        for name in explorer.under.hold.values:
            if (motion := MOTION_OF.get(name, name)) in each:
                raise ProblemError(f"{motion}: is held, so it cannot be reached; give it as --block {motion}=2mm")
    search = Reaching(explorer, bounds_of(problem, bounds or {}))
    answers = []
    for each in wanted:
        found = search.reach(each)
        if found is None:
            raise Hopeless("no stable equilibrium was found within the bounds of the pressures; lower them")
        answers.append(PressuresFound(each, found))
    return answers


def pushed_motions(wanted: Sequence[Mapping[str, float]]) -> list[str]:
    """The motions along which the tip is to push."""
    return list(dict.fromkeys(name.removeprefix(PUSH) for each in wanted for name in each if name in PUSHES))


def motions_wanted(given: Mapping[str, Any]) -> dict[str, float]:
    """Motions in mm and rad, and forces in N and N·mm, from text with units.

    Parameters
    ----------
    given : {motion: "2 mm"}, {"push_" and a motion: "0.2 N"}

    Raises
    ------
    ProblemError
        If there is none, or one is unknown or no quantity.
    """
    if not given:
        raise ProblemError(
            f"no motion is asked for; give one of {', '.join(MOTIONS)}, such as bending_y=30deg, or a force: "
            "push_extension=0.5N"
        )
    wanted = {}
    for key, text in given.items():
        before, own = (PUSH, key.removeprefix(PUSH)) if key.startswith(PUSH) else ("", key)
        name = before + MOTION_OF.get(own, own)
        if name not in WANTED:
            raise ProblemError(
                f"{key}: is no motion of the tip; use one of {', '.join(MOTIONS)}, with {PUSH} before it for a force"
            )
        try:
            wanted[name] = parse(text, _kind(name))
        except ValueError as error:
            raise ProblemError(f"{key}: {error}") from None
    return wanted


def as_motions(given: Mapping[str, Any], problem: Problem) -> dict[str, Any]:
    """Motions and forces as `motions_wanted` reads them, with a pose in coordinates among them.

    Parameters
    ----------
    given : {"position": "0 mm, 20 mm, 70 mm"} or three texts, {"rotation": "0 deg, 30 deg, 0 deg"}, and others
        Where the centre of the tip is to be, from the centre of the base, and the rotation vector of the tip.
    problem : of the design.

    Raises
    ------
    ProblemError
        If a pose has not three quantities, or one of its motions is given beside it.
    """
    base, tip = problem.body.ends
    found = {name: text for name, text in given.items() if name not in ("position", "rotation")}
    for key, names, kind, start, unit in (
        ("position", MOTIONS[:3], LENGTH, tip - base, "mm"),
        ("rotation", MOTIONS[3:], ANGLE, np.zeros(3), "rad"),
    ):
        if key not in given:
            continue
        parts = given[key].split(",") if isinstance(given[key], str) else list(given[key])
        if len(parts) != 3:
            example = "0 deg, 30 deg, 0 deg" if unit == "rad" else "0 mm, 20 mm, 70 mm"
            raise ProblemError(f'{key}: "{given[key]}" has not three parts; write it as "{example}"')
        for name, text, begin in zip(names, parts, start, strict=True):
            if name in found or COMPONENT_OF.get(name) in found:
                raise ProblemError(f"{key}: says where {name} is to be, which is given too; leave one of them out")
            try:
                found[name] = f"{float(parse(text, kind) - begin)!r} {unit}"
            except ValueError as error:
                raise ProblemError(f"{key}: {error}") from None
    return found


def _kind(name: str) -> Kind:
    if name in PUSHES:
        return MOMENT if is_turn(name.removeprefix(PUSH)) else FORCE
    return ANGLE if is_turn(name) else LENGTH


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
    """Motions and forces from a CSV file with a line of titles, "bending_y (deg),push_extension (N)", and one a line.

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
        lower = min(0.0, upper)
        if len(parts) == 2:
            own = split(parts[0])
            lower = parse(parts[0] if own and own[1] else f"{parts[0]} {unit}", PRESSURE)
    except ValueError as error:
        raise ProblemError(f"{name}: {error}") from None
    upper = max(0.0, upper) if len(parts) == 1 else upper
    if not lower < upper:
        raise ProblemError(f'{name}: "{text}" is an empty range; write {name}=0:60kPa')
    return lower, upper


def _words(name: str) -> str:
    """What is wanted, in words."""
    if name in MOTIONS:
        return MOTION_WORDS[name]
    kind = "moment about" if is_turn(name.removeprefix(PUSH)) else "force along"
    return f"{kind} {'xyz'[PUSHES.index(name) % 3]}"


def _unit(name: str) -> str:
    """Of what is wanted; of angles that of degrees."""
    if name in PUSHES:
        return "N·mm" if is_turn(name.removeprefix(PUSH)) else "N"
    return "°" if is_turn(name) else "mm"


def _amount(name: str, value: float) -> str:
    if name in PUSHES:
        return f"{value:.4g} {_unit(name)}"
    return f"{np.degrees(value):.2f}°" if is_turn(name) else f"{value:.2f} mm"


def _number(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"
