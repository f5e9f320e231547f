"""The least smooth motion of the surfaces that satisfies linearised limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.optimize.accelerated import minimise, tightened
from pneumorph.optimize.products import SparseRows
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
    rows = SparseRows.of(jacobian)
    moduli = rows.moduli()

    def product(multiplier: np.ndarray) -> np.ndarray:
        return rows.times(smooth.apply(smooth.transpose(rows.transposed_times(multiplier))))

    whole = moduli.times(smooth.moduli.apply(smooth.moduli.transpose(moduli.transposed_times(np.ones(len(excess))))))
    scale = tightened(np.maximum(whole, 1e-12), product)
    elastic, pushed = settings.compliance * scale, excess - rows.times(smooth.apply(smooth.transpose(slope)))
    multipliers = minimise(
        lambda multiplier: elastic * multiplier - pushed + product(multiplier),
        np.maximum(excess, 0.0) / scale,
        np.zeros(len(excess)),
        np.full(len(excess), np.inf),
        scale + elastic,
        settings.iterations,
        accuracy / (scale + elastic),
    )
    z = -smooth.transpose(slope + rows.transposed_times(multipliers))
    return SmoothMotion(z, smooth.apply(z))
