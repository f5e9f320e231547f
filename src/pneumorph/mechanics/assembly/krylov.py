"""Linear systems K x = b by a factorisation M of a matrix near K, with a few products.

Where K and M are definite, by conjugate gradients. With the hydrostatic pressure as an unknown of its own they are not:
there the residual in the norm of M⁻¹ is minimised over the Krylov space (Saad and Schultz 1986, SIAM Journal on
Scientific and Statistical Computing 7, 856-869). Both tell how far from 1 the eigenvalues of M⁻¹K are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

Linear = Callable[[np.ndarray], np.ndarray]
"""A linear map of vectors (n,)."""


@dataclass(frozen=True)
class Solution:
    """Result of a linear solve.

    Attributes
    ----------
    x : (n,) array
    converged : bool
    spread : float
        An estimate, from below, of how far from 1 the eigenvalues of the preconditioned tangent are; infinite at
        negative curvature.
    """

    x: np.ndarray
    converged: bool
    spread: float


def conjugate_gradients(apply: Linear, precondition: Linear, rhs: np.ndarray, tolerance: float, most: int) -> Solution:
    """K x = rhs by preconditioned conjugate gradients.

    Stops at the relative `tolerance` in the preconditioner's norm, after `most` products, or at negative curvature.

    Parameters
    ----------
    apply : K.
    precondition : M⁻¹, definite.
    rhs : (n,) right-hand side.
    tolerance : relative residual in the norm of M⁻¹.
    most : products with K.
    """
    x, r = np.zeros_like(rhs), rhs
    z = precondition(r)
    p, rho = z, float(r @ z)
    target = tolerance**2 * rho
    steps, falls = [], []
    while rho > target and rho > 0:
        Kp = apply(p)
        curvature = float(p @ Kp)
        if not curvature > 0:
            return Solution(x if steps else p, False, np.inf)
        step = rho / curvature
        x, r = x + step * p, r - step * Kp
        steps.append(step)
        if len(steps) == most:
            return Solution(x, False, _spread(steps, falls))
        z = precondition(r)
        previous, rho = rho, float(r @ z)
        p = z + (rho / previous) * p
        falls.append(rho / previous)
    return Solution(x, True, _spread(steps, falls))


def minimal_residuals(apply: Linear, precondition: Linear, rhs: np.ndarray, tolerance: float, most: int) -> Solution:
    """K x = rhs by the least ‖M⁻¹(rhs − K x)‖ over the Krylov space of M⁻¹K.

    Parameters
    ----------
    apply : K.
    precondition : M⁻¹.
    rhs : (n,) right-hand side.
    tolerance : that norm relative to ‖M⁻¹rhs‖ at which it ends.
    most : products with K.
    """
    first = precondition(rhs)
    size = float(np.linalg.norm(first))
    if size == 0.0:
        return Solution(first, True, 0.0)
    space, H = [first / size], np.zeros((most + 1, most))
    y, converged, k = np.zeros(0), False, 0
    while not converged and k < most:
        image = precondition(apply(space[k]))
        for number, vector in enumerate(space):
            H[number, k] = vector @ image
            image = image - H[number, k] * vector
        k += 1
        H[k, k - 1] = length = float(np.linalg.norm(image))
        known = np.zeros(k + 1)
        known[0] = size
        y = np.linalg.lstsq(H[: k + 1, :k], known, rcond=None)[0]
        converged = float(np.linalg.norm(known - H[: k + 1, :k] @ y)) <= tolerance * size
        if length == 0.0:
            break
        space.append(image / length)
    spread = float(np.abs(np.linalg.eigvals(H[:k, :k]) - 1.0).max())
    return Solution(np.tensordot(y, space[:k], axes=1), converged, spread)


def _spread(steps: list[float], falls: list[float]) -> float:
    """From the coefficients of conjugate gradients, which make up Lanczos' matrix; 0 without a step."""
    if not steps:
        return 0.0
    a, b = np.array(steps), np.array(falls[: len(steps) - 1])
    diagonal = 1.0 / a
    diagonal[1:] += b / a[:-1]
    values = np.asarray(linalg.eigvalsh_tridiagonal(diagonal, np.sqrt(b) / a[:-1]))
    return float(np.abs(values - 1.0).max())
