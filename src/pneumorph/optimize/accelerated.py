"""Minimise convex functions in a box: projected gradients with Nesterov's acceleration, scaled and restarted.

The scaling is a diagonal D with D − Hessian positive semidefinite, so no line search is needed (Beck & Teboulle 2009);
momentum is dropped where it points uphill (O'Donoghue & Candès 2015).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pneumorph.interrupts import stop_if_asked

SAFETY = 1.1
"""Safety factor on the largest eigenvalue from the power method, which is a lower bound."""

Map = Callable[[np.ndarray], np.ndarray]


def minimise(
    gradient: Map,
    z: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    scale: np.ndarray,
    iterations: int,
    tolerance: float | np.ndarray,
) -> np.ndarray:
    """The minimum (n,) of a convex function in a box.

    Parameters
    ----------
    gradient : of the function at z (n,).
    z : (n,) where the iteration begins.
    lower, upper : (n,) bounds.
    scale : (n,) D, so that D − Hessian is positive semidefinite everywhere.
    iterations : most iterations.
    tolerance : float or (n,); it ends when no entry of z moves farther than this in an iteration.
    """
    ahead, momentum = z, 1.0
    for _ in range(iterations):
        stop_if_asked()
        slope = gradient(ahead)
        following = np.clip(ahead - slope / scale, lower, upper)
        step = following - z
        if slope @ step > 0:
            momentum = 1.0
        grown = (1.0 + np.sqrt(1.0 + 4.0 * momentum**2)) / 2.0
        ahead = following + (momentum - 1.0) / grown * step
        z, momentum = following, grown
        if (np.abs(step) <= tolerance).all():
            break
    return z


def tightened(scale: np.ndarray, product: Map, rounds: int = 10) -> np.ndarray:
    """Reduce a safe scaling D (n,) to the smallest multiple of it that is still safe.

    The factor is the largest eigenvalue of D^(−1/2) H D^(−1/2), by `rounds` of the power method; `product` multiplies
    the Hessian H with a vector.
    """
    root = np.sqrt(scale)
    vector, largest = root / max(float(np.linalg.norm(root)), 1e-300), 1.0
    for _ in range(rounds):
        image = product(vector / root) / root
        largest = float(np.linalg.norm(image))
        if largest == 0.0:
            return scale
        vector = image / largest
    return scale * min(SAFETY * largest, 1.0)
