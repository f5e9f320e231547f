"""Pressures on the command line: "A=60kPa" holds a chamber's pressure, "A=0:60:5kPa" sweeps it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from pneumorph import units
from pneumorph.errors import ProblemError

_SHAPE = re.compile(rf"\s*([A-Za-z0-9_-]+)\s*=\s*({units.NUMBER}(?::{units.NUMBER}:{units.NUMBER})?)\s*(\S.*)?")
_MEND = "write --pressure A=60kPa to hold it or --pressure A=0:60:5kPa to sweep it"
MOST_STEPS = 10_000


@dataclass(frozen=True)
class Leg:
    """A sweep: the chambers swept in it, none where all are held, and the pressures given at every step in MPa."""

    swept: tuple[str, ...]
    path: list[dict[str, float]]


def legs_of(options: list[str], chambers: tuple[str, ...], one_by_one: bool = False) -> list[Leg]:
    """The sweeps that options ask for.

    Swept chambers step together, so they need the same number of steps; or one by one, a leg for each, while the others
    wait at the start of theirs. A path has the pressures of the chambers that the options name, and one step where
    nothing is swept.

    Raises
    ------
    ProblemError
        For an option that is no pressure, an unknown chamber, or sweeps of different lengths.
    """
    held: dict[str, float] = {}
    swept: dict[str, np.ndarray] = {}
    for option in options:
        name, values = _read(option)
        if name not in chambers:
            raise ProblemError(f'--pressure {option}: there is no chamber "{name}"; take one of {", ".join(chambers)}')
        if name in held or name in swept:
            raise ProblemError(f'--pressure {option}: chamber "{name}" has a pressure already; leave one of them out')
        if len(values) == 1:
            held[name] = float(values[0])
        else:
            swept[name] = values
    if one_by_one:
        if not swept:
            raise ProblemError(f"--one-by-one: no chamber is swept; {_MEND}")
        waiting = held | {name: float(values[0]) for name, values in swept.items()}
        return [Leg((name,), [waiting | {name: float(value)} for value in values]) for name, values in swept.items()]
    lengths = {name: len(values) for name, values in swept.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise ProblemError(
            f"--pressure: swept chambers step together but have different numbers of steps ({counts}); "
            "give them the same number, or add --one-by-one"
        )
    steps = next(iter(lengths.values()), 1)
    path = [held | {name: float(values[step]) for name, values in swept.items()} for step in range(steps)]
    return [Leg(tuple(swept), path)]


def _read(option: str) -> tuple[str, np.ndarray]:
    """A chamber's name and its pressures in MPa."""
    match = _SHAPE.fullmatch(option)
    if match is None:
        raise ProblemError(f"--pressure {option}: is not a chamber with its pressure; {_MEND}")
    name, numbers, unit = match.groups()
    try:
        values = [units.parse(f"{number} {unit or ''}", units.PRESSURE) for number in numbers.split(":")]
    except ValueError as error:
        raise ProblemError(f"--pressure {option}: {error}") from None
    if len(values) == 1:
        return name, np.array(values)
    start, stop, step = values
    if step == 0 or (stop - start) / step < 0:
        raise ProblemError(f"--pressure {option}: steps of this size do not lead from start to stop; {_MEND}")
    count = (stop - start) / step
    if count > MOST_STEPS:
        raise ProblemError(f"--pressure {option}: has more than {MOST_STEPS} steps; take larger ones")
    # A last step that rounding makes fall short of the stop still counts as the stop.
    values = start + step * np.arange(int(np.floor(count + 1e-9)) + 1)
    return name, np.clip(values, min(start, stop), max(start, stop))
