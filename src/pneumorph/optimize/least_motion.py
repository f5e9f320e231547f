"""The least smooth motion of the surfaces that satisfies linearised limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.optimize.accelerated import minimise, tightened
from pneumorph.optimize.settings import MotionSettings
from pneumorph.optimize.smoothing import Smoothing

MOTION = MotionSettings()


@dataclass(frozen=True, eq=False)
class SmoothMotion:
    """A smooth step Ψ = S z: raw z and smooth Ψ, (n,) each."""

    raw: np.ndarray
    smooth: np.ndarray


def least_motion(
    smooth: Smoothing,
    jacobian: sparse.csr_array,
    excess: np.ndarray,
    slope: np.ndarray,
    accuracy: np.ndarray | float,
    settings: MotionSettings = MOTION,
) -> SmoothMotion:
    """The smooth step Ψ = S z with the least slope·Ψ + ½‖z‖² that keeps c + J Ψ ≤ 0, nearly.

    By its dual, min ½‖Sᵀ(slope + Jᵀλ)‖² − cᵀλ + ½ λᵀελ over λ ≥ 0, whose z is −Sᵀ(slope + Jᵀλ); ε lets rows give way.
    Multipliers are changed until every row is met to its `accuracy` (m,), or as far as some iterations bring them.

    Parameters
    ----------
    smooth : Smoothing
    jacobian : csr (m, n)
        J, 1/mm.
    excess : (m,) array
        c.
    slope : (n,) array
        Per mm.
    accuracy : float or (m,) array
        To which rows are met.
    settings : MotionSettings
    """
    multipliers, motion = np.zeros(len(excess)), _moved(smooth, slope)
    # Most rows stay met. Only those are taken into account that are not met now, or that a motion would not meet.
    own = excess >= 0.0
    for _ in range(settings.rounds):
        rows = np.flatnonzero(own)
        part = jacobian[rows]
        near = accuracy[rows] if isinstance(accuracy, np.ndarray) else accuracy
        multipliers[rows] = _balanced(smooth, part, excess[rows], slope, near, multipliers[rows], settings)
        motion = _moved(smooth, slope + part.T @ multipliers[rows])
        left = ~own & (excess + jacobian @ motion.smooth > accuracy)
        if not left.any():
            break
        own |= left
    return motion


def _moved(smooth: Smoothing, slope: np.ndarray) -> SmoothMotion:
    """The motion down a slope (n,)."""
    z = -smooth.transpose(slope)
    return SmoothMotion(z, smooth.apply(z))


def _balanced(
    smooth: Smoothing,
    jacobian: sparse.csr_array,
    excess: np.ndarray,
    slope: np.ndarray,
    accuracy: np.ndarray | float,
    start: np.ndarray,
    settings: MotionSettings,
) -> np.ndarray:
    """The multipliers (m,) of rows c + J Ψ ≤ 0, see `least_motion`.

    They begin at those known, `start` (m,); where that is 0, at what its row would need by itself.
    """
    transposed, moduli = sparse.csr_array(jacobian.T), abs(jacobian)

    def product(multiplier: np.ndarray) -> np.ndarray:
        return jacobian @ smooth.apply(smooth.transpose(transposed @ multiplier))

    whole = moduli @ smooth.moduli.apply(smooth.moduli.transpose(moduli.T @ np.ones(len(excess))))
    scale = tightened(np.maximum(whole, 1e-12), product)
    elastic, pushed = settings.compliance * scale, excess - jacobian @ smooth.apply(smooth.transpose(slope))
    return minimise(
        lambda multiplier: elastic * multiplier - pushed + product(multiplier),
        np.where(start > 0.0, start, np.maximum(excess, 0.0) / scale),
        np.zeros(len(excess)),
        np.full(len(excess), np.inf),
        scale + elastic,
        settings.iterations,
        accuracy / (scale + elastic),
    )
