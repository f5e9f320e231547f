"""Pressures as users write them: "60 kPa" holds a chamber's pressure, "0:60:5 kPa" sweeps it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph import units
from pneumorph.errors import ProblemError

_SHAPE = re.compile(rf"\s*({units.NUMBER}(?::{units.NUMBER}:{units.NUMBER})?)\s*(\S.*)?")
_FIX = "write A=60kPa to hold it or A=0:60:5kPa to sweep it"
MOST_STEPS = 10_000


@dataclass(frozen=True)
class Leg:
    """A sweep: the chambers swept in it, none where all are held, and the pressures given at every step in MPa."""

    swept: tuple[str, ...]
    path: list[dict[str, float]]


def legs_of(given: Mapping[str, Any], chambers: tuple[str, ...], one_by_one: bool = False) -> list[Leg]:
    """The sweeps that pressures ask for.

    Swept chambers step together, so they need the same number of steps; or one by one, a leg for each, while the others
    wait at the start of theirs. A path has the pressures of the chambers that are given one, and one step where nothing
    is swept.

    Parameters
    ----------
    given : {chamber: "60 kPa", "0:60:5 kPa" or a pint quantity}
    chambers : names of all chambers.

    Raises
    ------
    ProblemError
        For what is no pressure, an unknown chamber, or sweeps of different lengths.
    """
    constant: dict[str, float] = {}
    swept: dict[str, np.ndarray] = {}
    for name, asked in given.items():
        if name not in chambers:
            raise ProblemError(
                f'pressure {name}={asked}: there is no chamber "{name}"; take one of {", ".join(chambers)}'
            )
        values = _read(name, asked)
        if len(values) == 1:
            constant[name] = float(values[0])
        else:
            swept[name] = values
    if one_by_one:
        if not swept:
            raise ProblemError(f"one by one: no chamber is swept; {_FIX}")
        waiting = constant | {name: float(values[0]) for name, values in swept.items()}
        return [Leg((name,), [waiting | {name: float(value)} for value in values]) for name, values in swept.items()]
    lengths = {name: len(values) for name, values in swept.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise ProblemError(
            f"pressure: swept chambers step together but have different numbers of steps ({counts}); "
            "give them the same number, or sweep them one by one"
        )
    steps = next(iter(lengths.values()), 1)
    path = [constant | {name: float(values[step]) for name, values in swept.items()} for step in range(steps)]
    return [Leg(tuple(swept), path)]


def _read(name: str, asked: Any) -> np.ndarray:
    """A chamber's pressures in MPa."""
    text = units.text_of(asked)
    match = _SHAPE.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise ProblemError(f"pressure {name}={asked}: is not a chamber with its pressure; {_FIX}")
    numbers, unit = match.groups()
    try:
        values = [units.parse(f"{number} {unit or ''}", units.PRESSURE) for number in numbers.split(":")]
    except ValueError as error:
        raise ProblemError(f"pressure {name}={asked}: {error}") from None
    if len(values) == 1:
        return np.array(values)
    start, stop, step = values
    if step == 0 or (stop - start) / step < 0:
        raise ProblemError(f"pressure {name}={asked}: steps of this size do not lead from start to stop; {_FIX}")
    count = (stop - start) / step
    if count > MOST_STEPS:
        raise ProblemError(f"pressure {name}={asked}: has more than {MOST_STEPS} steps; take larger ones")
    # A last step that rounding makes fall short of the stop still counts as the stop.
    values = start + step * np.arange(int(np.floor(count + 1e-9)) + 1)
    return np.clip(values, min(start, stop), max(start, stop))
