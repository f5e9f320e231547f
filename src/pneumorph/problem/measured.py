"""Measured curves of bodies: a motion of the tip at pressures, from a text file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.delimited import read_delimited
from pneumorph.units import ANGLE, LENGTH, PRESSURE, Kind, parse

_TITLE = re.compile(
    r"(?P<name>.*?)[\s_]*(?:[(\[]\s*(?P<in>[^()\[\]]+?)\s*[)\]]|_(?P<tail>kpa|m?bar|psi|pa|[cm]?m|deg|rad))?",
    re.IGNORECASE,
)
"""Name and unit of a column."""

EXAMPLE = '"pressure A (kPa), extension (mm)" or "pressure_kPa, bending_y_deg"'

LEAST = 3
"""Points of a curve."""


@dataclass(frozen=True)
class Measured:
    """A measured curve.

    Attributes
    ----------
    pressures : {chamber: (n,)} MPa
        Of the chambers that have a column.
    motion : str
        One of `MOTIONS`.
    values : (n,) mm or rad
    """

    pressures: dict[str, np.ndarray]
    motion: str
    values: np.ndarray


def read_measured(path: Path, chambers: Sequence[str] | None = None) -> Measured:
    """Read a curve from a text file with a line of titles, such as those of `EXAMPLE`.

    Parameters
    ----------
    path : the file.
    chambers : names; a column "pressure" is that of all of them. Without them, as long as they are not known, a column
        of the pressure of a chamber is taken for that of one.

    Raises
    ------
    ProblemError
        If titles or numbers are missing, or units are unknown.
    """
    table = read_delimited(path)
    pressures: dict[str, np.ndarray] = {}
    motions: dict[str, np.ndarray] = {}
    for column, title in enumerate(table.titles):
        name, unit = name_and_unit(title)
        plain = re.sub(r"[\s_]+", "_", name.lower())
        if plain == "pressure" or plain.startswith("pressure_"):
            of = [each for each in chambers or () if plain in ("pressure", f"pressure_{each.lower()}")]
            if chambers is None:
                of = [plain]
            elif not of:
                raise ProblemError(f'{path}: "{title}": there is no such chamber; there are {", ".join(chambers)}')
            pressures |= dict.fromkeys(of, in_units(path, title, unit, PRESSURE) * np.array(table.numbers(column)))
        elif plain in MOTIONS:
            kind = LENGTH if MOTIONS.index(plain) < 3 else ANGLE
            motions[plain] = in_units(path, title, unit, kind) * np.array(table.numbers(column))
    if not pressures or len(motions) != 1:
        found = ", ".join(f'"{title}"' for title in table.titles if title) or "none"
        raise ProblemError(
            f"{path}: needs titles of a pressure and of one motion of {', '.join(MOTIONS)}, such as {EXAMPLE}; "
            f"its titles are {found[:160]}"
        )
    ((motion, values),) = motions.items()
    if len(values) < LEAST:
        count = f"{len(values)} {'point' if len(values) == 1 else 'points'}"
        raise ProblemError(f"{path}: has {count}; give at least {LEAST}")
    return Measured(pressures, motion, values)


def name_and_unit(title: str) -> tuple[str, str]:
    """Name and unit of a column, from "y (mm)", "y [mm]" or "y_mm"; the unit is empty if there is none."""
    match = _TITLE.fullmatch(title.strip())
    return (match["name"].strip(), match["in"] or match["tail"] or "") if match else (title, "")


def in_units(path: Path, title: str, unit: str, kind: Kind) -> float:
    """One of the unit of a title, in that of the code."""
    if not unit:
        raise ProblemError(
            f'{path}: the title "{title}" has no unit; write e.g. "{title} ({kind.example.split()[-1]})"'
        )
    try:
        return parse(f"1 {unit}", kind)
    except ValueError as error:
        raise ProblemError(f'{path}: "{title}": {error}') from None
