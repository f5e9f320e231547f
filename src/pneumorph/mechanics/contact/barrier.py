"""The barrier by which surfaces press on each other, as a function of their distance.

    b(d) = −κ d̂ (d/d̂ − 1)² ln(d/d̂) for d < d̂, else 0

is that of incremental potential contact (Li et al. 2020, ACM Trans. Graph. 39(4) 49): it has two continuous
derivatives, is zero from the activation distance d̂ on, and infinite where surfaces meet. −b′ is a contact pressure in
MPa. It is κ/d̂ times the barrier of ipctk, which has it for one number at a time and for its own pairs of parts, and so
serves `pairs.py` alone: terms of elements need it in JAX, and obstacles of triangles for many distances at once.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.terms import Values


def barrier(distance: Values, activation: Values, stiffness: Values) -> Array:
    """b(d) in N/mm, for JAX; not a number where surfaces have met."""
    share = distance / activation
    near = share < 1.0
    inside = jnp.where(near & (share > 0.0), share, 1.0)
    value = -stiffness * activation * (inside - 1.0) ** 2 * jnp.log(inside)
    return jnp.where(share > 0.0, value, jnp.nan)


def barrier_derivatives(
    distance: np.ndarray, activation: float, stiffness: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """b(d) in N/mm, b′ and b″."""
    share = np.clip(distance / activation, 1e-300, 1.0)
    less, log = share - 1.0, np.log(share)
    return (
        -stiffness * activation * less**2 * log,
        -stiffness * (2.0 * less * log + less**2 / share),
        -stiffness / activation * (2.0 * log + 4.0 * less / share - (less / share) ** 2),
    )
