"""Directions, of any length in the file and of length one after reading."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import AfterValidator, Strict, ValidationInfo

Number = Annotated[float, Strict()]
Vector = tuple[Number, Number, Number]


def _of_length_one(direction: Vector, info: ValidationInfo) -> Vector:
    largest = max(map(abs, direction))
    if largest == 0:
        raise ValueError(f"has length zero; write e.g. {info.field_name} = [0, 0, 1]")
    if math.isclose(math.hypot(*direction), 1.0, rel_tol=1e-12):
        return direction
    # By the largest part first: squares of very small or large numbers leave the range of floats.
    x, y, z = (part / largest for part in direction)
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


Direction = Annotated[Vector, AfterValidator(_of_length_one)]
