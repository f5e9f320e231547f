"""Files of uniaxial tension tests: two columns of numbers under a header that names them and the unit of stress."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from pneumorph.errors import ProblemError

FEWEST = 5
STRESSES = {"pa": 1e-6, "kpa": 1e-3, "mpa": 1.0, "n/mm2": 1.0, "n/mm^2": 1.0}
"""Value of each unit in MPa."""

FIX = 'write e.g. "stretch, nominal_stress_MPa" in the first line'


def read_tension(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read stretches (n,) and nominal stresses (n,) in MPa from a CSV file, sorted by stretch.

    Columns are separated by commas, semicolons or tabs; lines that begin with # are comments. One column is called
    `stretch`, `strain` or `strain_%`, another `stress` with its unit (Pa, kPa, MPa); both names may contain nominal or
    engineering. Other columns are ignored.

    Raises
    ------
    ProblemError
        One line: the file, what is wrong, and how to fix it.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except UnicodeDecodeError:
        raise ProblemError(f"{path}: is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise ProblemError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    rows = [(n, line) for n, line in enumerate(lines, start=1) if line.strip(" \t,;") and not line.startswith("#")]
    if not rows:
        raise ProblemError(f"{path}: is empty; {FIX} and one measured point in each line after it")
    (_, header), *points = rows
    separator = max(",;\t", key=header.count)
    titles = [title.strip().strip('"') for title in header.split(separator)]
    strains = [(index, kind) for index, title in enumerate(titles) if (kind := _strain(title))]
    stresses = [(index, unit) for index, title in enumerate(titles) if (unit := _stress(title, path))]
    if len(strains) != 1 or len(stresses) != 1:
        wanted = "stretch or strain" if len(strains) != 1 else "nominal stress"
        count = "no column" if not (strains if len(strains) != 1 else stresses) else "more than one column"
        raise ProblemError(f"{path}: has {count} for {wanted} in its header ({', '.join(titles)}); {FIX}")
    (at_strain, kind), (at_stress, unit) = strains[0], stresses[0]
    values = np.array(
        [
            [_number(path, number, line.split(separator), index) for index in (at_strain, at_stress)]
            for number, line in points
        ]
    ).reshape(-1, 2)
    stretch = {"stretch": values[:, 0], "strain": 1.0 + values[:, 0], "percent": 1.0 + 0.01 * values[:, 0]}[kind]
    stress = STRESSES[unit] * values[:, 1]
    _check(path, stretch, stress)
    order = np.argsort(stretch, kind="stable")
    return stretch[order], stress[order]


def _plain(title: str) -> str:
    """A title in lower case, without words and characters that do not matter."""
    return re.sub(r"nominal|engineering|eng\.?|uniaxial|[\s_()\[\]-]", "", title.lower())


def _strain(title: str) -> str | None:
    plain = _plain(title).removesuffix("mm/mm").removesuffix("/1").rstrip("/,")
    return {"stretch": "stretch", "strain": "strain", "strain%": "percent", "strain/%": "percent"}.get(plain)


def _stress(title: str, path: Path) -> str | None:
    plain = _plain(title)
    if not plain.startswith("stress"):
        return None
    unit = plain.removeprefix("stress").lstrip("/,")
    if unit not in STRESSES:
        wrong = f'"{unit}" is not a known unit of stress' if unit else f'the column "{title}" has no unit'
        raise ProblemError(f"{path}: {wrong}; {FIX}, or kPa")
    return unit


def _number(path: Path, line: int, cells: list[str], index: int) -> float:
    text = cells[index].strip() if index < len(cells) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = f'"{text}" is not a number' if text else f"column {index + 1} is empty"
        raise ProblemError(f"{path}: line {line}: {shown}; give a number or remove the line")
    return value


def _check(path: Path, stretch: np.ndarray, stress: np.ndarray) -> None:
    if len(stretch) < FEWEST:
        raise ProblemError(f"{path}: has {len(stretch)} points; give at least {FEWEST}")
    if stretch.min() <= 0:
        raise ProblemError(f"{path}: a stretch of {stretch.min():g} is not positive; is the column a strain?")
    if not stretch.max() > 1.0:
        raise ProblemError(f"{path}: no stretch is above 1, so this is not a tension test; is the column a strain?")
    if not stress.max() > 0:
        raise ProblemError(f"{path}: no stress is positive; give tensile stress as positive")
