"""The part of a sub-problem that rows of all variables decide: limits on states, and the curvature of the objective.

Where the objective is the pressure of a chamber, the multiplier that balances it is hundreds of times what an iteration
of the programs changes it by, and a step from programs that end before is as far beyond the limit as the linearised row
says. So it is near a target: the curvature of a sum of squares turns the whole gradient within a small part of a step,
and a step that does not know it goes to the other side of the target. Without limits on the shape, variables do not
depend on each other but through these rows: the step is known for any multipliers, and these are where a smooth concave
function of as many variables as there are rows, the dual, is largest.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

STEPS, HALVINGS = 100, 60
"""Most steps of Newton's method, and halvings of the part of one where the function is least along it."""

ACCURACY = 1e-13
"""What a step would still gain where the method ends, relative to the dual."""

FLATTER = 0.1
"""Of a step that is too long, a part is taken at which the slope along it is no more than this part of the first."""

ROUNDING = 1e-12
"""Added to second derivatives that are scaled to one: rows may depend on each other."""

Derivatives = tuple[float, np.ndarray, Callable[[np.ndarray], np.ndarray]]


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
        return -(slope + multiplier @ scaled) / pull

    def dual(multiplier: np.ndarray) -> Derivatives:
        free, given = at(multiplier), multiplier / stiffness
        z = np.clip(free, lower, upper)
        left = scaled @ z + beyond
        value = slope @ z + 0.5 * pull * z @ z + multiplier @ (left - 0.5 * given)
        inside = (free > lower) & (free < upper)

        def curvature(some: np.ndarray) -> np.ndarray:
            moved = scaled[np.ix_(some, inside)]
            return np.diag(1.0 / stiffness[some]) + moved @ moved.T / pull

        return -float(value), given - left, curvature

    least = np.append(np.zeros(count), np.full(len(squares), -np.inf))
    found = _least_of(dual, np.maximum(stiffness * beyond, least), least)
    return Pushed(np.clip(at(found), lower, upper), found[:count] / mean[:count], found[count:] / mean[count:])


def _least_of(function: Callable[[np.ndarray], Derivatives], x: np.ndarray, least: np.ndarray) -> np.ndarray:
    """The minimum (m,) of a convex function of quadratic pieces where x ≥ least, by Newton's method.

    From piece to piece it converges in a few steps, as it does where derivatives are smooth (Qi & Sun 1993), however
    unlike the curvatures are: methods of first order need thousands, and end far from the minimum. Entries at their
    bounds that the gradient pushes there are held (Bertsekas 1982).

    Parameters
    ----------
    function : callable
        Returns the value at x (m,), its gradient, and a function that gives the second derivatives by some entries.
    x : (m,) array
        Where the method begins.
    least : (m,) array
        Lower bounds.
    """
    value, gradient, curvature = function(x)
    for _ in range(STEPS):
        some = np.flatnonzero((x > least) | (gradient < 0.0))
        H = curvature(some)
        scale = 1.0 / np.sqrt(np.diag(H))
        H = H * scale[:, None] * scale + ROUNDING * np.eye(len(some))
        step = np.zeros(len(x))
        step[some] = -scale * np.linalg.solve(H, scale * gradient[some])
        steep = gradient @ step
        if -steep <= ACCURACY * abs(value):
            break
        low, high, part = 0.0, 1.0, 1.0
        following = np.maximum(x + step, least)
        new = function(following)
        for _ in range(HALVINGS):
            along = new[1] @ np.where(following > least, step, 0.0)
            if along > -FLATTER * steep:
                high = part
            elif part == 1.0 or along >= FLATTER * steep:
                break
            else:
                low = part
            part = 0.5 * (low + high)
            following = np.maximum(x + part * step, least)
            new = function(following)
        if not new[0] < value:
            break
        x, (value, gradient, curvature) = following, new
    return x
