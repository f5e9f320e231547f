"""Closed forms of thick spheres and tubes of incompressible neo-Hookean rubber, pressures in shear moduli."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq


def sphere_pressure(a, A, B):
    """p/μ at inner radius a of a sphere with radii A and B at rest."""
    inner, outer = a / A, np.cbrt(B**3 + a**3 - A**3) / B
    return 0.5 * ((4 / outer + outer**-4) - (4 / inner + inner**-4))


def tube_pressure(a, A, B):
    """p/μ at inner radius a of a tube in plane strain with radii A and B at rest."""
    inner, outer = a / A, np.sqrt(B**2 + a**2 - A**2) / B
    return np.log(inner / outer) + 0.5 * (outer**-2 - inner**-2)


def radius_at(pressure, closed_form, A, B, stretch=1.5):
    """The inner radius at which the closed form has this pressure, below A·stretch."""
    return brentq(lambda a: closed_form(a, A, B) - pressure, A, stretch * A)
