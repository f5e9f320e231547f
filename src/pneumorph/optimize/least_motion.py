"""The least smooth motion of the surfaces that satisfies linearised limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.optimize.primal_dual import Ending, Pair, Program, improved
from pneumorph.optimize.settings import MotionSettings
from pneumorph.optimize.smoothing import Smoothing

MOTION = MotionSettings()

_ANYWHERE = 1e9
"""mm; compiled code takes all numbers to be finite."""


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
    farthest: float = np.inf,
    dense: int = 0,
    settings: MotionSettings = MOTION,
) -> SmoothMotion:
    """The smooth step Ψ = S z with the least slope·Ψ + ½‖z‖² that keeps c + J Ψ ≤ 0, nearly.

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
        To which rows are met, as far as some iterations bring them.
    farthest : float
        How far a raw variable may move, mm.
    dense : int
        How many of the last rows are of all variables.
    settings : MotionSettings
    """
    box = np.full(len(slope), min(farthest, _ANYWHERE))
    program = Program(smooth, slope, np.zeros((0, len(slope))), 1.0, jacobian, excess, -box, box, dense)
    found = Pair(np.zeros(len(slope)), np.zeros(len(excess)), np.zeros(0))
    ending = Ending(settings.iterations, steady=settings.steady, met=np.broadcast_to(accuracy, excess.shape))
    for balance in settings.balances:
        found = improved(program, found, balance, ending)
        if (excess + jacobian @ smooth.apply(found.z) <= accuracy).all():
            break
    return SmoothMotion(found.z, smooth.apply(found.z))
