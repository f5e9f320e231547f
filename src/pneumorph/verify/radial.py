"""Thick spheres and plane-strain tubes under internal pressure, solved as radial boundary-value problems.

With r(R) the deformed radius, the principal stretches are λ_r = r′ and λ_θ = r/R, and the nominal stresses
P_i = ∂ψ/∂λ_i satisfy P_r′ + n (P_r − P_θ)/R = 0; n is 2 for a sphere and 1 for a tube, where λ_z is 1. The Cauchy
stress P_r/λ_θⁿ is −p inside and 0 outside. SciPy's collocation solves this to 1e-10, for any ψ and any thickness.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.integrate import solve_bvp

from pneumorph.errors import ComputationError
from pneumorph.mechanics import Rubber
from pneumorph.mechanics.material.energies import SMALLEST_RATIO, Energy

TUBE, SPHERE = 1, 2
"""Number of directions in which a surface is curved."""

TOLERANCE = 1e-10
"""Relative residual of the collocation, far below what is compared."""

Displacement = Callable[[np.ndarray], np.ndarray]
"""Radial displacement in mm at undeformed radii in mm."""


def inflated(rubber: Rubber, inner: float, outer: float, pressure: float, curved: int) -> Displacement:
    """The radial displacement of a sphere or tube under internal pressure.

    Parameters
    ----------
    rubber : Rubber
    inner, outer : float
        Undeformed radii, mm.
    pressure : float
        Inside, MPa.
    curved : int
        `SPHERE` or `TUBE`.

    Raises
    ------
    ComputationError
        If the collocation does not converge, or converges to an impossible state, for example beyond a limit point.
    """
    slope, curvature = _principal(rubber, curved)

    def equations(R: np.ndarray, y: np.ndarray) -> np.ndarray:
        r, stretch = y
        P, dP = slope(stretch, r / R), curvature(stretch, r / R)
        along = dP[0, 1] * (stretch / R - r / R**2) + curved * (P[0] - P[1] / curved) / R
        return np.stack([stretch, -along / dP[0, 0]])

    def ends(inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
        hoop = inside[0] / inner
        return np.array(
            [
                slope(inside[1], hoop)[0] / hoop**curved + pressure,
                slope(outside[1], outside[0] / outer)[0],
            ]
        )

    R = np.linspace(inner, outer, 41)
    solution = solve_bvp(equations, ends, R, np.stack([R, np.ones_like(R)]), tol=TOLERANCE, max_nodes=100_000)
    if not solution.success:
        raise ComputationError(
            f"the radial boundary-value problem at {pressure:g} MPa was not solved: {solution.message}"
        )
    r, stretch = solution.y
    if np.min(stretch * (r / solution.x) ** curved) <= SMALLEST_RATIO:
        raise ComputationError(
            f"the solution of the radial boundary-value problem at {pressure:g} MPa is not a possible state of a body"
        )
    return lambda radius: solution.sol(radius)[0] - radius


def _principal(rubber: Rubber, curved: int):
    """First and second derivatives of ψ with respect to (λ_r, λ_θ), as functions of stretches of any shape.

    λ_θ stands for `curved` equal stretches, so ∂ψ/∂λ_θ is P_θ times their number.
    """
    of_rubber = rubber.energy, jnp.asarray(rubber.parameters), curved
    return (
        lambda radial, hoop: np.moveaxis(_evaluated(_slope, *of_rubber, radial, hoop), -1, 0),
        lambda radial, hoop: np.moveaxis(_evaluated(_curvature, *of_rubber, radial, hoop), (-2, -1), (0, 1)),
    )


def _psi(stretches: Array, energy: Energy, parameters: Array, curved: int) -> Array:
    """ψ of (λ_r, λ_θ)."""
    radial, hoop = stretches
    third = hoop if curved == SPHERE else 1.0
    return energy(jnp.diag(jnp.stack([radial, hoop, jnp.asarray(third)])), parameters)


# Compiled once for every kind of rubber.
@partial(jax.jit, static_argnums=(1, 3))
def _slope(points: Array, energy: Energy, parameters: Array, curved: int) -> Array:
    return jax.vmap(lambda stretches: jax.grad(_psi)(stretches, energy, parameters, curved))(points)


@partial(jax.jit, static_argnums=(1, 3))
def _curvature(points: Array, energy: Energy, parameters: Array, curved: int) -> Array:
    return jax.vmap(lambda stretches: jax.hessian(_psi)(stretches, energy, parameters, curved))(points)


def _evaluated(function, energy: Energy, parameters: Array, curved: int, radial, hoop) -> np.ndarray:
    """A derivative of ψ at many (λ_r, λ_θ), padded to one of a few lengths so that it is seldom compiled again."""
    points = np.stack(np.broadcast_arrays(radial, hoop), axis=-1)
    flat = points.reshape(-1, 2)
    padded = np.ones((max(64, 2 ** int(np.ceil(np.log2(len(flat))))), 2))
    padded[: len(flat)] = flat
    values = np.asarray(function(padded, energy, parameters, curved))[: len(flat)]
    return values.reshape(*points.shape[:-1], *values.shape[1:])


def lame(young: float, poisson: float, inner: float, outer: float, pressure: float, curved: int) -> Displacement:
    """The radial displacement in linear elasticity (Lamé; Timoshenko & Goodier 1970, arts. 28 and 142).

    Parameters
    ----------
    young : float
        Young's modulus, MPa.
    poisson : float
        Poisson's ratio.
    inner, outer : float
        Undeformed radii, mm.
    pressure : float
        Inside, MPa.
    curved : int
        `SPHERE` or `TUBE`.
    """
    if curved == SPHERE:
        scale = pressure * inner**3 / (young * (outer**3 - inner**3))
        return lambda R: scale * ((1 - 2 * poisson) * R + (1 + poisson) * outer**3 / (2 * R**2))
    scale = pressure * inner**2 * (1 + poisson) / (young * (outer**2 - inner**2))
    return lambda R: scale * ((1 - 2 * poisson) * R + outer**2 / R)
