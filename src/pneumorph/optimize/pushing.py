"""The part of a sub-problem that limits on states decide: their multipliers, and the nearest step that meets them.

A row of such a limit is of all variables. Where the objective is the pressure of a chamber, the multiplier that
balances it is hundreds of times what an iteration of the programs changes it by, and a step from programs that end
before is as far beyond the limit as the linearised row says. Without limits on the shape and known curvature, variables
do not depend on each other: the step is known for any multipliers, and these are where a smooth concave function of as
many variables as there are rows, the dual, is largest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize


class Pushed(NamedTuple):
    """Raw variables z (n,), and the multipliers (k,) of the rows that push them there."""

    z: np.ndarray
    multiplier: np.ndarray


def pushed(
    slope: np.ndarray,
    pull: float,
    rows: np.ndarray,
    excess: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    give: float,
) -> Pushed:
    """The solution of min slope·z + ½ pull ‖z‖² + ½ Σ w s² over a box, under excess + rows z ≤ s.

    Rows give way by s, so that there is one where no z satisfies all of them: the multiplier of a row is w s.

    Parameters
    ----------
    slope : (n,) array
    pull : float
    rows, excess : (k, n) and (k,) arrays
    lower, upper : (n,) arrays
        The box of z.
    give : float
        w times the mean absolute derivative of a row.
    """
    mean = np.maximum(np.abs(rows).mean(axis=1), 1e-12)
    scaled, beyond = rows / mean[:, None], excess / mean

    def at(multiplier: np.ndarray) -> np.ndarray:
        return np.clip(-(slope + multiplier @ scaled) / pull, lower, upper)

    def dual(multiplier: np.ndarray) -> tuple[float, np.ndarray]:
        z, given = at(multiplier), multiplier / (give * mean)
        left = scaled @ z + beyond
        value = slope @ z + 0.5 * pull * z @ z + multiplier @ (left - 0.5 * given)
        return -float(value), given - left

    begin = give * np.maximum(excess, 0.0)
    if len(begin):
        begin = minimize(dual, begin, jac=True, method="L-BFGS-B", bounds=[(0.0, None)] * len(begin)).x
    return Pushed(at(begin), begin / mean)
