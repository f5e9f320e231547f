"""A step of the design variables, and what any way of finding one offers to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pneumorph.optimize.proxy import Proxy


@dataclass(frozen=True, eq=False)
class Step:
    """The answer of a sub-problem.

    Attributes
    ----------
    change : (n,) Ψ, mm.
    evaluations : how often the limits were evaluated or linearised.
    learnt : what the method keeps for the next sub-problem.
    """

    change: np.ndarray
    evaluations: int
    learnt: Any


class Stepper(Protocol):
    """Finds steps; frozen, so what is learnt on the way comes back as a new one."""

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float) -> Step:
        """The best step of at most `radius` (mm) from Φ; limits may be left a little broken."""
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
