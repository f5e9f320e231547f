"""An example of a table as it is written in a problem file, for messages."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from pneumorph.problem.table import Example, Quantity, Table

MOST = 90
"""Characters of an example; a longer one says less than the names of the keys."""


def table_example(key: str | int, table: type[Table] | None, given: Any) -> str | None:
    """A table as it is written for a key, e.g. ``{ distance = "0.3 mm" }``; None where no short example is known.

    It has the keys that must be given, or the first one that has an example.

    Parameters
    ----------
    key : str or int
    table : type or None
        None for one whose keys are names.
    given : Any
        What was given in place of the table; the example has it where a key takes it.
    """
    for each in _tables():
        field = each.model_fields.get(str(key))
        if field and (text := _told(str(key), field)) and text.startswith("{"):
            return text
    if table is None:
        return None
    required = {name: field for name, field in table.model_fields.items() if field.is_required()}
    known: list[str] = []
    for name, field in (required or table.model_fields).items():
        value = _value(name, field, None if known else given)
        if value is None and required:
            return None
        if value is not None:
            known.append(f"{name} = {value}")
    text = ", ".join(known if required else known[:1])
    return f"{{ {text} }}" if 0 < len(text) <= MOST else None


def table_of(name: str) -> type[Table] | None:
    """The table whose class has this name."""
    return next((table for table in _tables() if table.__name__ == name), None)


def _tables(of: type[Table] = Table) -> Iterator[type[Table]]:
    yield of
    for below in of.__subclasses__():
        yield from _tables(below)


def _told(key: str, field: FieldInfo) -> str | None:
    """The value in the example of a key, if there is one and it is nothing but the value."""
    for part in _parts(field):
        if isinstance(part, Example) and (found := re.search(rf"(?:^|e\.g\. ){key} = (.+)$", part.text)):
            return found[1] if _is_toml(found[1]) else None
    return None


def _value(key: str, field: FieldInfo, given: Any) -> str | None:
    if (told := _told(key, field)) is not None:
        return told
    for part in _parts(field):
        match part:
            case Quantity():
                if isinstance(given, str) and _takes(part, given):
                    return f'"{given.strip()}"'
                default = field.default if isinstance(field.default, float) else 0.0
                return f'"{part.write(default) if default else part.kind.example}"'
            case _ if get_origin(part) is Literal:
                return f'"{get_args(part)[0]}"'
            case _ if part is bool:
                return "true"
            case _ if get_origin(part) in (list, tuple):
                return None
    return str(field.default) if isinstance(field.default, float) else None


def _parts(field: FieldInfo) -> Iterator[Any]:
    """What the annotation of a field consists of, from the whole to its parts."""
    yield from field.metadata
    yield from _within(field.annotation)


def _within(annotation: Any) -> Iterator[Any]:
    yield annotation
    if get_origin(annotation) is not Literal:
        for part in get_args(annotation):
            yield from _within(part)


def _takes(quantity: Quantity, text: str) -> bool:
    try:
        quantity.read(text)
    except ValueError:
        return False
    return True


def _is_toml(value: str) -> bool:
    try:
        tomllib.loads(f"key = {value}")
    except tomllib.TOMLDecodeError:
        return False
    return True
