"""Measured centre lines of beams: points from a text file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem.delimited import read_delimited
from pneumorph.problem.measured import in_units, name_and_unit
from pneumorph.units import LENGTH

EXAMPLE = '"x (mm), y (mm)"'

FEWEST = 2
"""Points of a line beyond the clamp."""


def read_line(path: Path) -> np.ndarray:
    """Points (n, 2) of a centre line in mm: horizontal distances from the clamp, and depths below it.

    The first row is the point at the clamp, which is not among them. The other points are on either side of it, and y
    may point up or down: the tip hangs lower than the clamp.

    Raises
    ------
    ProblemError
        If titles, numbers or units are missing, or there are too few points.
    """
    table = read_delimited(path)
    columns = {}
    for column, title in enumerate(table.titles):
        name, unit = name_and_unit(title)
        if name.lower() in ("x", "y"):
            columns[name.lower()] = in_units(path, title, unit, LENGTH) * np.array(table.numbers(column))
    if len(columns) < 2:
        found = ", ".join(f'"{title}"' for title in table.titles if title) or "none"
        raise ProblemError(
            f"{path}: needs columns of x and y with their unit, such as {EXAMPLE}; its titles are {found}"
        )
    points = np.column_stack([columns["x"], columns["y"]])
    if len(points) < FEWEST + 1:
        raise ProblemError(f"{path}: has {len(points)} points; give the one at the clamp and at least {FEWEST} more")
    points = points[1:] - points[0]
    tip = points[-1]
    return points * [1.0 if tip[0] >= 0 else -1.0, 1.0 if tip[1] >= 0 else -1.0]
