"""In which keys two problems differ, as far as that matters to a run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pneumorph.problem import Problem

HARMLESS = ("optimizer.iterations", "title", "make")
"""Keys and tables of a problem that may differ when a run is resumed: its designs do not depend on them."""

_NAMED = 5  # keys that a message names


def differences(one: Problem, other: Problem) -> list[str]:
    """The keys in which two problems differ, other than those that are harmless for a run."""
    keys = _differences(one.model_dump(), other.model_dump())
    return [key for key in keys if key not in HARMLESS and key.split(".")[0] not in HARMLESS]


def in_words(keys: list[str]) -> str:
    """Keys that differ, in a message."""
    rest = f" and {len(keys) - _NAMED} more" if len(keys) > _NAMED else ""
    return f"{', '.join(keys[:_NAMED])}{rest} {'differ' if len(keys) > 1 else 'differs'}"


def _differences(one: Any, other: Any, key: str = "") -> Iterator[str]:
    """The keys in which two dumped problems differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in {**one, **other}:
            yield from _differences(one.get(name), other.get(name), f"{key}.{name}" if key else name)
    elif isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        for index, (mine, yours) in enumerate(zip(one, other, strict=True)):
            yield from _differences(mine, yours, f"{key}[{index}]")
    elif one != other:
        yield key
