"""First-order optimality of a design under its limits: what of the gradient the limits do not resist."""

from __future__ import annotations

import numpy as np

from pneumorph.constraint.rows import linearised
from pneumorph.constraint.sampled import LimitSamples
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.within import least_motion, limits_by_variables

ACTIVE = 0.01
"""Limits this close to their bounds, as fractions of them, resist."""


def optimality(
    space: DesignSpace, smooth: Smoothing, limits: LimitSamples, phi: np.ndarray, slope: np.ndarray
) -> float:
    """‖Sᵀ(∂J/∂Φ + Jᵀλ)‖₁ over ‖Sᵀ ∂J/∂Φ‖₁ for the multipliers λ ≥ 0 of the active limits that resist most.

    The projected gradient in the metric of smooth steps: 0 where the Karush–Kuhn–Tucker conditions hold, 1 where no
    limit resists. Sums of moduli are what a step in a box gains to first order; squares would tell of the few sharp
    places alone where the gradient peaks. Pressures at their bounds do not count where they would pass them.
    """
    free = ~((phi <= space.lower) & (slope > 0) | (phi >= space.upper) & (slope < 0))
    slope = np.where(free, slope, 0.0)
    whole = float(np.abs(smooth.transpose(slope)).sum())
    if whole == 0.0:
        return 0.0
    rows = linearised(limits, space.body(phi), ACTIVE * limits.spec.wall, -ACTIVE)
    if not len(rows.value):
        return 1.0
    left = least_motion(smooth, limits_by_variables(space, rows.jacobian), np.zeros(len(rows.value)), slope / whole)
    return min(float(np.abs(left.raw).sum()), 1.0)
