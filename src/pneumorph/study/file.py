"""The study file: a base problem, and a list or grid of changes to it.

    title = "Stiffness of the spring"
    base = "bending.toml"                       # beside the study file
    [grid]                                      # every combination of the values
    "end_effector.spring.bending_y" = ["0 N*mm/rad", "100 N*mm/rad"]
    [[member]]                                  # or listed one by one; with a grid, it is applied to every member
    name = "long"
    base = "linear.toml"                        # instead of the base of the study
    set = { "body.length" = "120 mm", "body.ripple" = false }      # false leaves a key out

Keys are those of the problem file, with numbers for entries of lists, counted from 0: ``task[0].pressure.A``,
``body.chamber[1].radius``.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import tomli_w

from pneumorph.errors import ProblemError, short
from pneumorph.problem import Problem, Trust, admit, codes_of, loads
from pneumorph.problem.changes import change
from pneumorph.problem.models import RESERVED
from pneumorph.problem.reading import read_toml

MOST_MEMBERS = 1000
"""More designs are taken for a mistake in a grid."""

LONGEST = 10_000
"""Characters of a value that count for the name of a member."""

MOST_OF_A_NAME = 120
"""Characters of a member's name, by which its directory is called."""


@dataclass(frozen=True)
class Member:
    """One design of a study: its name, which is also its directory's, its changes to the base, and its problem.

    It begins with the last design of the run in the directory `begin`, where that is given.
    """

    name: str
    changes: Mapping[str, Any]
    problem: Problem
    begin: str | None = None


@dataclass(frozen=True)
class Study:
    """A study: its title and its members."""

    title: str
    members: tuple[Member, ...]


def load_study(path: str | Path, trust: Trust = False) -> Study:
    """Read a study file and build the problem of every member; `trust` is that of code in them, see `problem.load`.

    Raises
    ------
    ProblemError
        If the file or one of the problems has a mistake, or code that is not trusted.
    """
    path = Path(path)
    data = _table(path)
    for key in data:
        if key not in ("title", "base", "grid", "member"):
            raise ProblemError(f"{path}: {short(key)}: is not a key of a study; use title, base, grid or member")
    grid, listed = data.get("grid", {}), data.get("member", [{}])
    if not isinstance(grid, dict) or not all(isinstance(values, list) and values for values in grid.values()):
        raise ProblemError(f'{path}: grid: needs a list of values for every key, e.g. "body.length" = ["80 mm"]')
    if not isinstance(listed, list) or not all(isinstance(member, dict) for member in listed):
        raise ProblemError(f"{path}: member: is a table that may be repeated; write [[member]]")
    if "grid" not in data and "member" not in data:
        raise ProblemError(f"{path}: has neither a [grid] nor a [[member]]; add one with the changes")
    count = len(listed)
    for values in grid.values():
        count *= len(values)
    if count > MOST_MEMBERS:
        raise ProblemError(f"{path}: asks for {count} designs, more than {MOST_MEMBERS}; shorten the lists")
    members = tuple(_members(path, data.get("base"), grid, listed))
    names = [member.name.casefold() for member in members]
    for member in members:
        # Some file systems do not tell upper from lower case.
        if names.count(member.name.casefold()) > 1:
            raise ProblemError(
                f'{path}: two members are called "{short(member.name)}"; give every [[member]] a name of its own'
            )
    admit([code for member in members for code in codes_of(member.problem)], str(path), trust)
    return Study(short(data.get("title", path.stem), 300), members)


def _members(path: Path, base: Any, grid: dict[str, list], listed: list[dict]) -> Iterator[Member]:
    bases: dict[str, dict[str, Any]] = {}
    for index, entry in enumerate(listed):
        where = f"{path}: member[{index}]"
        for key in entry:
            if key not in ("name", "base", "set"):
                raise ProblemError(f"{where}.{short(key)}: is not a key of a member; use name, base or set")
        source = entry.get("base", base)
        if not isinstance(source, str):
            raise ProblemError(f'{path}: base: is missing; name a problem file, e.g. base = "linear.toml"')
        if source not in bases:
            bases[source] = _table(path.parent / source)
        own = entry.get("set", {})
        if not isinstance(own, dict):
            raise ProblemError(f'{where}.set: is not a table; write e.g. set = {{ "body.length" = "90 mm" }}')
        for values in product(*grid.values()):
            changes = {**own, **dict(zip(grid, values, strict=True))}
            parts = [short(entry["name"], LONGEST)] if "name" in entry else [_named(own)] if own else []
            name = _slug(", ".join([*parts, *(_in_words(key, value) for key, value in zip(grid, values, strict=True))]))
            try:
                problem = deepcopy(bases[source])
                for key, value in changes.items():
                    change(problem, key, value)
                folder = (path.parent / source).parent
                yield Member(name, changes, loads(tomli_w.dumps(problem), folder=folder))
            except ProblemError as error:
                raise ProblemError(f"{path}, {short(name, 40)}: {error}") from None
            except (RecursionError, ValueError):
                raise ProblemError(
                    f"{path}, {short(name, 40)}: has numbers of too many digits or too many lists within lists; "
                    "write it shorter"
                ) from None


def _table(path: Path) -> dict[str, Any]:
    return read_toml(path, str(path), "the file")


def _named(changes: Mapping[str, Any]) -> str:
    return ", ".join(_in_words(key, value) for key, value in changes.items())


def _in_words(key: str, value: Any) -> str:
    """A change in a few words: the last part of the key, and the value."""
    word = short(key.split(".")[-1], LONGEST)
    if value is False:
        return f"no {word}"
    if isinstance(value, dict):
        return f"{word} {' '.join(short(part, LONGEST) for part in value.values())}"
    return f"{word} {short(value, LONGEST)}"


def _slug(name: str) -> str:
    """A name that every file system accepts, and every shell and spreadsheet without quotes."""
    plain = re.sub(r"[^A-Za-z0-9._+-]+", "-", name.replace(", ", "_")).strip("-.") or "base"
    if plain.split(".")[0].upper() in RESERVED:
        plain = f"_{plain}"
    if len(plain) <= MOST_OF_A_NAME:
        return plain
    # Names that begin alike stay different, and are the same when the study is resumed.
    return f"{plain[: MOST_OF_A_NAME - 9]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
