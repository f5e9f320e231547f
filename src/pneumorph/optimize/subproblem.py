"""The default sub-problem: sequential quadratic programs over smooth steps in a box.

The step is Ψ = S z with |z| ≤ Ξ, so the trust region (33) is a bound. Every program has the limits linearised at the
step so far (`constraint.rows`), and is solved by an augmented Lagrangian (Hestenes 1969; Powell 1969; Rockafellar 1973)
whose rounds are minimised by L-BFGS-B: an evaluation costs two products with a sparse matrix. The prices of the limits,
by kind and knot-span cell, are kept from design to design. What is left broken the loop mends (`within.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import optimize, sparse

from pneumorph.constraint.rows import KINDS, Sampled
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.optimize.proxy import Proxy
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.step import Step

PROGRAMS, ROUNDS, MOST_ITERATIONS = 3, 2, 25
"""Linearisations in a sub-problem, updates of the prices in each, and L-BFGS-B iterations in each of those."""

STIFFNESS = 100.0
"""ρ, mm: price of a limit that is broken by its whole bound, in mean derivatives of the objective per mm."""

PROXIMITY = 1.0
"""Variables whose derivative is below this multiple of the mean do not go the whole radius: what is noise of the mesh
there stays small."""

LEAST = -0.3
"""Measures of the shape from here on are in the programs: 0 is the bound."""


@dataclass(frozen=True, eq=False)
class SequentialQuadratic:
    """Finds steps for a design space under limits.

    Attributes
    ----------
    prices : (kinds, cells) array
        λ ≥ 0 of every limit in every cell, in mean derivatives of the objective.
    """

    space: DesignSpace
    smooth: Smoothing
    limits: Sampled
    prices: np.ndarray

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float) -> Step:
        """See `Stepper.step`."""
        space = self.space
        unit = max(float(np.abs(proxy.slope).mean()), 1e-300)
        scaled = Proxy(proxy.slope / unit, proxy.factors / np.sqrt(unit))
        bounds = np.column_stack([np.maximum(-radius, space.lower - phi), np.minimum(radius, space.upper - phi)])
        z, prices = np.zeros(space.n), self.prices.copy()
        for _ in range(PROGRAMS):
            change = self.smooth.apply(z)
            # Both walls of a gap may go the whole radius.
            rows = self.limits.rows(space.body(phi + change), 2.2 * radius, LEAST)
            jacobian = limits_by_variables(space, rows.jacobian)
            known = rows.value - jacobian @ change
            price = prices[rows.kind, rows.cell]
            for _ in range(ROUNDS):
                z = self._minimise(scaled, jacobian, known, price, z, bounds, PROXIMITY / radius)
                price = np.maximum(0.0, price + STIFFNESS * (known + jacobian @ self.smooth.apply(z)))
            prices = np.zeros_like(prices)
            prices[rows.kind, rows.cell] = price
        return Step(self.smooth.apply(z), PROGRAMS, prices)

    def _minimise(self, proxy: Proxy, jacobian, known, price, z, bounds, pull) -> np.ndarray:
        """The raw step that minimises the augmented Lagrangian."""
        transposed = sparse.csr_array(jacobian.T)

        def merit(z):
            change = self.smooth.apply(z)
            expected, tilt = proxy.change(change)
            dear = np.maximum(0.0, price + STIFFNESS * (known + jacobian @ change))
            value = expected + float(dear @ dear) / (2 * STIFFNESS) + 0.5 * pull * float(z @ z)
            return value, self.smooth.transpose(tilt + transposed @ dear) + pull * z

        options = {"maxiter": MOST_ITERATIONS, "maxcor": 20, "ftol": 1e-14, "gtol": 1e-9}
        return optimize.minimize(merit, z, jac=True, method="L-BFGS-B", bounds=bounds, options=options).x

    def after(self, step: Step) -> SequentialQuadratic:
        """See `Stepper.after`."""
        return replace(self, prices=step.learnt)

    def pack(self) -> dict[str, Any]:
        """See `Stepper.pack`."""
        return {"prices": self.prices}

    def unpack(self, state: dict[str, Any]) -> SequentialQuadratic:
        """See `Stepper.unpack`."""
        return replace(self, prices=np.asarray(state["prices"]))


def sequential_quadratic(space: DesignSpace, smooth: Smoothing, limits: Sampled) -> SequentialQuadratic:
    """A stepper that knows no prices yet."""
    return SequentialQuadratic(space, smooth, limits, np.zeros((len(KINDS), int(limits.first[-1]))))


def limits_by_variables(space: DesignSpace, jacobian: sparse.csr_array) -> sparse.csr_array:
    """Derivatives (m, n) of limits by the design variables, from those by control points; pressures change none."""
    by_shape = sparse.csr_array(jacobian @ space.L)
    return sparse.csr_array(
        (by_shape.data, by_shape.indices, by_shape.indptr), shape=(len(by_shape.indptr) - 1, space.n)
    )
