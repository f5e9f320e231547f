"""The default sub-problem: sequential quadratic programs over smooth steps in a box.

The step is Ψ = S z with |z| ≤ Ξ, so the trust region (33) is a bound on z. Each program has the limits linearised at
the step so far (`limits.rows`) and is solved by an augmented Lagrangian (Hestenes 1969; Powell 1969; Rockafellar
1973) with accelerated gradients; an evaluation costs two products with a sparse matrix. The multipliers of the limits,
called prices, are kept from design to design, by kind and knot-span cell. Limits that remain broken are repaired
afterwards (`within.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy import sparse

from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.rows.samples import KINDS, LimitSamples
from pneumorph.optimize.accelerated import Map, advanced, at_rest, tightened
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.proxy import Proxy
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Step

PROGRAMS, ROUNDS, MOST_ITERATIONS = 5, 6, 20
"""Linearisations in a sub-problem, updates of the prices in each, and most iterations between them. What programs leave
unsolved is repaired afterwards at the cost of the gain: four programs lose 3 % of it. The iteration keeps its momentum
when prices change: begun afresh with each of them, it needs twice as many iterations and gains less. More updates after
fewer iterations promise more for one step, but less in a run."""

NARROWING = 0.5
"""Each program may move the step this fraction as far as the one before. Without it the limits on curvature, which
linear rows underestimate, are exceeded again each time."""

ACCURACY = 1e-3
"""Change of the raw step, in radii, at which iterations end."""

STIFFNESS = 100.0
"""ρ, mm: price of a limit exceeded by its whole bound, in mean derivatives of the objective per mm."""

PROXIMITY = 0.25
"""Variables with a derivative below this multiple of the mean do not move by the whole radius, for there the gradient
is mostly noise of the mesh."""

LEAST = -0.3
"""The programs contain measures of the shape above this value; 0 is the bound."""


@dataclass(frozen=True, eq=False)
class SequentialQuadratic:
    """Sequential quadratic programs in a design space under limits.

    Attributes
    ----------
    prices : (kinds, cells) array
        λ ≥ 0 of every limit in every cell, in mean derivatives of the objective.
    """

    space: DesignSpace
    smooth: Smoothing
    limits: LimitSamples
    prices: np.ndarray

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float, states: StateLimits) -> Step:
        """See `Stepper.step`."""
        space = self.space
        unit = max(float(np.abs(proxy.slope).mean()), 1e-300)
        scaled = Proxy(proxy.slope / unit, proxy.factors / np.sqrt(unit))
        bounds = np.maximum(-radius, space.lower - phi), np.minimum(radius, space.upper - phi)
        # Beginning with the step before promises some per cent more, but shapes become rough: they gain less, and the
        # meshes of some fail.
        z, prices, places = np.zeros(space.n), self.prices.copy(), None
        # Exceeded by one per cent, a limit on states pushes as hard as the mean derivative of the objective.
        weight = 1.0 / np.sqrt(np.maximum(np.abs(states.jacobian).mean(axis=1), 1e-12))
        of_states, known, on_states = weight[:, None] * states.jacobian, weight * states.excess, np.zeros(len(weight))
        for number in range(PROGRAMS):
            room = NARROWING**number * radius
            change = self.smooth.apply(z)
            # Both walls of a gap may move by the whole radius.
            linear = linear_limits(space, self.limits, phi + change, 2.2 * room, LEAST, places)
            rows, jacobian, places = linear.rows, linear.jacobian, linear.rows.places
            both = sparse.csr_array(sparse.vstack([jacobian, of_states])) if len(known) else jacobian
            excess = np.concatenate([linear.excess() - jacobian @ change, known])
            program = _Program(scaled, self.smooth, both, excess, PROXIMITY / radius)
            # The rows of a kind in a cell share its price.
            sharing = np.zeros_like(prices)
            np.add.at(sharing, (rows.kind, rows.cell), 1.0)
            price, scale = (prices / np.maximum(sharing, 1.0))[rows.kind, rows.cell], program.scale()
            price = np.concatenate([price, on_states])
            lower, upper = np.maximum(bounds[0], z - room), np.minimum(bounds[1], z + room)
            iterate = at_rest(z)
            for _ in range(ROUNDS):
                slope = program.slope(price)
                iterate = advanced(slope, iterate, lower, upper, scale, MOST_ITERATIONS, ACCURACY * radius)
                price = program.price(price, self.smooth.apply(iterate.z))
            z = iterate.z
            prices = np.zeros_like(prices)
            np.add.at(prices, (rows.kind, rows.cell), price[: len(rows.kind)])
            on_states = price[len(rows.kind) :]
        return Step(self.smooth.apply(z), PROGRAMS, prices)

    def after(self, step: Step) -> SequentialQuadratic:
        """See `Stepper.after`."""
        return replace(self, prices=step.learnt)

    def pack(self) -> dict[str, Any]:
        """See `Stepper.pack`."""
        return {"prices": self.prices}

    def unpack(self, state: dict[str, Any]) -> SequentialQuadratic:
        """See `Stepper.unpack`."""
        # Checkpoints of earlier versions have none, or others; they are learnt again.
        known = "prices" in state and np.shape(state["prices"]) == self.prices.shape
        return replace(self, prices=np.asarray(state["prices"], float)) if known else self


@dataclass(frozen=True, eq=False)
class _Program:
    """The augmented Lagrangian of a quadratic program: a proxy under linearised limits c + J S z ≤ 0.

    Attributes
    ----------
    known : (m,) c.
    pull : weight of ½‖z‖².
    """

    proxy: Proxy
    smooth: Smoothing
    jacobian: sparse.csr_array
    known: np.ndarray
    pull: float

    @cached_property
    def transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.jacobian.T)

    def price(self, price: np.ndarray, change: np.ndarray) -> np.ndarray:
        """λ ← max(0, λ + ρ c) after a smooth step."""
        return np.maximum(0.0, price + STIFFNESS * (self.known + self.jacobian @ change))

    def slope(self, price: np.ndarray) -> Map:
        """Gradient of the augmented Lagrangian by z, for prices λ (m,)."""

        def slope(z: np.ndarray) -> np.ndarray:
            change = self.smooth.apply(z)
            _, tilt = self.proxy.change(change)
            return self.smooth.transpose(tilt + self.transposed @ self.price(price, change)) + self.pull * z

        return slope

    def scale(self) -> np.ndarray:
        """A diagonal (n,) above its Hessian: absolute row sums, tightened."""
        moduli, factors = abs(self.jacobian), self.proxy.factors

        def bound(smooth, jacobian, transposed, factors, z):
            change = smooth.apply(z)
            image = STIFFNESS * (transposed @ (jacobian @ change)) + (factors @ change) @ factors
            return smooth.transpose(image) + self.pull * z

        above = self.smooth.moduli, moduli, sparse.csr_array(moduli.T), np.abs(factors)
        whole = bound(*above, np.ones(len(self.proxy.slope)))
        return tightened(whole, partial(bound, self.smooth, self.jacobian, self.transposed, factors))


def build_sequential_quadratic(space: DesignSpace, smooth: Smoothing, limits: LimitSamples) -> SequentialQuadratic:
    """A stepper without prices yet."""
    return SequentialQuadratic(space, smooth, limits, np.zeros((len(KINDS), int(limits.first[-1]))))
