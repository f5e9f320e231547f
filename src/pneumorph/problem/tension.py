"""Files of tension tests: which column is the stretch, which the stress, and what they are in mm and MPa."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem.delimited import Delimited, read_delimited
from pneumorph.problem.pulls import first_loadings

FEWEST = 5
"""Fewest points of a test: fewer show no curve."""

STRESS_UNITS = {
    "pa": 1e-6, "kpa": 1e-3, "mpa": 1.0, "gpa": 1e3, "n/mm2": 1.0, "n/mm^2": 1.0, "n/mm²": 1.0, "psi": 6.894757293e-3,
    "ksi": 6.894757293,
}  # fmt: skip
"""Value of each unit in MPa."""

FORCE_UNITS = {"n": 1.0, "kn": 1e3, "mn": 1e-3, "lbf": 4.4482216, "lb": 4.4482216, "kgf": 9.80665, "gf": 9.80665e-3}
"""Value of each unit in N; mN in whatever case it is written."""

LENGTH_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "in": 25.4, "inch": 25.4, "µm": 1e-3, "um": 1e-3}
"""Value of each unit in mm."""

STRAIN_UNITS = {"%": "percent", "percent": "percent", "mm/mm": "strain", "in/in": "strain", "m/m": "strain",
                "1": "strain", "-": "strain"}  # fmt: skip

STRETCHES = r"stretch|lambda|λ|extension ratio|streckverhältnis|verstreckung"
STRAINS = r"strain|dehnung|elongation|dilatation|déformation|deformation|epsilon|ε|eps"
DISPLACEMENTS = r"displacement|extension|crosshead|travel|position|elongation|standardweg|traversenweg|weg|verlängerung"
STRESSES = r"stress|spannung|contrainte|sigma|σ"
FORCES = r"force|load|standardkraft|kraft"
TRUE = r"true|cauchy|wahre?|logarithmi\w*|hencky|log"
NOMINAL = r"nominal|nominell\w*|engineering|eng|technisch\w*|piola"
OTHER = r"rate|time|transverse|lateral|quer\w*|width|modulus|speed|geschwindigkeit|energy|break|bruch|zeit"

LARGEST = 15.0
"""Stretch beyond which a plain strain is taken for one in per cent: no rubber bears it."""


@dataclass(frozen=True)
class Reading:
    """What a user says about a file.

    Attributes
    ----------
    strain_column, stress_column : title or number (from 1) of a column.
    skip : number of lines left out at the start.
    strain : stretch, strain, percent or true: what the column of strain holds.
    stress : nominal or true.
    stress_unit : unit of the column of stress.
    gauge_length : mm, for files of displacement.
    area : mm² of the undeformed section, for files of force.
    """

    strain_column: str | None = None
    stress_column: str | None = None
    skip: int = 0
    strain: str | None = None
    stress: str | None = None
    stress_unit: str | None = None
    gauge_length: float | None = None
    area: float | None = None


@dataclass(frozen=True, eq=False)
class Tension:
    """Stretches (n,) and nominal stresses (n,) in MPa, sorted by stretch, and how the file was read, line by line."""

    stretch: np.ndarray
    stress: np.ndarray
    told: tuple[str, ...]


@dataclass(frozen=True)
class Column:
    """A recognised column: its index, title, kind and unit."""

    index: int
    title: str
    kind: str
    unit: str

    def __str__(self) -> str:
        return f'column {self.index + 1} "{self.title}"' if self.title else f"column {self.index + 1}"


def read_tension(path: Path, reading: Reading = Reading()) -> Tension:
    """Read stretch and nominal stress of a test from the file of a machine.

    Columns are found by their titles, English or German, with units in the titles or in a row below.

    Raises
    ------
    ProblemError
        One line: the file, what is wrong, and how to fix it.
    """
    table = read_delimited(path, reading.skip)
    columns = [column for k, title in enumerate(table.titles) if (column := _recognised(k, title))]
    along = _along(table, columns, reading)
    across = _across(table, columns, reading)
    stretch = _stretch(table, along, reading)
    stress, how = _stress(table, across, stretch, reading)
    _check(path, stretch, stress)
    kept, left_out = first_loadings(stretch, stress)
    if np.count_nonzero(kept) < FEWEST:
        raise ProblemError(f"{path}: {left_out[0]}, too few are left; give the lines of the first loading alone")
    stretch, stress = stretch[kept], stress[kept]
    _check(path, stretch, stress)
    order = np.argsort(stretch, kind="stable")
    ends = f"{stretch.min():.4g} to {stretch.max():.4g}"
    told = (
        table.told,
        f"stretch {ends} from {along}, read as {_word(along.kind)}",
        f"nominal stress {stress.min():.4g} to {stress.max():.4g} MPa from {across}, read as {how}",
        *left_out,
    )
    return Tension(stretch[order], stress[order], told)


def _word(kind: str) -> str:
    return {"percent": "strain in per cent", "true": "logarithmic strain", "displacement": "displacement"}.get(
        kind, kind
    )


def _recognised(index: int, title: str) -> Column | None:
    """What a column holds, by its title."""
    name, unit = _split(title)
    if _has(OTHER, name):
        return None
    if _has(STRETCHES, name):
        return Column(index, title, "stretch", "")
    length = unit in LENGTH_UNITS
    if _has(STRAINS, name) and not length:
        kind = "true" if _has(TRUE, name) else STRAIN_UNITS.get(unit, "strain")
        return Column(index, title, kind, unit)
    if length and _has(f"{DISPLACEMENTS}|{STRAINS}", name):
        return Column(index, title, "displacement", unit)
    if _has(STRESSES, name):
        kind = "true stress" if _has(TRUE, name) else "nominal stress" if _has(NOMINAL, name) else "stress"
        return Column(index, title, kind, unit)
    return Column(index, title, "force", unit) if _has(FORCES, name) else None


def _has(words: str, name: str) -> bool:
    return re.search(rf"(?<![^\W\d_])({words})(?![^\W\d_])", name) is not None


def _split(title: str) -> tuple[str, str]:
    """Name and unit of a title in lower case: "Tensile strain (mm/mm)", "strain_%", "stress N/mm^2"."""
    plain = title.lower().replace("μ", "µ").strip()
    bracket = re.fullmatch(r"(.*?)[\s_,/]*[(\[{]\s*([^()\[\]{}]*?)\s*[)\]}]", plain)
    if bracket:
        return bracket[1].replace("_", " "), bracket[2]
    units = sorted({**STRESS_UNITS, **FORCE_UNITS, **LENGTH_UNITS, **STRAIN_UNITS}, key=len, reverse=True)
    tail = re.fullmatch(rf"(.*?)(?:[\s_,/]+({'|'.join(map(re.escape, units))})|(%))", plain)
    if tail:
        return tail[1].replace("_", " "), tail[2] or tail[3]
    named = re.fullmatch(r"(.*stress)[\s_,/]+(\S+)", plain)
    return (named[1].replace("_", " "), named[2]) if named else (plain.replace("_", " "), "")


def _along(table: Delimited, columns: list[Column], reading: Reading) -> Column:
    if reading.strain_column is not None:
        column = _named(table, reading.strain_column, "--strain-column")
        known = next((one for one in columns if one.index == column), None)
        if known and known.kind in ("stretch", "strain", "percent", "true", "displacement"):
            return Column(column, known.title, reading.strain or known.kind, known.unit)
        if reading.strain is None:
            raise ProblemError(
                f"{table.path}: {Column(column, table.titles[column], '', '')} does not say what it holds; "
                "add --strain stretch, strain, percent or true"
            )
        return Column(column, table.titles[column], reading.strain, "")
    strains = [one for one in columns if one.kind in ("stretch", "strain", "percent", "true")]
    wanted = [one for one in strains if (one.kind == "true") == (reading.strain == "true")] or strains
    lengths = [one for one in columns if one.kind == "displacement"]
    column = _only(table, wanted or lengths, "stretch or strain", "--strain-column")
    if reading.strain and column.kind != "displacement":
        return Column(column.index, column.title, reading.strain, column.unit)
    return column


def _across(table: Delimited, columns: list[Column], reading: Reading) -> Column:
    if reading.stress_column is not None:
        column = _named(table, reading.stress_column, "--stress-column")
        known = next((one for one in columns if one.index == column), None)
        if known and (known.kind.endswith("stress") or known.kind == "force"):
            return known
        return Column(column, table.titles[column], "stress", _split(table.titles[column])[1])
    stresses = [one for one in columns if one.kind.endswith("stress")]
    true = [one for one in stresses if one.kind == "true stress"]
    others = [one for one in stresses if one.kind != "true stress"]
    wanted = (true if reading.stress == "true" and true else others) or true
    forces = [one for one in columns if one.kind == "force"]
    return _only(table, wanted or forces, "stress or force", "--stress-column")


def _only(table: Delimited, columns: list[Column], wanted: str, option: str) -> Column:
    if len(columns) == 1:
        return columns[0]
    titles = ", ".join(f'{k} "{title}"' for k, title in enumerate(table.titles, start=1))[:160]
    if not any(table.titles):
        raise ProblemError(
            f"{table.path}: has no line of titles above its numbers; write one, e.g. "
            '"stretch, nominal stress (MPa)", or give --strain-column and --stress-column by number'
        )
    count = "more than one column" if columns else "no column"
    raise ProblemError(f"{table.path}: has {count} for {wanted} among {titles}; give {option} by number")


def _named(table: Delimited, wanted: str, option: str) -> int:
    """Index of a column given by its title or its number."""
    same = [k for k, title in enumerate(table.titles) if title and wanted.strip().lower() == title.lower()]
    alike = same or [k for k, title in enumerate(table.titles) if title and wanted.strip().lower() in title.lower()]
    if wanted.isdecimal() and len(wanted) < 6 and 1 <= int(wanted) <= len(table.titles):
        return int(wanted) - 1
    if len(alike) != 1:
        titles = ", ".join(f'{k} "{title}"' for k, title in enumerate(table.titles, start=1))[:160]
        wrong = "more than one column is" if alike else "no column is"
        raise ProblemError(f'{option}: {wrong} called "{wanted[:40]}" in {table.path}; give one by number: {titles}')
    return alike[0]


def _stretch(table: Delimited, column: Column, reading: Reading) -> np.ndarray:
    values = np.array(table.numbers(column.index))
    if column.kind == "displacement":
        if reading.gauge_length is None:
            raise ProblemError(f'{table.path}: {column} is a displacement; add --gauge-length, e.g. "25 mm"')
        return 1.0 + LENGTH_UNITS[column.unit] * values / reading.gauge_length
    stretch = {
        "stretch": lambda: values,
        "strain": lambda: 1.0 + values,
        "percent": lambda: 1.0 + 0.01 * values,
        "true": lambda: np.exp(np.minimum(values, 50.0)),
    }[column.kind]()
    if stretch.max() > LARGEST and (column.kind != "stretch" or reading.strain != "stretch"):
        fix = (
            "if it is in per cent, add --strain percent or call it strain (%)"
            if column.kind != "percent"
            else "if it is not in per cent, add --strain strain or --strain stretch"
        )
        raise ProblemError(f"{table.path}: {column} gives stretches up to {stretch.max():.4g}; {fix}")
    return stretch


def _stress(table: Delimited, column: Column, stretch: np.ndarray, reading: Reading) -> tuple[np.ndarray, str]:
    """Nominal stresses (n,) in MPa, and what they were read as."""
    unit = (reading.stress_unit or column.unit).strip().lower()
    units = FORCE_UNITS if column.kind == "force" else STRESS_UNITS
    if unit not in units:
        wrong = f'"{unit[:20]}" is not a known unit' if unit else f"{column} has no unit"
        raise ProblemError(
            f"{table.path}: {wrong}; write it into the title or add --stress-unit, one of {', '.join(units)}"
        )
    values = units[unit] * np.array(table.numbers(column.index))
    if column.kind == "force":
        if reading.area is None:
            raise ProblemError(f'{table.path}: {column} is a force; add --section, e.g. "4 mm x 2 mm"')
        return values / reading.area, f"force over {reading.area:g} mm²"
    kind = reading.stress or column.kind.removesuffix("stress").strip()
    if not kind:
        raise ProblemError(
            f"{table.path}: {column} does not say whether its stress is nominal (force over the undeformed section) or "
            "true; add --stress nominal or --stress true"
        )
    # Without a change of volume the section of every mode shrinks as 1/λ along the pull.
    return (values / stretch, "true stress") if kind == "true" else (values, "nominal stress")


def _check(path: Path, stretch: np.ndarray, stress: np.ndarray) -> None:
    if len(stretch) < FEWEST:
        raise ProblemError(f"{path}: has {len(stretch)} points; give at least {FEWEST}")
    if stretch.min() <= 0:
        raise ProblemError(f"{path}: a stretch of {stretch.min():g} is not positive; is the column a strain?")
    if not stretch.max() > 1.0:
        raise ProblemError(f"{path}: no stretch is above 1, so this is not a tension test; is the column a strain?")
    if not stress.max() > 0:
        raise ProblemError(f"{path}: no stress is positive; give tensile stress as positive")
