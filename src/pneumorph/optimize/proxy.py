"""Model of the objective near a design: its gradient (31) and the curvature known so far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Proxy:
    """J near a design, J + slope·Ψ + ½‖W Ψ‖².

    Attributes
    ----------
    slope : (n,) dJ/dΦ.
    factors : (k, n) W, with few rows.
    """

    slope: np.ndarray
    factors: np.ndarray

    def change(self, step: np.ndarray) -> tuple[float, np.ndarray]:
        """Expected change of J over a step (n,), and its gradient."""
        bent = self.factors @ step
        return float(self.slope @ step + 0.5 * bent @ bent), self.slope + bent @ self.factors
