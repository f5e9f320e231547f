"""Taylor test: the remainder after the first-order term falls with the square of the step if the gradient is right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

NEARER = 0.125
"""Steps of a second test, relative to those of the first."""


@dataclass(frozen=True)
class TaylorTest:
    """Remainders |J(x + h d) − J(x) − h dJ·d| for steps h that are halved repeatedly.

    Attributes
    ----------
    steps, remainders : (n,) arrays
    rates : (n − 1,) array
        Observed orders between successive steps; 2 if the gradient is right.
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
        """Whether the median order is within 0.1 of 2."""
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
    """Test a gradient by the remainders of Taylor's expansion along a direction.

    Parameters
    ----------
    value : callable
        A function of a point (n,).
    at : (n,) array
        The point.
    gradient : (n,) array
        Its gradient there, which is tested.
    direction : (n,) array
    step : float
        h, the first multiple of the direction.
    count : int
        Number of steps h, h/2, h/4, ….
    start : float, optional
        The value at the point, if it is known.
    """
    steps = step * 0.5 ** np.arange(count)
    start, slope = value(at) if start is None else start, float(gradient @ direction)
    remainders = np.array([abs(value(at + h * direction) - start - h * slope) for h in steps])
    rates = np.log2(np.maximum(remainders[:-1], 1e-300) / np.maximum(remainders[1:], 1e-300))
    return TaylorTest(steps, remainders, rates)


def taylor_test_nearby(
    value: Callable[[np.ndarray], float],
    at: np.ndarray,
    gradient: np.ndarray,
    direction: np.ndarray,
    step: float,
    start: float | None = None,
) -> TaylorTest:
    """The test from a step on, or, if that is not passed, from `NEARER` of it on if that is.

    Where parts of a body begin to touch, the order shows at small steps only; that of a wrong gradient is 1 at any.

    Parameters
    ----------
    value, at, gradient, direction, step, start
        As for `taylor_test`.
    """
    test = taylor_test(value, at, gradient, direction, step, start=start)
    if test.passed:
        return test
    nearer = taylor_test(value, at, gradient, direction, NEARER * step, start=start)
    return nearer if nearer.passed else test
