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

import re
import tomllib
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import tomli_w

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, loads
from pneumorph.problem.changes import change

MOST_MEMBERS = 1000


@dataclass(frozen=True)
class Member:
    """One design of a study: its name, which is also its directory's, its changes to the base, and its problem."""

    name: str
    changes: Mapping[str, Any]
    problem: Problem


@dataclass(frozen=True)
class Study:
    """A study: its title and its members."""

    title: str
    members: tuple[Member, ...]


def load_study(path: str | Path) -> Study:
    """Read a study file and build the problem of every member.

    Raises
    ------
    ProblemError
        If the file or one of the problems has a mistake.
    """
    path = Path(path)
    data = _table(path)
    for key in data:
        if key not in ("title", "base", "grid", "member"):
            raise ProblemError(f"{path}: {key}: is not a key of a study; use title, base, grid or member")
    grid, listed = data.get("grid", {}), data.get("member", [{}])
    if not isinstance(grid, dict) or not all(isinstance(values, list) and values for values in grid.values()):
        raise ProblemError(f'{path}: grid: needs a list of values for every key, e.g. "body.length" = ["80 mm"]')
    if not isinstance(listed, list) or not all(isinstance(member, dict) for member in listed):
        raise ProblemError(f"{path}: member: is a table that may be repeated; write [[member]]")
    if "grid" not in data and "member" not in data:
        raise ProblemError(f"{path}: has neither a [grid] nor a [[member]]; add the changes that make the designs")
    count = len(listed)
    for values in grid.values():
        count *= len(values)
    if count > MOST_MEMBERS:
        raise ProblemError(f"{path}: makes {count} designs, more than {MOST_MEMBERS}; shorten the lists")
    members = tuple(_members(path, data.get("base"), grid, listed))
    names = [member.name for member in members]
    for name in names:
        if names.count(name) > 1:
            raise ProblemError(f'{path}: two members are called "{name}"; give every [[member]] a name of its own')
    return Study(str(data.get("title", path.stem)), members)


def _members(path: Path, base: Any, grid: dict[str, list], listed: list[dict]) -> Iterator[Member]:
    bases: dict[str, dict[str, Any]] = {}
    for index, entry in enumerate(listed):
        where = f"{path}: member[{index}]"
        for key in entry:
            if key not in ("name", "base", "set"):
                raise ProblemError(f"{where}.{key}: is not a key of a member; use name, base or set")
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
            parts = [str(entry["name"])] if "name" in entry else [_named(own)] if own else []
            name = _slug(", ".join([*parts, *(_in_words(key, value) for key, value in zip(grid, values, strict=True))]))
            problem = deepcopy(bases[source])
            try:
                for key, value in changes.items():
                    change(problem, key, value)
                folder = (path.parent / source).parent
                yield Member(name, changes, loads(tomli_w.dumps(problem), folder=folder))
            except ProblemError as error:
                raise ProblemError(f"{path}, {name}: {error}") from None


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ProblemError(f"{path}: cannot be read ({error}); check the path") from None
    except tomllib.TOMLDecodeError as error:
        raise ProblemError(f"{path}: is not TOML ({error}); fix it there") from None


def _named(changes: Mapping[str, Any]) -> str:
    return ", ".join(_in_words(key, value) for key, value in changes.items())


def _in_words(key: str, value: Any) -> str:
    """A change in a few words: the last part of the key, and the value."""
    word = key.split(".")[-1]
    if value is False:
        return f"no {word}"
    if isinstance(value, dict):
        return f"{word} {' '.join(str(part) for part in value.values())}"
    return f"{word} {value}"


def _slug(name: str) -> str:
    """A name that every file system accepts, and every shell and spreadsheet without quotes."""
    return re.sub(r"[^A-Za-z0-9._+-]+", "-", name.replace(", ", "_")).strip("-.") or "base"
