"""Standard deviations of what a workshop cannot repeat exactly, as they are given to commands and functions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pneumorph.errors import ProblemError
from pneumorph.problem.sources import MOST_DEVIATION
from pneumorph.units import ANGLE, LENGTH, PRESSURE, Kind, parse, text_of

KINDS: Mapping[str, Kind | None] = {
    "rubber": None,
    "pressure": replace(PRESSURE, example="1 kPa"),
    "wall": replace(LENGTH, example="0.1 mm"),
    "shift": replace(LENGTH, example="0.2 mm"),
    "tilt": replace(ANGLE, example="0.2 deg"),
    "scale": None,
    "load": None,
}
"""What every deviation is; None for those that are relative."""

RELATIVE = {"rubber": "10 %", "scale": "0.3 %", "load": "5 %"}
"""Examples of those."""


def read_deviations(given: Mapping[str, Any]) -> dict[str, Any]:
    """Deviations in the units of the code from text or pint quantities, "0.1 mm" or "10 %".

    Raises
    ------
    ProblemError
        If one is unknown, is not a quantity of its kind, is negative, or too large to tell anything.
    """
    for name in given:
        if name not in KINDS:
            raise ProblemError(f"{name}: is no tolerance; use {', '.join(KINDS)}")
    return {name: _read(name, text) for name, text in given.items()}


def _read(name: str, text: Any) -> float:
    kind = KINDS[name]
    if kind is not None:
        try:
            value = parse(text, kind)
        except ValueError as error:
            raise ProblemError(f"{name}: {error}") from None
    else:
        written = str(text_of(text)).strip()
        try:
            if not written.endswith("%"):
                raise ValueError
            value = 0.01 * float(written[:-1])
            if math.isnan(value):
                raise ValueError
        except ValueError:
            raise ProblemError(f'{name}: "{text}" is not a percentage; write e.g. "{RELATIVE[name]}"') from None
        if not value <= MOST_DEVIATION:
            raise ProblemError(
                f"{name}: {text} is more than first derivatives can tell; give at most {100 * MOST_DEVIATION:.0f} %"
            )
    if not value >= 0.0:
        raise ProblemError(f"{name}: {text} is negative; a standard deviation is not")
    return value
