"""The default sub-problem: an augmented Lagrangian of the limits, minimised by L-BFGS-B over smooth steps in a box.

The step is Ψ = S z with |z| ≤ Ξ, so the trust region (33) is a bound that L-BFGS-B keeps exactly, not a penalty. Limits
are priced by an augmented Lagrangian (Hestenes 1969; Powell 1969; Rockafellar 1973): a multiplier to every sample, kept
from design to design and through remeshing, since samples sit at fixed surface parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy import optimize

from pneumorph.constraint import Limits, Pairs
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.optimize.curvature import Curvature, no_curvature, unpack_curvature
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.step import Step, proxy_scale

STIFFNESS = 1000.0
"""ρ: price of a limit broken by one per cent, as a multiplier, over one per cent."""

MARGIN = {"curvature": 0.01, "skew": 0.04, "stretch": 0.06}
SMALL_MARGIN = 0.004
"""Limits are tightened by these fractions, for what lies between the optimiser's samples: measured against samples
twice as fine."""

REPORTED = {"rim": "fold"}
"""Limits that the report has under another name."""

NOT_WIDER: Mapping[str, float] = {}

PROXIMITY = 1.0
"""Variables whose gradient is below this multiple of the mean do not go the whole radius: what is noise of the mesh
there stays small."""

WORST = 0.02
"""A violation beyond this raises a multiplier no further: a step that broke a limit must not forbid the next ones."""

ROUNDS, MOST_ITERATIONS, RESTORING = 3, 10, 60
"""Updates of the multipliers in a sub-problem, and L-BFGS-B iterations in each; more of them where limits are all that
counts, so that the step is small and leaves nothing broken."""


@dataclass(frozen=True, eq=False)
class Proxy:
    """The objective near a design: its gradient (31), the curvature that past steps have shown, scale in the merit."""

    slope: np.ndarray
    factors: np.ndarray
    scale: float

    def change(self, step: np.ndarray) -> tuple[float, np.ndarray]:
        """Expected change of J over a step (n,), and its gradient."""
        bent = self.factors @ step
        return float(self.slope @ step + 0.5 * bent @ bent), self.slope + bent @ self.factors


@dataclass(frozen=True, eq=False)
class AugmentedLagrangian:
    """Finds steps for a design space under limits.

    Attributes
    ----------
    reference : Ξ₀, the problem's reference step, mm.
    multipliers : λ ≥ 0 by limit, an entry per sample.
    curvature : what the steps so far have shown of the objective's curvature.
    """

    space: DesignSpace
    smooth: Smoothing
    limits: Limits
    reference: float
    multipliers: dict[str, np.ndarray]
    curvature: Curvature

    def step(self, phi: np.ndarray, slope: np.ndarray, radius: float) -> Step:
        """See `Stepper.step`."""
        scale = proxy_scale(slope, self.reference)
        curvature = self.curvature.seen(phi, slope)
        proxy = Proxy(slope, curvature.factors(), scale)
        found = self._minimise(phi, proxy, radius, self.multipliers, STIFFNESS)
        if not found.gain > 0:
            # Multipliers that a bad step has driven too high forbid every move; without them limits are learnt anew.
            found = self._minimise(phi, proxy, radius, self._none(), STIFFNESS)
        return replace(found, learnt=(found.learnt, curvature))

    def restoring(self, phi: np.ndarray, radius: float, wider: Mapping[str, float]) -> Step:
        """A step back within the limits, whatever the objective does; margins are `wider` by limits of the report."""
        nothing = Proxy(np.zeros_like(phi), np.zeros((0, len(phi))), 0.0)
        return self._minimise(phi, nothing, radius, self._none(), 100 * STIFFNESS, wider, RESTORING)

    def taught(self, step: Step, slope: np.ndarray, slope_there: np.ndarray) -> AugmentedLagrangian:
        """See `Stepper.taught`."""
        _, curvature = step.learnt
        return replace(self, curvature=curvature.with_pair(step.change, slope_there - slope))

    def after(self, step: Step) -> AugmentedLagrangian:
        """See `Stepper.after`."""
        multipliers, curvature = step.learnt
        return replace(self, multipliers=multipliers, curvature=curvature)

    def _none(self) -> dict[str, np.ndarray]:
        return {name: np.zeros_like(value) for name, value in self.multipliers.items()}

    def pack(self) -> dict[str, Any]:
        """See `Stepper.pack`."""
        return {f"multipliers_{name}": value for name, value in self.multipliers.items()} | self.curvature.pack()

    def unpack(self, state: dict[str, Any]) -> AugmentedLagrangian:
        """See `Stepper.unpack`."""
        multipliers = {name: state[f"multipliers_{name}"] for name in self.multipliers}
        return replace(self, multipliers=multipliers, curvature=unpack_curvature(state))

    def _minimise(
        self,
        phi,
        proxy: Proxy,
        radius,
        multipliers: Mapping[str, Any],
        stiffness,
        wider: Mapping[str, float] = NOT_WIDER,
        iterations=MOST_ITERATIONS,
    ) -> Step:
        space, limits, smooth = self.space, self.limits, self.smooth
        margins = {name: _margin(name) + wider.get(REPORTED.get(name, name), 0.0) for name in multipliers}
        start = space.control_points(phi)
        pairs = _on_device(limits.pairs(start))
        multipliers = _on_device(multipliers)
        bounds = np.column_stack([np.maximum(-radius, space.lower - phi), np.minimum(radius, space.upper - phi)])
        pull = PROXIMITY * proxy.scale * float(np.abs(proxy.slope).mean()) / radius
        evaluations = 0

        def merit(z):
            nonlocal evaluations
            evaluations += 1
            change = smooth.apply(z)
            price, rise = _price(limits, space.control_points(phi + change), pairs, multipliers, stiffness, margins)
            expected, tilt = proxy.change(change)
            value = proxy.scale * expected + float(price) + 0.5 * pull * (z @ z)
            return value, smooth.transpose(proxy.scale * tilt + space.pullback(np.asarray(rise))) + pull * z

        z, points = np.zeros(space.n), start
        for round_ in range(ROUNDS):
            if round_:
                multipliers = _on_device(_raised(limits, points, pairs, multipliers, stiffness, margins))
            options = {"maxiter": iterations, "maxcor": 20, "ftol": 1e-14, "gtol": 1e-9}
            found = optimize.minimize(merit, z, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
            # Dearer limits may leave no gain in the step so far; then it starts anew.
            z = found.x if found.fun < merit(0 * z)[0] else 0 * z
            points = space.control_points(phi + smooth.apply(z))
            # Feet are found anew where the first round went, and wherever the body has moved far.
            if round_ == 0 or limits.moved(points, pairs):
                pairs = _on_device(limits.pairs(points))
        change = smooth.apply(z)
        before, _ = _price(limits, start, pairs, multipliers, stiffness, margins)
        after, _ = _price(limits, points, pairs, multipliers, stiffness, margins)
        expected, _ = proxy.change(change)
        gain = float(before - after) - proxy.scale * expected
        learnt = _raised(limits, points, pairs, multipliers, stiffness, margins)
        return Step(change, proxy.scale, expected, gain, evaluations, learnt)


def augmented_lagrangian(
    space: DesignSpace, smooth: Smoothing, limits: Limits, reference: float
) -> AugmentedLagrangian:
    """A stepper that knows nothing yet."""
    points = space.control_points(space.start)
    values = _values(limits, points, limits.pairs(points))
    nothing = {name: np.zeros(len(c)) for name, c in values.items()}
    return AugmentedLagrangian(space, smooth, limits, reference, nothing, no_curvature(space.n))


def _margin(name: str) -> float:
    return MARGIN.get(name, SMALL_MARGIN)


def _on_device(arrays):
    """Arrays as JAX's own, made once: handing NumPy's over costs more than an evaluation does."""
    return jax.tree.map(jnp.asarray, arrays)


def _raised(limits, points, pairs, multipliers, stiffness, margins) -> dict[str, np.ndarray]:
    """Multipliers λ ← max(0, λ + ρ c), c taken for no worse than `WORST`."""
    values = _values(limits, points, pairs)
    return {
        name: np.maximum(0.0, multipliers[name] + stiffness * np.minimum(np.asarray(c) + margins[name], WORST))
        for name, c in values.items()
    }


@partial(jax.jit, static_argnums=0)
def _values(limits: Limits, points: Array, pairs: Pairs) -> dict[str, Array]:
    return limits.values(points, pairs)


@partial(jax.jit, static_argnums=0)
def _price(
    limits: Limits,
    points: Array,
    pairs: Pairs,
    multipliers: dict[str, Array],
    stiffness: float,
    margins: dict[str, float],
):
    """Σ over limits of the mean over samples of (max(0, λ + ρ c)² − λ²)/2ρ, and its gradient (n_points, 3)."""

    def price(points):
        total = 0.0
        for name, c in limits.values(points, pairs).items():
            if len(c):
                active = jnp.maximum(0.0, multipliers[name] + stiffness * (c + margins[name]))
                total += jnp.mean(active**2 - multipliers[name] ** 2) / (2 * stiffness)
        return total

    return jax.value_and_grad(price)(points)
