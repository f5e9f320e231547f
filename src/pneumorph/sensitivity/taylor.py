"""Taylor test: along any direction a right gradient leaves a remainder that falls as the square of the step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class TaylorTest:
    """Remainders |J(x + h d) − J(x) − h dJ·d| over halved steps h.

    Attributes
    ----------
    steps, remainders : (n,)
    rates : (n − 1,) observed orders between neighbouring steps; 2 for a right gradient.
    """

    steps: np.ndarray
    remainders: np.ndarray
    rates: np.ndarray

    @property
    def rate(self) -> float:
        """The median observed order."""
        return float(np.median(self.rates))

    @property
    def passed(self) -> bool:
        """Whether the order is 2 within a tenth."""
        return abs(self.rate - 2.0) <= 0.1


def taylor_test(
    value: Callable[[np.ndarray], float],
    at: np.ndarray,
    gradient: np.ndarray,
    direction: np.ndarray,
    step: float,
    count: int = 4,
    start: float | None = None,
) -> TaylorTest:
    """Test `gradient` (n,) of `value` at `at` (n,) along `direction` (n,), with steps h, h/2, … times the direction.

    `start` is the value at `at`, where it is known.
    """
    steps = step * 0.5 ** np.arange(count)
    start, slope = value(at) if start is None else start, float(gradient @ direction)
    remainders = np.array([abs(value(at + h * direction) - start - h * slope) for h in steps])
    rates = np.log2(np.maximum(remainders[:-1], 1e-300) / np.maximum(remainders[1:], 1e-300))
    return TaylorTest(steps, remainders, rates)
