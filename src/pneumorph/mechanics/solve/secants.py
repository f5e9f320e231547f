"""Limited-memory BFGS on a factorised tangent (Nocedal & Wright 2006, Numerical Optimization, algorithm 7.4).

The factorisation is the initial matrix; each step corrects it along what it has moved. So one of a state nearby serves
for many steps, each at the cost of a back-solve and a residual.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

MEMORY = 12
"""Last steps that are remembered."""

TRIED = 3
"""Steps by which progress is judged."""


@dataclass(frozen=True, eq=False)
class Secants:
    """Steps made with one factorisation.

    Attributes
    ----------
    steps, changes : tuples of (n,) arrays
        The last steps, and the changes of the residual over them.
    sizes : tuple of float
        Norms of the residual before and after every step.
    """

    steps: tuple[np.ndarray, ...] = ()
    changes: tuple[np.ndarray, ...] = ()
    sizes: tuple[float, ...] = ()

    def direction(self, inverse: Callable[[np.ndarray], np.ndarray], residual: np.ndarray) -> np.ndarray:
        """The quasi-Newton direction (n,) for a residual; `inverse` is the back-solve with the factorisation."""
        pairs = [(step, change, 1.0 / (step @ change)) for step, change in zip(self.steps, self.changes, strict=True)]
        left, shares = residual, []
        for step, change, weight in reversed(pairs):
            shares.append(weight * (step @ left))
            left = left - shares[-1] * change
        direction = inverse(left)
        for (step, change, weight), share in zip(pairs, reversed(shares), strict=True):
            direction = direction + (share - weight * (change @ direction)) * step
        return -direction

    def after(self, step: np.ndarray, before: np.ndarray, residual: np.ndarray) -> Secants:
        """The memory after a step (n,), from the residuals before and after it."""
        change = residual - before
        sizes = (*(self.sizes or (float(np.linalg.norm(before)),)), float(np.linalg.norm(residual)))
        if not step @ change > 0.0:
            # Across negative curvature; it would spoil the definite matrix.
            return Secants(self.steps, self.changes, sizes)
        return Secants((*self.steps, step)[-MEMORY:], (*self.changes, change)[-MEMORY:], sizes)

    def expected(self, size: float) -> float:
        """Steps still needed until the residual's norm is `size`, as the last ones went; 0 before it can be told."""
        if len(self.sizes) <= TRIED:
            return 0.0
        gained = math.log(self.sizes[-1 - TRIED] / self.sizes[-1]) / TRIED
        return math.log(self.sizes[-1] / size) / gained if gained > 0.0 else math.inf
