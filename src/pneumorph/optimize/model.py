"""Model of the objective near a design: its gradient (31), and its curvature as far as it is known.

With S the last steps and Y the changes of the gradient over them, Y (SᵀY)⁻¹ Yᵀ is the part of the Hessian seen so far;
for a convex quadratic it never exceeds the Hessian. Only its positive part is used. It matters for designs that are
about to bend or buckle laterally, where the gradient changes so fast along a few directions that linear steps overshoot
from one side to the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

MOST_PAIRS = 5
"""Steps remembered: from one design to the next the Hessian changes, and older ones are of another."""

SMALLEST = 1e-2
"""Curvatures below this fraction of the largest are left out: the differences of gradients that they come from are as
small as the errors of these."""


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


@dataclass(frozen=True, eq=False)
class Curvature:
    """The last designs and their gradients.

    Attributes
    ----------
    phi, slope : (n,) the last design and the gradient there; empty before the first.
    steps, changes : (m, n) unit steps between designs, and the gradient's change per millimetre of each.
    """

    phi: np.ndarray
    slope: np.ndarray
    steps: np.ndarray
    changes: np.ndarray

    def with_design(self, phi: np.ndarray, slope: np.ndarray) -> Curvature:
        """The memory with one more design."""
        if not len(self.phi):
            return replace(self, phi=phi, slope=slope)
        return replace(self.with_pair(phi - self.phi, slope - self.slope), phi=phi, slope=slope)

    def with_pair(self, step: np.ndarray, change: np.ndarray) -> Curvature:
        """The memory with one more step and its change of the gradient; a step of zero length is ignored."""
        length = float(np.linalg.norm(step))
        if length == 0.0:
            return self
        steps = np.vstack([self.steps, step / length])[-MOST_PAIRS:]
        changes = np.vstack([self.changes, change / length])[-MOST_PAIRS:]
        return replace(self, steps=steps, changes=changes)

    def factors(self) -> np.ndarray:
        """W (k, n) such that WᵀW is the positive part of the curvature; k may be zero."""
        if not len(self.steps):
            return self.changes
        product = self.steps @ self.changes.T
        values, vectors = np.linalg.eigh((product + product.T) / 2)
        kept = values > SMALLEST * np.abs(values).max()
        return (vectors[:, kept] / np.sqrt(values[kept])).T @ self.changes

    def pack(self) -> dict[str, Any]:
        """The memory as arrays."""
        return {f"curvature_{name}": getattr(self, name) for name in ("phi", "slope", "steps", "changes")}


def unpack_curvature(state: Mapping[str, Any]) -> Curvature:
    """The memory that was packed."""
    return Curvature(*(np.asarray(state[f"curvature_{name}"]) for name in ("phi", "slope", "steps", "changes")))


def no_curvature(n: int) -> Curvature:
    """An empty memory for n variables."""
    return Curvature(np.zeros(0), np.zeros(0), np.zeros((0, n)), np.zeros((0, n)))
