"""Pressures as users write them: "60 kPa" is constant, "0:60:5 kPa" is swept from 0 to 60 kPa in steps of 5."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph import units
from pneumorph.errors import ProblemError

_SHAPE = re.compile(rf"\s*({units.NUMBER}(?::{units.NUMBER}:{units.NUMBER})?)\s*(\S.*)?")
_FIX = "write A=60kPa for a constant pressure or A=0:60:5kPa for a sweep"
MOST_STEPS = 10_000


@dataclass(frozen=True)
class PressurePath:
    """The pressures of one sweep: names of the swept chambers (none if all are constant), and MPa at every step."""

    swept: tuple[str, ...]
    steps: list[dict[str, float]]


def pressure_paths(given: Mapping[str, Any], chambers: tuple[str, ...], one_by_one: bool = False) -> list[PressurePath]:
    """Read the pressures that a user gives for a simulation.

    Swept chambers change together, in one path, and need the same number of steps. With `one_by_one` each has its own
    path, during which the others stay at the start of theirs. If nothing is swept, there is one path of one step. A
    step has only the chambers in `given`.

    Parameters
    ----------
    given : {chamber: "60 kPa", "0:60:5 kPa" or a pint quantity}
    chambers : names of all chambers.
    one_by_one : whether to sweep one chamber after another.

    Raises
    ------
    ProblemError
        If a value is not a pressure, a chamber is unknown, or the numbers of steps differ.
    """
    constant: dict[str, float] = {}
    swept: dict[str, np.ndarray] = {}
    for name, asked in given.items():
        if name not in chambers:
            raise ProblemError(
                f'pressure {name}={asked}: there is no chamber "{name}"; use one of {", ".join(chambers)}'
            )
        values = _read(name, asked)
        if len(values) == 1:
            constant[name] = float(values[0])
        else:
            swept[name] = values
    if one_by_one:
        if not swept:
            raise ProblemError(f"one by one: no chamber is swept; {_FIX}")
        first = constant | {name: float(values[0]) for name, values in swept.items()}
        return [
            PressurePath((name,), [first | {name: float(value)} for value in values]) for name, values in swept.items()
        ]
    lengths = {name: len(values) for name, values in swept.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise ProblemError(
            f"pressure: the swept chambers have different numbers of steps ({counts}); "
            "give them the same number, or sweep them one by one"
        )
    count = next(iter(lengths.values()), 1)
    steps = [constant | {name: float(values[step]) for name, values in swept.items()} for step in range(count)]
    return [PressurePath(tuple(swept), steps)]


def _read(name: str, asked: Any) -> np.ndarray:
    """A chamber's pressures in MPa."""
    text = units.text_of(asked)
    match = _SHAPE.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise ProblemError(f"pressure {name}={asked}: is not a pressure; {_FIX}")
    numbers, unit = match.groups()
    try:
        values = [units.parse(f"{number} {unit or ''}", units.PRESSURE) for number in numbers.split(":")]
    except ValueError as error:
        raise ProblemError(f"pressure {name}={asked}: {error}") from None
    if len(values) == 1:
        return np.array(values)
    start, stop, step = values
    if step == 0 or (stop - start) / step < 0:
        raise ProblemError(f"pressure {name}={asked}: this step does not lead from start to stop; {_FIX}")
    count = (stop - start) / step
    if count > MOST_STEPS:
        raise ProblemError(f"pressure {name}={asked}: has more than {MOST_STEPS} steps; use larger ones")
    # A last step just short of the stop by rounding is the stop.
    values = start + step * np.arange(int(np.floor(count + 1e-9)) + 1)
    return np.clip(values, min(start, stop), max(start, stop))
