"""Equilibria under prescribed displacements, by the textbook form of Newton's method.

The solvers of the package know supports at zero only, which is all that actuators need. Here the residual and the
tangent, which are under test, are those of the package; nothing else is.
"""

from __future__ import annotations

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.mechanics import Configuration, Tangent
from pneumorph.mechanics.assembly import potential as kernels

MOST_STEPS = 25
"""Of Newton's method, from a start that is nearly right."""


def residual(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """∂Π/∂u (n,) for all unknowns; where they are supported it is the reaction, N."""
    model = at.model
    _, gradient = kernels.value_and_residual(model.potential, at.X, model.state(vector), at.loads)
    return model.vector(gradient)


def equilibrium(at: Configuration, tangent: Tangent, vector: np.ndarray) -> np.ndarray:
    """The unknowns (n,) in equilibrium, with the supported ones as they are in `vector`.

    Raises
    ------
    ComputationError
        If Newton's method does not converge.
    """
    for _ in range(MOST_STEPS):
        forces = residual(at, vector)
        if not np.isfinite(forces).all():
            break
        free = np.where(at.constrained, 0.0, forces)
        if np.linalg.norm(free) <= 1e-12 * np.linalg.norm(forces):
            return vector
        tangent.factorise(at, at.model.state(vector))
        vector = vector - tangent.precondition(free)
    raise ComputationError("Newton's method did not converge under prescribed displacements")


def prescribed(at: Configuration, u: np.ndarray) -> np.ndarray:
    """The unknowns (n,) for displacements u (N, 3) of a body without a plate."""
    model = at.model
    return model.vector(model.state(np.zeros(model.size))._replace(u=u))
