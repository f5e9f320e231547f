"""A step of the design variables, and what any way of finding one offers to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

REFERENCE_GAIN = 1.0
"""Gain of a full reference step of every variable along the gradient; see `proxy_scale`."""


@dataclass(frozen=True, eq=False)
class Step:
    """The answer of a sub-problem.

    Attributes
    ----------
    change : (n,) Ψ, mm.
    scale : what the objective is multiplied with in the merit.
    expected : change of the objective that its proxy expects.
    gain : fall of the merit that the proxy and the exact limits promise.
    evaluations : how often the limits and their gradients were evaluated.
    learnt : what the method keeps for the next sub-problem.
    """

    change: np.ndarray
    scale: float
    expected: float
    gain: float
    evaluations: int
    learnt: Any

    def ratio(self, before: float, after: float) -> float:
        """Actual over predicted gain, for the objective's values before and after the step."""
        return (self.gain + self.scale * (self.expected - (after - before))) / self.gain


class Stepper(Protocol):
    """Finds steps; frozen, so what is learnt on the way comes back as a new one."""

    def step(self, phi: np.ndarray, slope: np.ndarray, radius: float) -> Step:
        """The best step of at most `radius` (mm) from Φ for an objective of gradient `slope`."""
        ...

    def taught(self, step: Step, slope: np.ndarray, slope_there: np.ndarray) -> Stepper:
        """The stepper for another try, with the gradient found at the end of a step that is taken back."""
        ...

    def after(self, step: Step) -> Stepper:
        """The stepper for the next design, once a step is accepted."""
        ...

    def pack(self) -> dict[str, Any]:
        """All it has learnt, as arrays and numbers."""
        ...

    def unpack(self, state: dict[str, Any]) -> Stepper:
        """The stepper that had learnt this."""
        ...


def proxy_scale(slope: np.ndarray, reference: float) -> float:
    """Scale of the objective in the merit, 1/(Ξ₀ ‖∂J/∂Φ‖₁): the units of Φ, pressures and J drop out; Ξ₀ in mm."""
    return REFERENCE_GAIN / (reference * max(float(np.abs(slope).sum()), 1e-300))
