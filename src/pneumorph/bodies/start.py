"""A body to start from: its problem as text, and its parts where it is a body from a file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

from pneumorph import units
from pneumorph.bodies.parts import Part, write_parts
from pneumorph.errors import ComputationError, ProblemError

LEAST = 0.8
"""Thinnest wall, gap and channel that silicone is cast with, mm."""

LARGEST = 2000.0
"""Largest size, mm."""

MOST = 50
"""Largest number of chambers or folds."""


@dataclass(frozen=True)
class Start:
    """A problem to start from, and the body that its file describes.

    Attributes
    ----------
    text : str
        The problem file. FILE and STEP stand for the names of this file and of the one with the body.
    parts : tuple of Part
        Of which the body is made; empty for a tube, which the problem file describes itself.
    """

    text: str
    parts: tuple[Part, ...] = ()

    def write(self, name: str | Path) -> Path:
        """Write the problem file and, where it has one, the STEP file of its body beside it; files that exist stay.

        Parameters
        ----------
        name : path
            Of the problem file; ".toml" is added.

        Returns
        -------
        path
            Of the problem file.

        Raises
        ------
        ProblemError
            If there is a file of this name already, it cannot be written, or the body cannot be made.
        """
        name = Path(name)
        path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
        step = path.with_suffix(".step")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ProblemError(f"{path}: its folder cannot be made ({error.strerror}); give another name") from None
        if self.parts and step.exists():
            raise ProblemError(f"{step}: there is already a file of this name; give another name")
        try:
            with path.open("x", encoding="utf-8") as file:
                file.write(_named(self.text, path, step))
        except FileExistsError:
            raise ProblemError(f"{path}: there is already a file of this name; give another name") from None
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise ProblemError(f"{path}: cannot be written ({why}); give another name") from None
        if self.parts:
            try:
                write_parts(self.parts, step)
            except ComputationError as error:
                path.unlink()
                raise ProblemError(f"{step}: {error}") from None
        return path


def _named(text: str, path: Path, step: Path) -> str:
    """The text of a problem with the names of its files, and a title by the first."""
    title = re.sub(r"[\x00-\x1f\x7f\"\\]", "", path.stem.replace("_", " ")).strip()
    if title:
        titled = f'title = "{title[:1].upper()}{title[1:]}"'
        text = re.sub(r'^title = ".*"$', lambda _: titled, text, flags=re.MULTILINE)
    shown = f'"{path}"' if " " in str(path) else str(path)
    text = re.sub(r"^(#     pneumorph \w+) FILE$", lambda match: f"{match[1]} {shown}", text, flags=re.MULTILINE)
    return text.replace('file = "STEP"', f'file = "{step.name}"')


def sizes_of(**given: Any) -> dict[str, float]:
    """Lengths in mm of lengths with units, by their names.

    Raises
    ------
    ProblemError
        For what is no length, or one that is not above zero and at most `LARGEST`.
    """
    sizes = {name: units.parse_positive(name, value, units.LENGTH) for name, value in given.items()}
    for name, value in sizes.items():
        between(name, value, 0.0, LARGEST)
    return sizes


def count_of(name: str, value: Any, most: int = MOST) -> int:
    """A number of chambers or folds.

    Raises
    ------
    ProblemError
        If it is no whole number from 1 to `most`.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise ProblemError(f"{name}: {value} is not between 1 and {most}; write e.g. {name}=5")
    return value


def between(name: str, value: float, least: float, most: float, why: str = "") -> None:
    """Refuse a size beyond bounds.

    Parameters
    ----------
    name : of the size, as users give it.
    value, least, most : the size and its bounds, mm.
    why : what the bounds are, in words.

    Raises
    ------
    ProblemError
        With the name of the size.
    """
    if least > most:
        raise ProblemError(f"{name}: there is no room for {value:g} mm; make the body larger, or its walls thinner")
    if not least <= value <= most:
        because = f", {why}" if why else ""
        raise ProblemError(f"{name}: {value:g} mm is not between {least:g} and {most:.4g} mm{because}")


def text_with(kind: str, values: Mapping[str, float | str], faces: Mapping[str, float] | None = None) -> str:
    """The text of the problem of a kind.

    Parameters
    ----------
    kind : of the body.
    values : sizes (mm) and other values by their names, rounded to three decimals.
    faces : coordinates of faces of the body, mm, which are not rounded: else it would reach beyond its own envelope.
    """
    text = Path(__file__).with_name(f"{kind}.toml").read_text(encoding="utf-8")
    shown = {name: value if isinstance(value, str) else f"{round(value, 3):g}" for name, value in values.items()}
    exact = {name: f"{value:.15g}" for name, value in (faces or {}).items()}
    return Template(text).substitute(shown | exact)
