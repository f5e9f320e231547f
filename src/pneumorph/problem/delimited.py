"""Tables of numbers in text files as machines write them: any separator and decimal mark, lines before the table."""

from __future__ import annotations

import csv
import math
import re
import stat
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from pneumorph.errors import ProblemError

MOST_BYTES = 20_000_000
"""Largest file that is read."""

LAYOUTS = ((";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (" ", "."), (" ", ","))
"""Separators of columns, each with the decimal mark that goes with it, from the least to the most ambiguous."""

NAMES = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "spaces"}

TRIED = 400
"""Number of lines that decide about the layout."""

UNITS_ROW = re.compile(
    r"[(\[]?\s*(-|1|%|mm/mm|in/in|m/m|[cmµ]?m|in|inch|s|sec|min|°c|[mk]?n|k?n[*·⋅ ]?m?m|m?l|[cm]?m(\^?3|³)|"
    r"lbf?|k?gf|[kmg]?pa|psi|ksi|n/mm(\^?2|²)|deg|°|rad|m?bar)?\s*[)\]]?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Delimited:
    """A table: titles of its columns with their units, and rows (line number, cells).

    Attributes
    ----------
    titles : names of columns; empty ones where there is no header.
    decimal : "." or ",".
    told : how the file was read, in words.
    """

    path: Path
    titles: list[str]
    rows: list[tuple[int, list[str]]]
    decimal: str
    told: str

    def numbers(self, column: int) -> list[float]:
        """The numbers of a column; raises ProblemError with the line of a cell that is none."""
        return [self._number(line, cells[column] if column < len(cells) else "", column) for line, cells in self.rows]

    def _number(self, line: int, cell: str, column: int) -> float:
        value = number(cell, self.decimal)
        if value is None:
            shown = f'"{cell[:40]}" is not a number' if cell else f"column {column + 1} is empty"
            raise ProblemError(f"{self.path}: line {line}: {shown}; give a number or remove the line")
        return value


def read_delimited(path: Path, skip: int = 0) -> Delimited:
    """Read the table of a text file; its first `skip` lines, and lines that begin with #, are left out.

    The layout is the one in which most cells are numbers. The table begins with the first line that has numbers in the
    columns in which most lines have them; the line above is its header, or a row of units below the header.

    Raises
    ------
    ProblemError
        One line: the file, what is wrong, and how to fix it.
    """
    text, encoding = _text(path)
    lines = [
        (n, line)
        for n, line in enumerate(text.splitlines(), start=1)
        if n > skip and line.strip(" \t,;") and not line.startswith("#")
    ]
    if not lines:
        raise ProblemError(f"{path}: is empty; give one measured point in each line under a line of titles")
    sample = [line for _, line in lines[-TRIED:]]
    separator, decimal = max(LAYOUTS, key=lambda layout: _score(sample, *layout))
    rows = [(n, _cells(line, separator)) for n, line in lines]
    patterns = [_pattern(cells, decimal) for _, cells in rows]
    usual = Counter(pattern for pattern in patterns if len(pattern) > 1).most_common(1)
    if not usual:
        raise ProblemError(f"{path}: has no table of numbers in two columns; save it as CSV with a line of titles")
    start = next(k for k, pattern in enumerate(patterns) if set(usual[0][0]) <= set(pattern))
    titles = _titles([cells for _, cells in rows[:start]], max(usual[0][0]) + 1)
    mark = "point" if decimal == "." else "comma"
    told = f"{encoding}, columns separated by {NAMES[separator]}, decimal {mark}, numbers from line {rows[start][0]}"
    return Delimited(path, titles, rows[start:], decimal, told)


def number(cell: str, decimal: str) -> float | None:
    """The finite number in a cell, with thousands marked by the other mark; None if it is not one."""
    plain = cell.strip().strip("\"'").replace("\u2212", "-").strip()
    other = "," if decimal == "." else "."
    if re.fullmatch(rf"[+-]?\d{{1,3}}(\{other}\d{{3}})+\{decimal}\d+", plain):
        plain = plain.replace(other, "")
    if other in plain or "_" in plain:
        return None
    try:
        value = float(plain.replace(decimal, "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _text(path: Path) -> tuple[str, str]:
    """The text of a file and its encoding."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise ProblemError(f"{path}: is not a file with data; give a CSV or text file")
        if status.st_size > MOST_BYTES:
            limit = MOST_BYTES // 10**6
            raise ProblemError(f"{path}: has more than {limit} MB; keep only the points of the test")
        with path.open("rb") as file:
            data = file.read(MOST_BYTES)
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except OSError as error:
        raise ProblemError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    tried = ("utf-16",) if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "cp1252", "latin-1")
    for encoding in tried:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, {"utf-8-sig": "UTF-8", "utf-16": "UTF-16"}.get(encoding, "Latin-1")
        break
    raise ProblemError(f"{path}: is not a text file; export the test as CSV or text")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [cell.strip().strip('"') for cell in line.split(separator)]


def _pattern(cells: list[str], decimal: str) -> tuple[int, ...]:
    """Indices of the cells that are numbers."""
    return tuple(k for k, cell in enumerate(cells) if number(cell, decimal) is not None)


def _score(lines: list[str], separator: str, decimal: str) -> int:
    score = 0
    for line in lines:
        cells = _cells(line, separator)
        numbers = len(_pattern(cells, decimal))
        if numbers > 1:
            score += 2 * numbers - sum(1 for cell in cells if cell)
    return score


def _titles(above: list[list[str]], width: int) -> list[str]:
    """Titles from the header over a table, joined with a row of units between them."""
    wide = [cells + [""] * (width - len(cells)) for cells in above if sum(bool(cell) for cell in cells) > 1]
    # A header stands directly above its table.
    if not wide or sum(bool(cell) for cell in above[-1]) < 2:
        return [""] * width
    if len(wide) > 1 and all(UNITS_ROW.fullmatch(cell) for cell in wide[-1]):
        return [_with_unit(name, unit.strip(" ()[]")) for name, unit in zip(wide[-2], wide[-1], strict=False)]
    return wide[-1]


def _with_unit(title: str, unit: str) -> str:
    """A title with its unit, once where it has it already."""
    has_it = re.search(r"[(\[]\s*" + re.escape(unit) + r"\s*[)\]]\s*$", title, re.IGNORECASE)
    return f"{title} [{unit}]" if unit and not has_it else title
