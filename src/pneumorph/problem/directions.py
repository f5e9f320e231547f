"""Directions, of any length in the file and of length one after reading."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Strict

from pneumorph.problem.table import InvalidKey

Number = Annotated[float, Strict()]
Direction = tuple[Number, Number, Number]


def unit_vector(key: str, direction: Direction) -> Direction:
    """A direction of length one.

    Raises
    ------
    InvalidKey
        If it has length zero; names the key.
    """
    largest = max(map(abs, direction))
    if largest == 0:
        raise InvalidKey(key, f"has length zero; write e.g. {key} = [0, 0, 1]")
    if math.isclose(math.hypot(*direction), 1.0, rel_tol=1e-12):
        return direction
    # By the largest part first: squares of very small or large numbers leave the range of floats.
    x, y, z = (part / largest for part in direction)
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length
