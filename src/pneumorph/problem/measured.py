"""Measured curves of bodies at pressures, from a text file: a motion of the tip, what it pushes with, or a volume."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem.components import MOTIONS, PUSHES
from pneumorph.problem.delimited import Delimited, read_delimited
from pneumorph.problem.quantities import FILLED, VOLUME_OF, kind_of
from pneumorph.units import PRESSURE, Kind, parse

_TITLE = re.compile(
    r"(?P<name>.*?)[\s_]*(?:[(\[]\s*(?P<in>[^()\[\]]+?)\s*[)\]]|_(?P<tail>kpa|m?bar|psi|pa|[cm]?m|deg|rad|m?l|[cm]m3|n[_*]?mm|n))?",
    re.IGNORECASE,
)
"""Name and unit of a column."""

_WRITTEN = {"mm3": "mm^3", "cm3": "cm^3", "n_mm": "N*mm", "nmm": "N*mm"}
"""Units as titles of machines have them."""

EXAMPLE = '"pressure A (kPa), extension (mm)" or "pressure_kPa, bending_y_deg"'

OTHERS = '"push_extension (N)", "volume A (ml)" or "filled A (ml)"'
"""Titles of curves of forces and volumes."""

LEAST = 3
"""Points of a curve."""


@dataclass(frozen=True)
class Measured:
    """A measured curve.

    Attributes
    ----------
    pressures : {chamber: (n,)} MPa
        Of the chambers that have a column.
    quantity : str
        A motion of the tip, what it pushes with where it is held, or a volume; see `problem/quantities.py`.
    values : (n,) mm and rad, N and N·mm, mm³
    """

    pressures: dict[str, np.ndarray]
    quantity: str
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
    found: dict[str, np.ndarray] = {}
    told = list[str]()
    for column, title in enumerate(table.titles):
        name, unit = name_and_unit(title)
        plain = re.sub(r"[\s_]+", "_", name.lower())
        if plain == "pressure" or plain.startswith("pressure_"):
            of = _chambers_of(path, title, plain, "pressure", chambers)
            pressures |= dict.fromkeys(of, _values(path, title, unit, table, column, PRESSURE))
        elif (before := f"{plain.partition('_')[0]}_") in (VOLUME_OF, FILLED):
            of = _chambers_of(path, title, plain, before.rstrip("_"), chambers)
            if len(of) > 1:
                chosen = f'"{name} {of[0]}"; there are {", ".join(of)}'
                raise ProblemError(f'{path}: "{title}": is of one chamber; name it, such as {chosen}')
            found[before + of[0]] = _values(path, title, unit, table, column, kind_of(before))
            told.append(f'"{title}"')
        elif plain in MOTIONS or plain in PUSHES:
            found[plain] = _values(path, title, unit, table, column, kind_of(plain))
            told.append(f'"{title}"')
    if len(found) > 1:
        raise ProblemError(f"{path}: has {' and '.join(told)}; only one of them is compared, so leave out the others")
    if not pressures or not found:
        titles = ", ".join(f'"{title}"' for title in table.titles if title) or "none"
        raise ProblemError(
            f"{path}: needs titles of a pressure and of one motion of {', '.join(MOTIONS)}, such as {EXAMPLE}, or of "
            f"one force or volume, such as {OTHERS}; its titles are {titles[:160]}"
        )
    ((quantity, values),) = found.items()
    if len(values) < LEAST:
        count = f"{len(values)} {'point' if len(values) == 1 else 'points'}"
        raise ProblemError(f"{path}: has {count}; give at least {LEAST}")
    return Measured(pressures, quantity, values)


def _values(path: Path, title: str, unit: str, table: Delimited, column: int, kind: Kind) -> np.ndarray:
    """The values (n,) of a column."""
    return in_units(path, title, unit, kind) * np.array(table.numbers(column))


def _chambers_of(path: Path, title: str, plain: str, kind: str, chambers: Sequence[str] | None) -> list[str]:
    """The chambers that a column is of."""
    if chambers is None:
        return [plain]
    of = [each for each in chambers if plain in (kind, f"{kind}_{each.lower()}")]
    if not of:
        raise ProblemError(f'{path}: "{title}": there is no such chamber; there are {", ".join(chambers)}')
    return of


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
        return parse(f"1 {_WRITTEN.get(unit.lower(), unit)}", kind)
    except ValueError as error:
        raise ProblemError(f'{path}: "{title}": {error}') from None
