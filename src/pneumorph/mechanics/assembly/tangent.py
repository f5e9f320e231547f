"""The tangent as a linear solver: an old factorisation preconditions conjugate gradients on the exact product.

One factorisation costs as much as some twenty back-solves, and after a small step an old one still needs only a few of
them; so Newton, predictors and adjoints all share this solver and factorise only when conjugate gradients grow slow.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.assembly.linear import factorisation
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import Loads, State


@dataclass(frozen=True)
class Configuration:
    """Where the tangent is taken: nodes X (padded), loads, and the plate components that are blocked (6,) bool."""

    model: Model
    X: jnp.ndarray
    loads: Loads
    blocked: np.ndarray

    @property
    def held(self) -> np.ndarray:
        """All unknowns kept at their value: supports and blocked plate components."""
        held = self.model.fixed.copy()
        held[-6:] |= self.blocked
        return held


class Tangent:
    """A factorised tangent that is reused while it serves.

    Attributes
    ----------
    factorisations : int
        How many numerical factorisations were made so far.
    solves : int
        How many back-solves.
    negative_pivots : int
        Of the latest factorisation, beyond the one that every pressure of mixed elements has: 0 at a stable state.
    unit_seconds : float
        What the latest assembly with factorisation took: the yardstick that a design's cost is told in.
    """

    def __init__(self, model: Model):
        self._model = model
        self._factor = factorisation(model.pattern.indptr, model.pattern.indices)
        self._place: tuple[Configuration, State] | None = None
        self.ready = False
        self.factorisations = 0
        self.solves = 0
        self.unit_seconds = 0.0

    @property
    def negative_pivots(self) -> int:
        # Every pressure adds one to those of the tangent with them eliminated (Haynsworth 1968).
        return self._factor.negative_pivots - self._model.pressures

    def factorise(self, at: Configuration, state: State) -> None:
        """Assemble and factorise the tangent at a state."""
        began = time.perf_counter()
        self._refactorise(tangent(self._model, at.X, state, at.loads, at.blocked))
        self.unit_seconds = time.perf_counter() - began
        self._place = (at, state)

    def move_to(self, at: Configuration, state: State) -> None:
        """Factorise at a state, unless the factorisation at hand is that one."""
        if self._place is None or self._place[0] is not at or self._place[1] is not state:
            self.factorise(at, state)

    def factorise_convex(self, at: Configuration, state: State, least: float = 1e-3) -> float:
        """Factorise; an unstable tangent with its diagonal raised until it is stable, by the part of it returned.

        Tried are 0, `least`, and four times as much at a time. The diagonal of the pressures stays.
        """
        data = tangent(self._model, at.X, state, at.loads, at.blocked)
        self._refactorise(data)
        diagonal, shift = np.abs(data[self._model.diagonal]), 0.0
        diagonal[self._model.pressure_unknowns] = 0.0
        while self.negative_pivots > 0 and shift < 10:
            shift = 4 * shift or least
            raised = data.copy()
            raised[self._model.diagonal] += shift * diagonal
            self._refactorise(raised)
        return shift

    def _refactorise(self, data: np.ndarray) -> None:
        self._factor.refactorise(data)
        self.factorisations += 1
        self.ready = True
        self._place = None

    def precondition(self, rhs: np.ndarray) -> np.ndarray:
        """Back-solve with the factorisation at hand for a right-hand side (n,), or for several (n, k)."""
        self.solves += 1 if rhs.ndim == 1 else rhs.shape[1]
        return self._factor.solve(rhs)

    def solve(self, at: Configuration, state: State, rhs: np.ndarray, tolerance: float, most: int) -> Solution:
        """K(state) x = rhs by preconditioned conjugate gradients.

        Stops at the relative `tolerance` in the preconditioner's norm, after `most` products, or at negative curvature.
        """
        model, held = self._model, at.held
        x, r = np.zeros_like(rhs), np.where(held, 0.0, rhs)
        z = self.precondition(r)
        p, rho = z, float(r @ z)
        target = tolerance**2 * rho
        for count in range(most):
            if rho <= target or rho <= 0:
                return Solution(x, True, False, count)
            product = kernels.tangent_product(*model.rubber_arguments, model.top, at.X, state, at.loads, model.state(p))
            Kp = np.where(held, 0.0, model.vector(product))
            curvature = p @ Kp
            if not curvature > 0:
                return Solution(x if count else p, False, True, count)
            step = rho / curvature
            x, r = x + step * p, r - step * Kp
            z = self.precondition(r)
            previous, rho = rho, float(r @ z)
            p = z + (rho / previous) * p
        return Solution(x, rho <= target, False, most)


@dataclass(frozen=True)
class Solution:
    """Answer of a linear solve: x (n,), whether it met its tolerance or met negative curvature, products used."""

    x: np.ndarray
    converged: bool
    negative_curvature: bool
    products: int
