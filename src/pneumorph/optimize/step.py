"""A step of the design variables, and the interface of methods that find one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pneumorph.optimize.model import Proxy
from pneumorph.optimize.states import StateLimits


@dataclass(frozen=True, eq=False)
class Step:
    """The solution of a sub-problem.

    Attributes
    ----------
    change : (n,) Ψ, mm.
    evaluations : number of evaluations or linearisations of the limits.
    learnt : what the method keeps for the next sub-problem.
    """

    change: np.ndarray
    evaluations: int
    learnt: Any

    @property
    def length(self) -> float:
        """Largest change of a variable, mm."""
        return float(np.abs(self.change).max())


class Stepper(Protocol):
    """Finds steps. It is immutable: what it learns is returned as a new stepper."""

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float, states: StateLimits) -> Step:
        """The best step from a design; it may violate limits a little.

        Parameters
        ----------
        phi : (n,) the design.
        proxy : the model of the objective.
        radius : of the trust region, mm.
        states : the limits on states, linearised.
        """
        ...

    def after(self, step: Step) -> Stepper:
        """The stepper for the next design, once a step is accepted."""
        ...

    def pack(self) -> dict[str, Any]:
        """What it has learnt, as arrays and numbers."""
        ...

    def unpack(self, state: dict[str, Any]) -> Stepper:
        """The stepper with what was packed."""
        ...
