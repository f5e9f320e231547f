"""`pneumorph new`: write a commented problem file to start from."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from pneumorph import units
from pneumorph.cad.bodies import Dome, Pneunet, write_step
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.problem.starts import KINDS, SOLIDS, text_of

BODIES = {"pneunet": Pneunet, "dome": Dome}

MOST = {"int": 50, "float": 2000.0}
"""Largest number of chambers, and size in mm."""


def new(name: Path, kind: str, sizes: Sequence[str] = ()) -> None:
    """Write the problem file of a kind, and the STEP file of its body where it has one; files that exist stay.

    Parameters
    ----------
    name : Path
        Of the problem file; ".toml" is added.
    kind : str
        One of `KINDS` and `SOLIDS`.
    sizes : sequence of "key=value"
        Of a body of `SOLIDS`.

    Raises
    ------
    ProblemError
        If there is no such kind or size, there is a file of this name already, or it cannot be written.
    """
    if kind not in (*KINDS, *SOLIDS):
        raise ProblemError(f'--kind: "{kind}" is not known; use one of {", ".join((*KINDS, *SOLIDS))}')
    if sizes and kind in KINDS:
        raise ProblemError(f'--size: is for {" and ".join(SOLIDS)}; change the file of a "{kind}" instead')
    body = None if kind in KINDS else _body(kind, sizes)
    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    title = re.sub(r"[\x00-\x1f\x7f\"\\]", "", path.stem.replace("_", " ")).strip()
    text = text_of(kind)
    if title:
        text = re.sub(
            r'^title = ".*"$', lambda _: f'title = "{title[:1].upper()}{title[1:]}"', text, flags=re.MULTILINE
        )
    shown = f'"{path}"' if " " in str(path) else str(path)
    text = re.sub(r"^(#     pneumorph \w+) FILE$", lambda found: f"{found[1]} {shown}", text, flags=re.MULTILINE)
    step = path.with_suffix(".step")
    text = text.replace('file = "STEP"', f'file = "{step.name}"')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ProblemError(f"{path}: its folder cannot be made ({error.strerror}); give another name") from None
    if body is not None and step.exists():
        raise ProblemError(f"{step}: there is already a file of this name; give another name")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ProblemError(f"{path}: there is already a file of this name; give another name") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ProblemError(f"{path}: cannot be written ({why}); give another name") from None
    if body is not None:
        try:
            write_step(body, step)
        except (ValueError, ComputationError) as error:
            path.unlink()
            raise ProblemError(f"--size: {error}") from None
    print(f"written to {path}; change it, then: pneumorph check {shown}")


def _body(kind: str, sizes: Sequence[str]) -> Pneunet | Dome:
    """The body of a kind with sizes as "key=value"."""
    known = {field.name: field.type for field in fields(BODIES[kind])}
    given: dict[str, float | int] = {}
    for size in sizes:
        key, equals, value = size.partition("=")
        if not equals or key not in known:
            raise ProblemError(f"--size {size}: is not a size of a {kind}; use one of {', '.join(known)}, as wall=2mm")
        try:
            given[key] = int(value) if known[key] == "int" else units.parse(value, units.LENGTH)
        except ValueError as error:
            raise ProblemError(f"--size {size}: {error}") from None
        if not 0 < given[key] <= MOST[str(known[key])]:
            raise ProblemError(f"--size {size}: is not between 0 and {MOST[str(known[key])]}")
    return BODIES[kind](**given)
