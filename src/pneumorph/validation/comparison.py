"""A measured curve beside the predicted one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WITHIN = 2.0
"""Standard deviations of prediction and measurement together within which they agree."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """A measured curve beside the predicted one.

    Attributes
    ----------
    body, rubber : str
        What was measured, and with which rubber it is predicted.
    quantity, unit : str
        What was measured, in which unit all of it is.
    case : str
        Under which loads, where there are several curves; else empty.
    along : str
        What is on the axis of `at`, with its unit.
    at, measured, predicted : (n,)
    scatter, error : (n,)
        One standard deviation of the measured and of the predicted values, or half of the range of few.
    fitted : (n,) bool
        Points by which the rubber was found: they are shown, but tell nothing of the prediction.
    missing : str
        Why there is no prediction at the other points; empty if there is one at all of them.
    """

    body: str
    rubber: str
    quantity: str
    unit: str
    case: str
    along: str
    at: np.ndarray
    measured: np.ndarray
    scatter: np.ndarray
    predicted: np.ndarray
    error: np.ndarray
    fitted: np.ndarray
    missing: str = ""

    @property
    def differences(self) -> np.ndarray:
        """Predicted less measured at the points that were not fitted, in `unit`."""
        return (self.predicted - self.measured)[~self.fitted]

    @property
    def rms(self) -> float | None:
        """Root mean square of the differences, in `unit`; None without points."""
        return float(np.sqrt(np.mean(self.differences**2))) if len(self.differences) else None

    @property
    def normalised(self) -> float | None:
        """The same over the largest measured value; None without points."""
        largest = float(np.abs(self.measured).max(initial=0.0))
        return None if self.rms is None or not largest else self.rms / largest

    @property
    def within(self) -> int:
        """Points at which both agree within `WITHIN` standard deviations."""
        bars = np.hypot(self.scatter, self.error)[~self.fitted]
        return int(np.sum(np.abs(self.differences) <= WITHIN * bars))
