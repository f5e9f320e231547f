"""The default sub-problem: sequential quadratic programs over smooth steps in a box.

The step is Ψ = S z with |z| ≤ Ξ, so the trust region (33) is a bound on z. Each program has the limits linearised at
the step so far (`limits.rows`) and is solved by a primal–dual method (`primal_dual.py`). The multipliers of the limits
are kept from design to design, by kind and knot-span cell; those of limits on states and of curvature are found for
every step (`pushing.py`). Limits that remain violated are repaired afterwards (`within.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from pneumorph.doing import counted
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.table import ROWS
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.primal_dual import Ending, Pair, Program, improved
from pneumorph.optimize.pushing import Pushed, pushed
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Step


@dataclass(frozen=True)
class ProgramSettings:
    """Settings of the quadratic programs of a step."""

    programs: int = 8
    """Most linearisations in a sub-problem; it ends before where a step no longer changes. What they leave unsolved is
    repaired afterwards, without regard to the objective. Ten, each moving seven tenths as far as the one before, keep
    5 % more where most of a bellows is at its limits, and at most 1 % more elsewhere, for 30 to 40 % more time."""

    iterations: int = 80
    """Most iterations in each."""

    balance: float = 3.0
    """Of multipliers and steps: with 1, a row of length 1 that a step through the whole box exceeds changes its
    multiplier by as much as the mean derivative of the objective. A tenth of it leaves five to ten times as much of the
    gain where many limits are active; three times as much leaves up to twice as much elsewhere."""

    narrowing: float = 0.65
    """Each program may move the step this fraction as far as the one before. Without it the limits on curvature, which
    linear rows underestimate, are exceeded again each time."""

    hopeless: float = 1000.0
    """c of a limit from which no program leads back, since the surface is about to form a cusp: the motion to there is
    halved. Tens are common where most of a bellows is at its limits, and hundreds are gone after two programs."""

    accuracy: float = 1e-3
    """Change of the raw step at which iterations end, as a part of how far a program may move it, and programs, as a
    part of the radius."""

    proximity: float = 0.25
    """Variables with a derivative below this multiple of the mean do not move by the whole radius, for there the
    gradient is mostly noise of the mesh."""

    least: float = -0.3
    """The programs contain measures of the shape above this value; 0 is the bound. Others are left out to save time."""

    push: float = 500.0
    """Multiplier of a limit on states for what no step in the box takes away of its excess, in mean derivatives of the
    objective for one of its own: five of them for one per cent."""

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
        space, pull = self.space, PROGRAM.proximity / radius
        bounds = np.maximum(-radius, space.lower - phi), np.minimum(radius, space.upper - phi)
        raw, squares = self._raw(states.jacobian), self._raw(proxy.factors)
        # Rows of neighbouring sections are nearly the same, and their multipliers would undo each other: the same
        # curvature by rows that are orthogonal.
        turned = np.linalg.eigh(squares @ squares.T)[1].T
        factors, squares = turned @ proxy.factors, turned @ squares

        def begun(slope: np.ndarray) -> tuple[Proxy, Pushed, np.ndarray]:
            """The proxy over the mean of a slope (n,), the best step without limits on the shape, and the slope
            that limits on states leave."""
            unit = max(float(np.abs(slope).mean()), 1e-300)
            scaled = Proxy(proxy.slope / unit, factors / np.sqrt(unit))
            downhill, curved = self.smooth.transpose(scaled.slope), squares / np.sqrt(unit)
            found = pushed(downhill, pull, raw, states.excess, *bounds, PROGRAM.push, curved)
            return scaled, found, proxy.slope + unit * found.multiplier @ states.jacobian

        # Derivatives are measured by the mean of those that the limits on states leave.
        _, _, left = begun(proxy.slope)
        scaled, (_, on_states, bent), _ = begun(left)
        # Beginning with the step before promises some per cent more, but shapes become rough: they gain less, and the
        # meshes of some fail.
        z, multipliers, places = np.zeros(space.n), self.multipliers.copy(), None
        number, last = 0, z
        for number in range(PROGRAM.programs):
            counted("program")
            room = PROGRAM.narrowing**number * radius
            reach = PROGRAM.approach * room
            while True:
                change = self.smooth.apply(z)
                linear = linear_limits(space, self.limits, phi + change, reach, PROGRAM.least, places)
                short = np.abs(z - last).max() <= PROGRAM.accuracy * radius
                if short or linear.excess().max(initial=0.0) <= PROGRAM.hopeless:
                    break
                # The one before it was not hopeless.
                z = 0.5 * (last + z)
            last = z
            rows, jacobian, places = linear.rows, linear.jacobian, linear.rows.places
            # The rows of a kind in a cell share its multiplier.
            sharing = np.zeros_like(multipliers)
            np.add.at(sharing, (rows.kind, rows.cell), 1.0)
            multiplier = (multipliers / np.maximum(sharing, 1.0))[rows.kind, rows.cell]
            program = Program(
                self.smooth,
                scaled.slope,
                scaled.factors,
                pull,
                sparse.csr_array(sparse.vstack([jacobian, states.jacobian])) if len(on_states) else jacobian,
                np.concatenate([linear.excess() - jacobian @ change, states.excess]),
                np.maximum(bounds[0], z - room),
                np.minimum(bounds[1], z + room),
                len(on_states),
            )
            begin = Pair(z, np.concatenate([multiplier, on_states]), bent)
            ending = Ending(PROGRAM.iterations, PROGRAM.accuracy * room)
            further, multiplier, bent = improved(program, begin, PROGRAM.balance / room, ending)
            moved, z = np.abs(further - z).max(), further
            multipliers = np.zeros_like(multipliers)
            np.add.at(multipliers, (rows.kind, rows.cell), multiplier[: len(rows.kind)])
            on_states = multiplier[len(rows.kind) :]
            if moved <= PROGRAM.accuracy * radius:
                break
        if not states.violated:
            # What programs leave of them would be left after a trial: the nearest step that meets them.
            z = pushed(-z, 1.0, raw, states.excess, *bounds, PROGRAM.push, np.zeros((0, space.n))).z
        return Step(self.smooth.apply(z), number + 1, multipliers)

    def _raw(self, rows: np.ndarray) -> np.ndarray:
        """Rows (k, n) of derivatives with respect to the raw variables."""
        return np.reshape([self.smooth.transpose(row) for row in rows], rows.shape)

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


def build_sequential_quadratic(space: DesignSpace, smooth: Smoothing, limits: ShapeLimits) -> SequentialQuadratic:
    """A stepper without multipliers yet."""
    return SequentialQuadratic(space, smooth, limits, np.zeros((len(ROWS), limits.cells)))
