"""The paper's sub-problem (33).

Penalties (32), DFP with backtracking (35)(36), the ℵ-rule (37)(38) and the convergence criteria of V-E.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.of_shape import LimitFunctions
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Step


@dataclass(frozen=True)
class PaperSettings:
    """Constants of the paper's sub-problem; those without another source are of its Table I."""

    order: int = 5
    """b, the power of penalties in (32)."""

    tolerance: float = 0.05
    """ε_t of (33), mm."""

    iterations: float = 200.0
    """ℵ¹, the most iterations of the first sub-problem."""

    smallest_step: float = 1e-5
    """ε_α, at which the line search ends."""

    change: float = 0.2
    """Threshold of λ in (37)."""

    more: float = 1.2
    """β₁ of (37)."""

    fewer: float = 0.9
    """β₂ of (37)."""

    decrease: float = 1e-4
    """Share of the first-order decrease that a step of the line search (35) has to reach (Nocedal & Wright 2006,
    algorithm 3.1)."""


PAPER = PaperSettings()


@dataclass(frozen=True, eq=False)
class PaperStepper:
    """The paper's way of finding steps.

    Attributes
    ----------
    reference : Ξ₀, the problem's reference step, mm.
    iterations : ℵ, the most iterations of a sub-problem.
    last_slope : gradient of the merit at the last design, for (38); empty before the first.
    """

    space: DesignSpace
    limits: LimitFunctions
    reference: float
    iterations: float = PAPER.iterations
    last_slope: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def step(self, phi: np.ndarray, proxy: Proxy, radius: float, states: StateLimits) -> Step:
        """The step by the paper's sub-problem; its proxy (31) is linear.

        Parameters
        ----------
        phi, proxy, radius, states
            As for `Stepper.step`.
        """
        space, limits, slope = self.space, self.limits, proxy.slope
        scale = proxy_scale(slope, self.reference)
        start = space.control_points(phi)
        pairs = jax.tree.map(jnp.asarray, limits.partners(start))
        below, above = np.isfinite(space.lower), np.isfinite(space.upper)

        def merit(psi):
            penalty, rise = _penalty(limits, space.control_points(phi + psi), pairs)
            value, change = (
                scale * float(slope @ psi) + float(penalty),
                scale * slope + space.pullback(np.asarray(rise)),
            )
            beyond = np.maximum(0.0, (np.abs(psi) - radius) / PAPER.tolerance)
            value += float(np.sum(beyond**PAPER.order))
            change = change + PAPER.order * beyond ** (PAPER.order - 1) / PAPER.tolerance * np.sign(psi)
            over = np.maximum(0.0, (states.excess + states.jacobian @ psi) / PAPER.tolerance)
            value += float(np.sum(over**PAPER.order))
            change = change + (PAPER.order * over ** (PAPER.order - 1) / PAPER.tolerance) @ states.jacobian
            return value, change

        counted = _Counted(merit)
        _, first_slope = merit(np.zeros_like(phi))
        psi = minimise_dfp(counted, np.zeros_like(phi), int(self.iterations))
        psi = np.clip(psi, np.where(below, space.lower - phi, -np.inf), np.where(above, space.upper - phi, np.inf))
        return Step(psi, counted.count, first_slope)

    def after(self, step: Step) -> PaperStepper:
        """The ℵ-rule (37): more iterations while the gradient changes little (38)."""
        if not len(self.last_slope):
            return replace(self, last_slope=step.learnt)
        change = np.abs(step.learnt - self.last_slope).sum() / np.abs(self.last_slope).sum()
        factor = PAPER.more if change <= PAPER.change else PAPER.fewer
        return replace(self, last_slope=step.learnt, iterations=max(factor * self.iterations, 1.0))

    def pack(self) -> dict[str, Any]:
        """See `Stepper.pack`."""
        return {"dfp_slope": self.last_slope, "dfp_iterations": self.iterations}

    def unpack(self, state: dict[str, Any]) -> PaperStepper:
        """See `Stepper.unpack`."""
        return replace(self, last_slope=np.asarray(state["dfp_slope"]), iterations=float(state["dfp_iterations"]))


def proxy_scale(slope: np.ndarray, reference: float) -> float:
    """Scale of the objective in the merit, 1/(Ξ₀ ‖∂J/∂Φ‖₁): the units of Φ, pressures and J drop out; Ξ₀ in mm."""
    return 1.0 / (reference * max(float(np.abs(slope).sum()), 1e-300))


class _Counted:
    """A function that counts its calls."""

    def __init__(self, function: Callable):
        self.function, self.count = function, 0

    def __call__(self, x):
        self.count += 1
        return self.function(x)


def minimise_dfp(function: Callable[[np.ndarray], tuple[float, np.ndarray]], x: np.ndarray, most: int) -> np.ndarray:
    """Minimise by Davidon–Fletcher–Powell (36) with backtracking (35).

    The inverse Hessian is kept as its update pairs, B⁻¹ = γ I + Σ s sᵀ/(yᵀs) − Σ (B⁻¹y)(B⁻¹y)ᵀ/(yᵀB⁻¹y): the same
    matrix as (36) at the cost of a few vectors instead of n² numbers.

    Parameters
    ----------
    function : value and gradient (n,) at x (n,).
    most : ℵ, the most iterations.

    Returns
    -------
    (n,) where the search ended: after `most` iterations, or when the line search found no step above ε_α.
    """
    value, slope = function(x)
    initial = PAPER.tolerance / max(np.abs(slope).max(), 1e-300)
    moves, weights, images, image_weights = [], [], [], []

    def apply(v):
        out = initial * v
        for s, a, h, b in zip(moves, weights, images, image_weights, strict=True):
            out = out + (s @ v / a) * s - (h @ v / b) * h
        return out

    for _ in range(most):
        direction = -apply(slope)
        descent = slope @ direction
        if not descent < 0:
            break
        length = 1.0
        while length >= PAPER.smallest_step:
            trial_value, trial_slope = function(x + length * direction)
            if np.isfinite(trial_value) and trial_value <= value + PAPER.decrease * length * descent:
                break
            length *= 0.5
        else:
            break
        s, y = length * direction, trial_slope - slope
        x, value, slope = x + s, trial_value, trial_slope
        if y @ s > 1e-12 * np.linalg.norm(y) * np.linalg.norm(s):
            image = apply(y)
            moves.append(s)
            weights.append(y @ s)
            images.append(image)
            image_weights.append(y @ image)
    return x


@partial(jax.jit, static_argnums=0)
def _penalty(limits: LimitFunctions, points, pairs):
    """The penalties of (33), integrals over the unit square as means over the samples, and their gradient."""

    def penalty(points):
        arguments = limits.paper_arguments(limits.values(points, pairs), PAPER.tolerance).values()
        return sum(jnp.mean(jnp.maximum(0.0, x) ** PAPER.order) for x in arguments if len(x))

    return jax.value_and_grad(penalty)(points)
