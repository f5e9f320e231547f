"""The part of a sub-problem that rows of all variables decide: limits on states, and the curvature of the objective.

Where the objective is the pressure of a chamber, the multiplier that balances it is hundreds of times what an iteration
of the programs changes it by, and a step from programs that end before is as far beyond the limit as the linearised row
says. So it is near a target: the curvature of a sum of squares turns the whole gradient within a small part of a step,
and a step that does not know it goes to the other side of the target. Without limits on the shape, variables do not
depend on each other but through these rows: the step is known for any multipliers, and these are where a smooth concave
function of as many variables as there are rows, the dual, is largest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize


class Pushed(NamedTuple):
    """Raw variables z (n,), the multipliers (k,) of the limits that push them there, and squares z (q,)."""

    z: np.ndarray
    multiplier: np.ndarray
    bent: np.ndarray


def pushed(
    slope: np.ndarray,
    pull: float,
    rows: np.ndarray,
    excess: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    give: float,
    squares: np.ndarray,
) -> Pushed:
    """The solution of min slope·z + ½ pull ‖z‖² + ½ ‖squares z‖² + ½ Σ w s² over a box, under excess + rows z ≤ s.

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
    squares : (q, n) array
        Curvature. The more orthogonal these rows are, the sooner the solution is found.
    """
    count, limited = len(rows), np.concatenate([rows, squares])
    mean = np.maximum(np.abs(limited).mean(axis=1), 1e-12)
    scaled, beyond = limited / mean[:, None], np.append(excess, np.zeros(len(squares))) / mean
    # ½ (row·z)² is what a limit row·z ≤ 0 costs that gives way with w = 1, for both signs.
    stiffness = np.append(give * mean[:count], mean[count:] ** 2)

    def at(multiplier: np.ndarray) -> np.ndarray:
        return np.clip(-(slope + multiplier @ scaled) / pull, lower, upper)

    def dual(multiplier: np.ndarray) -> tuple[float, np.ndarray]:
        z, given = at(multiplier), multiplier / stiffness
        left = scaled @ z + beyond
        value = slope @ z + 0.5 * pull * z @ z + multiplier @ (left - 0.5 * given)
        return -float(value), given - left

    found = stiffness * np.maximum(beyond, 0.0)
    if len(found):
        bounds = [(0.0, None)] * count + [(None, None)] * len(squares)
        found = minimize(dual, found, jac=True, method="L-BFGS-B", bounds=bounds).x
    return Pushed(at(found), found[:count] / mean[:count], found[count:] / mean[count:])
