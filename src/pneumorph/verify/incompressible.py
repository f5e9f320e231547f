"""Closed forms of thick spheres and tubes of incompressible neo-Hookean rubber; pressures are p/μ."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import root_scalar


def sphere_pressure(a: float, A: float, B: float) -> float:
    """p/μ of a sphere with radii A and B at rest, inflated to inner radius a."""
    inner, outer = a / A, np.cbrt(B**3 + a**3 - A**3) / B
    return 0.5 * ((4 / outer + outer**-4) - (4 / inner + inner**-4))


def tube_pressure(a: float, A: float, B: float) -> float:
    """p/μ of a tube in plane strain with radii A and B at rest, inflated to inner radius a."""
    inner, outer = a / A, np.sqrt(B**2 + a**2 - A**2) / B
    return np.log(inner / outer) + 0.5 * (outer**-2 - inner**-2)


def radius_at(
    pressure: float, closed_form: Callable[[float, float, float], float], A: float, B: float, stretch: float = 1.5
) -> float:
    """The inner radius a, between A and stretch·A, at which a closed form gives a pressure.

    Parameters
    ----------
    pressure : float
        p/μ.
    closed_form : callable
        p/μ of a, A and B.
    A, B : float
        Undeformed radii, mm.
    stretch : float
        The largest of the inner surface.
    """
    return root_scalar(lambda a: closed_form(a, A, B) - pressure, bracket=(A, stretch * A), xtol=1e-12).root
