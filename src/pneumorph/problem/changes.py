"""Changes to single keys of a problem's table, as made by studies and `Problem.with_changes`."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

from pneumorph.errors import ProblemError, short
from pneumorph.problem.reasons import key_of

_STEP = re.compile(r"([A-Za-z0-9_-]+)((?:\[\d{1,6}\])*)")
MOST = 300
"""Characters of a key."""


def change(table: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key such as ``task[0].pressure.A``; missing tables on the way are created.

    ``False`` removes the key, unless its value is a boolean.

    Raises
    ------
    ProblemError
        If the key cannot exist.
    """
    if len(key) > MOST:
        raise ProblemError(f'"{short(key)}" is not a key of a problem; write e.g. "task[0].pressure.A"')
    steps: list[str | int] = []
    for part in key.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise ProblemError(f'"{key}" is not a key of a problem; write e.g. "task[0].pressure.A"')
        steps += [match[1], *map(int, re.findall(r"\d+", match[2]))]
    at: Any = table
    for number, (step, following) in enumerate(pairwise(steps)):
        if isinstance(step, str):
            if not isinstance(at, dict):
                raise _no_table(key, steps, number, at)
            at = at.setdefault(step, {} if isinstance(following, str) else [])
        else:
            at = _entry(at, step, key)
    last = steps[-1]
    if isinstance(last, int):
        _entry(at, last, key)
        at[last] = value
    elif not isinstance(at, dict):
        raise _no_table(key, steps, len(steps) - 1, at)
    elif value is False and not isinstance(at.get(last), bool):
        at.pop(last, None)
    else:
        at[last] = value


def _no_table(key: str, steps: list[str | int], number: int, at: Any) -> ProblemError:
    """The error for a step of a key that is to be looked up in something that is no table."""
    if not (isinstance(at, list) and number > 0):
        return ProblemError(f'"{key}": there is no table to hold "{steps[number]}"; check the key')
    which = key_of([*steps[:number], 0, *steps[number:]])
    return ProblemError(f'"{key}": {key_of(steps[:number])} is a list; say which entry, of the first it is "{which}"')


def _entry(at: Any, index: int, key: str) -> Any:
    if not isinstance(at, list) or index >= len(at):
        count = len(at) if isinstance(at, list) else 0
        raise ProblemError(f'"{key}": there is no entry [{index}]; the list has {count}, counted from 0')
    return at[index]
