"""Validation errors as one readable line: the key, what is wrong, how to fix it."""

import json
import re
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from pneumorph.errors import ProblemError, clipped, short
from pneumorph.problem.examples import table_example, table_of
from pneumorph.problem.table import TAG, InvalidKey, UnknownKey

MOST = 300
"""Characters of a message about something in a file."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def refusal(faults: Sequence[tuple[str, str]]) -> ProblemError:
    """The error for faults (key, reason), each of at most `MOST` characters.

    Its message is the first of them, and how many more there are.
    """
    lines = list(dict.fromkeys(clipped(f"{key}: {reason}", MOST) for key, reason in faults))
    more = len(lines) - 1
    rest = f" (and {more} more {'fault' if more == 1 else 'faults'})" if more else ""
    return ProblemError(clipped(lines[0], MOST - len(rest)) + rest, lines)


def faults_of(error: ValidationError) -> list[tuple[str, str]]:
    """Key and reason of everything that the models refused."""
    errors = error.errors()
    # A list with an invalid entry is also reported as too short; leave that report out.
    within = {each["loc"][:length] for each in errors for length in range(len(each["loc"]))}
    top = _keys_of(error.title)
    return [_fault(each, top) for each in errors if each["type"] != "too_short" or each["loc"] not in within]


def _fault(error: Any, top: Sequence[str]) -> tuple[str, str]:
    path = [part for part in error["loc"] if not str(part).startswith(TAG)]
    context = error.get("ctx", {})
    if isinstance(context.get("error"), InvalidKey):
        path.append(context["error"].key)
    if path and path[-1] == "[key]":
        path.pop()
    if isinstance(context.get("error"), UnknownKey) and len(path) > 1 and path[-1] in top:
        return key_of(path), f"belongs to the top of the file; write {path[-1]} above the first line in brackets"
    return key_of(path), _reason(error["type"], path, error.get("input"), context, error["msg"])


def key_of(path: Sequence[str | int]) -> str:
    """The path of a key as users write it: ``body.chamber[0].radius``."""
    key = ""
    for part in path:
        if isinstance(part, int):
            key += f"[{part}]"
        else:
            name = short(part) if _BARE.fullmatch(part) else json.dumps(short(part), ensure_ascii=False)
            key += f".{name}" if key else name
    return key


def _reason(kind: str, path: Sequence[str | int], given: Any, context: dict[str, Any], otherwise: str) -> str:
    match kind:
        case "value_error":
            return str(context["error"])
        case "literal_error":
            return f"{_shown(given)} is not a known value; use {context['expected']}"
        case "model_type":
            table = table_of(context["class_name"])
            keys = f"should be a table with keys such as {', '.join(_keys_of(context['class_name'])[:4])}"
            example = table_example(path[-1], table, given) if path else None
            return f"{keys}; write e.g. {_named(path, example)}" if example else keys
        case "dict_type":
            example = table_example(path[-1], None, given) or '{ A = "60 kPa" }'
            return f"should be a table; write e.g. {_named(path, example)}"
        case "tuple_type":
            if isinstance(given, str):
                return f"should be a list; write it in brackets, [{_shown(given)}]"
            return "should be a list (a list of tables is written with double brackets, [[...]])"
        case "too_short":
            what = "has too few entries" if context["actual_length"] else "is empty"
            return f"{what}; give at least {'one' if context['min_length'] == 1 else context['min_length']}"
        case "missing":
            return "is missing; the list needs all its entries"
        case "too_long":
            return f"has too many entries; give at most {context['max_length']}"
        case "string_too_long":
            return f"has {len(str(given))} characters; use at most {context['max_length']}"
        case "string_pattern_mismatch":
            return f"{_shown(given)} cannot be a name; use only letters, digits, _ and -"
        case "string_type":
            return f"{_shown(given)} is not text; put it in quotes"
        case "finite_number":
            return f"{_shown(given)} is not finite; write a finite number"
        case "float_type" | "int_type" | "bool_type" | "int_from_float":
            wanted = {"int_type": "a whole number", "int_from_float": "a whole number", "bool_type": "true or false"}
            return f"{_shown(given)} is not {wanted.get(kind, 'a number')}; write one without quotes"
        case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
            return f"{_shown(given)} is out of range; it should be {otherwise.removeprefix('Input should be ')}"
    return otherwise


def _named(path: Sequence[str | int], value: str) -> str:
    """A value beside its key, or alone as an entry of a list."""
    return f"{path[-1]} = {value}" if isinstance(path[-1], str) else value


def _shown(given: Any) -> str:
    if isinstance(given, str):
        return json.dumps(short(given), ensure_ascii=False)
    if isinstance(given, int) and given.bit_length() > 200:
        return f"a number {short(given)}"
    return json.dumps(given) if isinstance(given, bool | int | float) else f"a {type(given).__name__}"


def _keys_of(name: str) -> list[str]:
    """The keys of the table of this name."""
    table = table_of(name)
    return list(table.model_fields) if table else []
