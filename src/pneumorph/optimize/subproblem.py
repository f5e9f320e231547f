"""The default sub-problem: sequential quadratic programs over smooth steps in a box.

The step is Ψ = S z with |z| ≤ Ξ, so the trust region (33) is a bound on z. Each program has the limits linearised at
the step so far (`limits.rows`) and is solved by an augmented Lagrangian (Hestenes 1969; Powell 1969; Rockafellar
1973) with accelerated gradients; an evaluation costs two products with a sparse matrix. The multipliers of the limits
are kept from design to design, by kind and knot-span cell. Limits that remain violated are repaired
afterwards (`within.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy import sparse

from pneumorph.doing import counted
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.table import ROWS
from pneumorph.optimize.accelerated import Map, advanced, at_rest, tightened
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Step


@dataclass(frozen=True)
class ProgramSettings:
    """Settings of the quadratic programs of a step."""

    programs: int = 5
    """Linearisations in a sub-problem. What programs leave unsolved is repaired afterwards at the cost of the gain:
    four lose 3 % of it."""

    rounds: int = 6
    """Updates of the multipliers in each. More after fewer iterations promise more for one step, but less in a run."""

    iterations: int = 20
    """Most iterations between updates. The iteration keeps its momentum when multipliers change: begun afresh with each
    of them, it needs twice as many and gains less."""

    narrowing: float = 0.5
    """Each program may move the step this fraction as far as the one before. Without it the limits on curvature, which
    linear rows underestimate, are exceeded again each time."""

    accuracy: float = 1e-3
    """Change of the raw step, in radii, at which iterations end."""

    stiffness: float = 100.0
    """ρ, mm: multiplier of a limit exceeded by its whole bound, in mean derivatives of the objective per mm."""

    proximity: float = 0.25
    """Variables with a derivative below this multiple of the mean do not move by the whole radius, for there the
    gradient is mostly noise of the mesh."""

    ahead: float = 4.0
    """Rows that such a multiple of the last round's motion could bring to their bounds take part in the next one. With
    fewer, steps gain less."""

    least: float = -0.3
    """The programs contain measures of the shape above this value; 0 is the bound. Others are left out to save time."""

    approach: float = 2.2
    """In radii: the programs contain distances that are no farther than this from their bound. Both walls of a gap may
    move by the whole radius; the rest is for their curvature."""


PROGRAM = ProgramSettings()


@dataclass(frozen=True, eq=False)
class SequentialQuadratic:
    """Sequential quadratic programs in a design space under limits.

    Attributes
    ----------
    multipliers : (kinds, cells) array
        λ ≥ 0 of every limit in every cell, in mean derivatives of the objective.
    """

    space: DesignSpace
    smooth: Smoothing
    limits: ShapeLimits
    multipliers: np.ndarray

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float, states: StateLimits) -> Step:
        """The step by a few quadratic programs.

        Parameters
        ----------
        phi, proxy, radius, states
            As for `Stepper.step`.
        """
        space = self.space
        unit = max(float(np.abs(proxy.slope).mean()), 1e-300)
        scaled = Proxy(proxy.slope / unit, proxy.factors / np.sqrt(unit))
        bounds = np.maximum(-radius, space.lower - phi), np.minimum(radius, space.upper - phi)
        # Beginning with the step before promises some per cent more, but shapes become rough: they gain less, and the
        # meshes of some fail.
        z, multipliers, places = np.zeros(space.n), self.multipliers.copy(), None
        # Exceeded by one per cent, a limit on states pushes as hard as the mean derivative of the objective.
        weight = 1.0 / np.sqrt(np.maximum(np.abs(states.jacobian).mean(axis=1), 1e-12))
        of_states, known, on_states = weight[:, None] * states.jacobian, weight * states.excess, np.zeros(len(weight))
        for number in range(PROGRAM.programs):
            counted("program")
            room = PROGRAM.narrowing**number * radius
            change = self.smooth.apply(z)
            linear = linear_limits(space, self.limits, phi + change, PROGRAM.approach * room, PROGRAM.least, places)
            rows, jacobian, places = linear.rows, linear.jacobian, linear.rows.places
            both = sparse.csr_array(sparse.vstack([jacobian, of_states])) if len(known) else jacobian
            excess = np.concatenate([linear.excess() - jacobian @ change, known])
            program = _Program(scaled, self.smooth, both, excess, PROGRAM.proximity / radius)
            # The rows of a kind in a cell share its multiplier.
            sharing = np.zeros_like(multipliers)
            np.add.at(sharing, (rows.kind, rows.cell), 1.0)
            multiplier, scale = (multipliers / np.maximum(sharing, 1.0))[rows.kind, rows.cell], program.scale()
            multiplier = np.concatenate([multiplier, on_states])
            lower, upper = np.maximum(bounds[0], z - room), np.minimum(bounds[1], z + room)
            iterate, change, near, own = at_rest(z), change, program, multiplier
            for _ in range(PROGRAM.rounds):
                slope = near.slope(own)
                iterate = advanced(slope, iterate, lower, upper, scale, PROGRAM.iterations, PROGRAM.accuracy * radius)
                before, change = change, self.smooth.apply(iterate.z)
                multiplier = program.multiplier(multiplier, change)
                some = program.reached(multiplier, change, change - before)
                near, own = program.part(some), multiplier[some]
            z = iterate.z
            multipliers = np.zeros_like(multipliers)
            np.add.at(multipliers, (rows.kind, rows.cell), multiplier[: len(rows.kind)])
            on_states = multiplier[len(rows.kind) :]
        return Step(self.smooth.apply(z), PROGRAM.programs, multipliers)

    def after(self, step: Step) -> SequentialQuadratic:
        """See `Stepper.after`."""
        return replace(self, multipliers=step.learnt)

    def pack(self) -> dict[str, Any]:
        """See `Stepper.pack`."""
        return {"multipliers": self.multipliers}

    def unpack(self, state: dict[str, Any]) -> SequentialQuadratic:
        """See `Stepper.unpack`."""
        # Checkpoints of earlier versions call them "prices", or have none, or others; these are learnt again.
        stored = state.get("multipliers", state.get("prices"))
        known = stored is not None and np.shape(stored) == self.multipliers.shape
        return replace(self, multipliers=np.asarray(stored, float)) if known else self


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

    @cached_property
    def moduli(self) -> sparse.csr_array:
        return abs(self.jacobian)

    def multiplier(self, multiplier: np.ndarray, change: np.ndarray) -> np.ndarray:
        """λ ← max(0, λ + ρ c) after a smooth step."""
        return np.maximum(0.0, multiplier + PROGRAM.stiffness * (self.known + self.jacobian @ change))

    def reached(self, multiplier: np.ndarray, change: np.ndarray, further: np.ndarray) -> np.ndarray:
        """Rows that push after a smooth step (n,), or may do so once it has moved by a few times `further` (n,)."""
        ahead = self.known + self.jacobian @ change + PROGRAM.ahead * (self.moduli @ np.abs(further))
        return np.flatnonzero(multiplier + PROGRAM.stiffness * ahead > 0.0)

    def part(self, rows: np.ndarray) -> _Program:
        """The program with some of its rows alone."""
        return replace(self, jacobian=self.jacobian[rows], known=self.known[rows])

    def slope(self, multiplier: np.ndarray) -> Map:
        """Gradient of the augmented Lagrangian by z, for multipliers λ (m,)."""

        def slope(z: np.ndarray) -> np.ndarray:
            change = self.smooth.apply(z)
            _, tilt = self.proxy.change(change)
            return self.smooth.transpose(tilt + self.transposed @ self.multiplier(multiplier, change)) + self.pull * z

        return slope

    def scale(self) -> np.ndarray:
        """A diagonal (n,) above its Hessian: absolute row sums, tightened."""
        factors = self.proxy.factors

        def bound(smooth, jacobian, transposed, factors, z):
            change = smooth.apply(z)
            image = PROGRAM.stiffness * (transposed @ (jacobian @ change)) + (factors @ change) @ factors
            return smooth.transpose(image) + self.pull * z

        above = self.smooth.moduli, self.moduli, sparse.csr_array(self.moduli.T), np.abs(factors)
        whole = bound(*above, np.ones(len(self.proxy.slope)))
        return tightened(whole, partial(bound, self.smooth, self.jacobian, self.transposed, factors))


def build_sequential_quadratic(space: DesignSpace, smooth: Smoothing, limits: ShapeLimits) -> SequentialQuadratic:
    """A stepper without multipliers yet."""
    return SequentialQuadratic(space, smooth, limits, np.zeros((len(ROWS), limits.cells)))
