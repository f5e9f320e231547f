"""Pressures as users write them: "60 kPa" is constant, "0:60:5 kPa" is swept from 0 to 60 kPa in steps of 5.

Displacements of obstacles along x, y and z are written in the same way: "plate.z" is "-3 mm" or "0:-3:-0.5 mm", and
their rotation vectors' components too: "plate.turn_z" is "30 deg" or "0:90:5 deg". So are the values at which motions
of the plate are held: "axial=2 mm" or "bending_y=0:30:5 deg"; "axial" alone is held where it is at rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph import units
from pneumorph.errors import ProblemError
from pneumorph.mechanics import COMPONENTS
from pneumorph.problem.components import COMPONENT_OF, POSE, component_of, is_turn
from pneumorph.problem.gas import ATMOSPHERE, BELOW_VACUUM

_SHAPE = re.compile(rf"\s*({units.NUMBER}(?::{units.NUMBER}:{units.NUMBER})?)\s*(\S.*)?")
_FIX = "write A=60kPa for a constant pressure or A=0:60:5kPa for a sweep"
_FIX_MOVE = "write plate.z=-3mm for a displacement or plate.z=0:-3:-0.5mm for a sweep"
_FIX_LENGTH = "write axial=2mm for a value at which it is held or axial=0:4:1mm for a sweep"
_FIX_ANGLE = "write bending_y=30deg for a value at which it is held or bending_y=0:30:5deg for a sweep"
_FIX_VOLUME = "write A=12ml for a volume or A=0:12:1ml for a sweep"
_FIX_TURN = "write plate.turn_z=30deg for a turn or plate.turn_z=0:90:5deg for a sweep"
MOST_STEPS = 10_000
"""Of a sweep: more are taken for a mistake of a unit."""
AXES = ("x", "y", "z")
MOTIONS = {name: units.ANGLE if name.startswith("turn_") else units.LENGTH for name in POSE}
"""The motions of an obstacle, along and about the axes."""
BLOCKS = {**{name: (component_of(name),) for name in (*COMPONENTS, *COMPONENT_OF)}, "all": COMPONENTS}
"""The plate components that each word of the option `block` holds."""
HELD, FILLED = "held ", "volume "
"""What the names of held motions and of filled chambers begin with among what is swept: names have no spaces."""
TIME = "the time"
"""The same where chambers are filled from a supply, and nothing is swept by itself."""


@dataclass(frozen=True)
class PressurePath:
    """The pressures of one sweep, and how far it moves and turns obstacles.

    Attributes
    ----------
    swept : names of the swept chambers and motions, such as "plate.z"; none if all are constant.
    steps : MPa by chamber, at every step.
    moves : mm or rad by motion, at every step.
    holds : mm or rad by component of the plate that is held, at every step.
    volumes : mm³ by chamber that is filled, at every step.
    per_cycle : steps there and back, after the first step; 0 where the sweep goes one way alone.
    """

    swept: tuple[str, ...]
    steps: list[dict[str, float]]
    moves: list[dict[str, float]]
    holds: list[dict[str, float]]
    volumes: list[dict[str, float]]
    per_cycle: int = 0


def pressure_paths(
    given: Mapping[str, Any],
    chambers: tuple[str, ...],
    one_by_one: bool = False,
    moves: Mapping[str, Any] | None = None,
    obstacles: Sequence[str] = (),
    block: Iterable[str] = (),
    volumes: Mapping[str, Any] | None = None,
) -> list[PressurePath]:
    """Read the pressures, and the displacements of obstacles, that a user gives for a simulation.

    What is swept changes together, in one path, and needs the same number of steps. With `one_by_one` each has its own
    path, during which the others stay at the start of theirs. If nothing is swept, there is one path of one step. A
    step has only what is in `given` and `moves`.

    Parameters
    ----------
    given : {chamber: "60 kPa", "0:60:5 kPa" or a pint quantity}
    chambers : names of all chambers.
    one_by_one : whether to sweep one chamber after another.
    moves : {"plate.z": "-3 mm", "0:-3:-0.5 mm" or a pint quantity}, and {"plate.turn_z": "30 deg" or "0:90:5 deg"}
    obstacles : names of all obstacles.
    block : motions of the plate that are held, "axial", "axial=2 mm" or "axial=0:4:1 mm".
    volumes : {chamber: "12 ml" or "0:12:1 ml"}, of liquid that is filled in.

    Raises
    ------
    ProblemError
        If a value is not a pressure, length or angle, a chamber or obstacle is unknown, or the numbers of steps differ.
    """
    values: dict[str, np.ndarray] = {}
    for name, asked in given.items():
        if name not in chambers:
            raise ProblemError(
                f'pressure {name}={asked}: there is no chamber "{name}"; use one of {", ".join(chambers)}'
            )
        values[name] = _read(f"pressure {name}={asked}", asked, units.PRESSURE, _FIX)
        if (values[name] < -ATMOSPHERE).any():
            raise ProblemError(f"pressure {name}={asked}: {BELOW_VACUUM}")
    motions = {f"{obstacle}.{motion}": kind for obstacle in obstacles for motion, kind in MOTIONS.items()}
    for name, asked in (moves or {}).items():
        if name not in motions:
            known = f"use one of {', '.join(motions)}" if motions else "add a table [[obstacle]] to the problem"
            raise ProblemError(f'move {name}={asked}: there is no obstacle and axis "{name}"; {known}')
        fix = _FIX_MOVE if motions[name] is units.LENGTH else _FIX_TURN
        values[name] = _read(f"move {name}={asked}", asked, motions[name], fix)
    values |= held_values(block)
    for name, asked in (volumes or {}).items():
        if name not in chambers:
            raise ProblemError(f'volume {name}={asked}: there is no chamber "{name}"; use one of {", ".join(chambers)}')
        if name in given:
            raise ProblemError(f'volume {name}={asked}: chamber "{name}" has a pressure too; leave one of them out')
        values[FILLED + name] = _read(f"volume {name}={asked}", asked, units.VOLUME, _FIX_VOLUME)
    constant = {name: float(each[0]) for name, each in values.items() if len(each) == 1}
    swept = {name: each for name, each in values.items() if len(each) > 1}
    if one_by_one:
        if not swept:
            raise ProblemError(f"one by one: no chamber is swept; {_FIX}")
        first = constant | {name: float(each[0]) for name, each in swept.items()}
        return [
            _path((name,), [first | {name: float(value)} for value in each], chambers) for name, each in swept.items()
        ]
    lengths = {name: len(each) for name, each in swept.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        what = "swept chambers" if set(swept) <= set(chambers) else "swept chambers, obstacles and held motions"
        raise ProblemError(
            f"pressure: the {what} have different numbers of steps ({counts}); "
            "give them the same number, or sweep them one by one"
        )
    count = next(iter(lengths.values()), 1)
    steps = [constant | {name: float(each[step]) for name, each in swept.items()} for step in range(count)]
    return [_path(tuple(swept), steps, chambers)]


def held_values(block: Iterable[str]) -> dict[str, np.ndarray]:
    """The values at which motions of the plate are held, by `HELD` and the component.

    Raises
    ------
    ProblemError
        If a motion is unknown, or its value is not a length or an angle.
    """
    values: dict[str, np.ndarray] = {}
    for given in block:
        word, equals, asked = (part.strip() for part in given.partition("="))
        if word not in BLOCKS:
            raise ProblemError(f'block: "{word}" is not a motion of the plate; use one of {", ".join(BLOCKS)}')
        if equals and word == "all":
            raise ProblemError(f"block {given}: lengths and angles have no common value; give each motion its own")
        for component in BLOCKS[word]:
            kind, fix = (units.ANGLE, _FIX_ANGLE) if is_turn(component) else (units.LENGTH, _FIX_LENGTH)
            values[HELD + component] = _read(f"block {given}", asked, kind, fix) if equals else np.zeros(1)
    return values


def _path(swept: tuple[str, ...], steps: list[dict[str, float]], chambers: tuple[str, ...]) -> PressurePath:
    """A path from the values of chambers, obstacles and held motions at every step."""

    def of(kind: int) -> list[dict[str, float]]:
        own = ({name: value for name, value in step.items() if _kind(name, chambers) == kind} for step in steps)
        return [{name.removeprefix(HELD).removeprefix(FILLED): value for name, value in step.items()} for step in own]

    return PressurePath(swept, of(0), of(1), of(2), of(3))


def _kind(name: str, chambers: tuple[str, ...]) -> int:
    """0 for a chamber, 1 for a motion of an obstacle, 2 for a motion of the plate that is held, 3 for a volume."""
    if name in chambers:
        return 0
    return 2 if name.startswith(HELD) else 3 if name.startswith(FILLED) else 1


def _read(key: str, asked: Any, kind: units.Kind, fix: str) -> np.ndarray:
    """The values of a chamber in MPa, or of a motion in mm or rad."""
    text = units.text_of(asked)
    match = _SHAPE.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise ProblemError(f"{key}: is not {kind.name}; {fix}")
    numbers, unit = match.groups()
    try:
        values = [units.parse(f"{number} {unit or ''}", kind) for number in numbers.split(":")]
    except ValueError as error:
        raise ProblemError(f"{key}: {error}") from None
    if len(values) == 1:
        return np.array(values)
    start, stop, step = values
    if step == 0 or (stop - start) / step < 0:
        raise ProblemError(f"{key}: this step does not lead from start to stop; {fix}")
    count = (stop - start) / step
    if count > MOST_STEPS:
        raise ProblemError(f"{key}: has more than {MOST_STEPS} steps; use larger ones")
    # A last step just short of the stop by rounding is the stop.
    values = start + step * np.arange(int(np.floor(count + 1e-9)) + 1)
    return np.clip(values, min(start, stop), max(start, stop))
