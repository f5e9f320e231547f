"""Changes of single keys in a problem's table, as studies and `Problem.with_changes` make them."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

from pneumorph.errors import ProblemError

_STEP = re.compile(r"([A-Za-z0-9_-]+)((?:\[\d+\])*)")


def change(table: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key, e.g. ``task[0].pressure.A``; tables on the way are made where they are missing.

    ``False`` leaves a key out, unless it holds a truth value.

    Raises
    ------
    ProblemError
        When there can be no such key.
    """
    steps: list[str | int] = []
    for part in key.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise ProblemError(f'"{key}" is no key of a problem; write e.g. "task[0].pressure.A"')
        steps += [match[1], *map(int, re.findall(r"\d+", match[2]))]
    at: Any = table
    for step, following in pairwise(steps):
        if isinstance(step, str):
            if not isinstance(at, dict):
                raise ProblemError(f'"{key}": there is no table to hold "{step}"; check the key')
            at = at.setdefault(step, {} if isinstance(following, str) else [])
        else:
            at = _entry(at, step, key)
    last = steps[-1]
    if isinstance(last, int):
        _entry(at, last, key)
        at[last] = value
    elif not isinstance(at, dict):
        raise ProblemError(f'"{key}": there is no table to hold "{last}"; check the key')
    elif value is False and not isinstance(at.get(last), bool):
        at.pop(last, None)
    else:
        at[last] = value


def _entry(at: Any, index: int, key: str) -> Any:
    if not isinstance(at, list) or index >= len(at):
        count = len(at) if isinstance(at, list) else 0
        raise ProblemError(f'"{key}": there is no entry [{index}], only {count}; count from 0')
    return at[index]
