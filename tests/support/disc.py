"""A clamped disc that is inflated, as an axisymmetric membrane (Adkins and Rivlin 1952; Green and Adkins 1960, ch. 4).

A point at radius S and height 0 moves to radius r and height z. With the slope θ of the meridian, the stretches are
λ₁ along it, with r′ = λ₁ cos θ and z′ = −λ₁ sin θ, and λ₂ = r/S around the axis; λ₃ through the thickness makes
∂ψ/∂λ₃ zero. The forces per undeformed length are T_i = h ∂ψ/∂λ_i, and the potential 2π∫(h ψ S + p r² z′/2) dS is
stationary where

    S T₁ sin θ = p r²/2,    (S T₁ cos θ)′ = T₂ − p r λ₁ sin θ.

From the centre, where all directions are alike, these are integrated up to where λ₂ is 1, as at a clamped rim. The
stretch at the centre is the one with which that is at R.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

CENTRE = 1e-4
"""Slope at which integration begins, relative to that of the rim: up to there the membrane is a piece of a sphere."""


def slopes(stretches, shear, bulk):
    """∂ψ/∂λ_i (3,) and ∂²ψ/∂λ_i∂λ_j (3, 3) of ψ = μ/2 (J^(−2/3) Σλ² − 3) + κ/2 (J − 1)²."""
    J, power = stretches.prod(), stretches.prod() ** (-2 / 3)
    inverse, total = 1.0 / stretches, np.sum(stretches**2)
    first = shear * power * (stretches - total / 3 * inverse) + bulk * (J - 1) * J * inverse
    second = -2 / 3 * shear * power * np.outer(stretches - total / 3 * inverse, inverse)
    second += shear * power * (np.diag(1 + total / 3 * inverse**2) - 2 / 3 * np.outer(inverse, stretches))
    second += bulk * J * ((2 * J - 1) * np.outer(inverse, inverse) - (J - 1) * np.diag(inverse**2))
    return first, second


def solved(stretches, unknown, wanted, shear, bulk):
    """Stretches of which the unknown ones make ∂ψ/∂λ_i what is wanted (k,), by Newton's method."""
    stretches = stretches.copy()
    for _ in range(50):
        first, second = slopes(stretches, shear, bulk)
        step = np.linalg.solve(second[np.ix_(unknown, unknown)], first[unknown] - wanted)
        stretches[unknown] -= step
        if np.abs(step).max() < 1e-13:
            return stretches
    raise ValueError("no stretches have these stresses")


def centre_height(radius, thickness, pressure, shear, bulk):
    """The height of the centre, mm.

    Parameters
    ----------
    radius, thickness : mm.
    pressure, shear, bulk : p, μ and κ, MPa.
    """

    def along(hoop, force, near):
        """All stretches and T₂ in N/mm for λ₂ and T₁."""
        found = solved(np.array([near[0], hoop, near[2]]), [0, 2], np.array([force / thickness, 0.0]), shear, bulk)
        return found, thickness * slopes(found, shear, bulk)[0][1]

    def integrated(at_centre):
        """Undeformed radius and height at which λ₂ is 1."""
        third = solved(np.array([at_centre, at_centre, at_centre**-2]), [2], np.zeros(1), shear, bulk)
        force, near = thickness * slopes(third, shear, bulk)[0][0], [third]

        def rates(S, y):
            r, _, radial = y
            falling = pressure * r**2 / 2
            whole = np.hypot(radial, falling)
            near[0], around = along(r / S, whole / S, near[0])
            stretch, cosine, sine = near[0][0], radial / whole, falling / whole
            return [stretch * cosine, -stretch * sine, around - pressure * r * stretch * sine]

        def rim(S, y):
            return y[0] / S - 1.0

        rim.terminal = True
        curved = 2.0 * force / pressure
        start = CENTRE * curved * np.sqrt(at_centre - 1.0)
        first = [at_centre * start, 0.0, start * force]
        found = solve_ivp(rates, (start, 10.0 * curved), first, events=rim, rtol=1e-7, atol=1e-7 * start)
        return found.t_events[0][0], found.y_events[0][0, 1]

    found = root_scalar(lambda stretch: integrated(stretch)[0] - radius, bracket=(1.0 + 1e-5, 1.5), xtol=1e-8)
    return -integrated(found.root)[1]
