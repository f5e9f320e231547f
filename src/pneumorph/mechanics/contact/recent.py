"""What was computed for the last places, which line searches and tangents ask for again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

Found = TypeVar("Found")


class Recent(Generic[Found]):
    """A function of places (N, 3) with its last two values."""

    def __init__(self, compute: Callable[[np.ndarray], Found]):
        self._compute = compute
        self._last: list[tuple[np.ndarray, Found]] = []

    def __call__(self, x: np.ndarray) -> Found:
        for places, value in self._last:
            if np.array_equal(places, x):
                return value
        value = self._compute(x)
        self._last = [*self._last[-1:], (np.array(x), value)]
        return value
