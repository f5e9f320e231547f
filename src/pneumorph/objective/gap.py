"""How far two places of a body are apart in a direction, as a function of a state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.kinematics import State


@dataclass(frozen=True, eq=False)
class Gap:
    """A sum of the deformed places of all nodes with `weights` (N, 3): one place less another, along a direction."""

    weights: np.ndarray
    by_pressure: Mapping[str, float] = field(default_factory=dict)

    def of(self, x: np.ndarray) -> float:
        """Its value, mm, for nodes at x (N, 3)."""
        return float(np.vdot(self.weights, x))

    def slope(self, model: Model, X: np.ndarray, state: State) -> tuple[float, np.ndarray, State]:
        """Its value, and its derivatives with respect to X (N, 3) and the unknowns."""
        nodes = Displacement(model.tip, X, state)
        return self.of(X + nodes.u), self.weights + nodes.pulled_to_nodes(self.weights), nodes.pulled(self.weights)
