"""Tubes and spheres of two layers under internal pressure, as radial boundary-value problems."""

import numpy as np
from scipy.integrate import solve_bvp


def layered(layers, radii, pressure, curved=1):
    """Radial displacements of a tube of two layers, or of a sphere (curved=2), at its three radii, mm.

    Both layers are solved side by side over s in (0, 1), each for r and its radial Cauchy stress: with λ_r = r′ and
    λ_θ = r/R these obey σ_r′ = n r′ (σ_θ − σ_r)/r, where n is 1 for a tube in plane strain and 2 for a sphere, and both
    are continuous where the layers meet.
    """
    inner, between, outer = radii
    spans = [(inner, between), (between, outer)]
    shears, bulks = np.array([rubber.parameters for rubber in layers.values()]).T

    def stresses(k, stretch, hoop):
        """σ_r and σ_θ of μ/2 (J^(−2/3) I₁ − 3) + κ/2 (J − 1)²."""
        J = stretch * hoop**curved
        mean = (stretch**2 + curved * hoop**2 + (2 - curved)) / 3
        shear, volume = shears[k] * J ** (-5 / 3), bulks[k] * (J - 1)
        return shear * (stretch**2 - mean) + volume, shear * (hoop**2 - mean) + volume

    def equations(s, y):
        slopes = []
        for k, (start, end) in enumerate(spans):
            R, r, stress = start + (end - start) * s, y[2 * k], y[2 * k + 1]
            hoop, stretch = r / R, np.ones_like(r)
            for _ in range(60):
                # λ_r from the stress, by Newton's method.
                h = 1e-7
                there = stresses(k, stretch, hoop)[0]
                slope = (stresses(k, stretch + h, hoop)[0] - stresses(k, stretch - h, hoop)[0]) / (2 * h)
                stretch = stretch - np.clip((there - stress) / slope, -0.2, 0.2)
            _, around = stresses(k, stretch, hoop)
            slopes += [(end - start) * stretch, curved * (end - start) * stretch * (around - stress) / r]
        return np.stack(slopes)

    def ends(first, last):
        return np.array([first[1] + pressure, last[0] - first[2], last[1] - first[3], last[3]])

    s = np.linspace(0, 1, 21)
    start = np.stack(
        [
            inner + (between - inner) * s,
            -pressure * (1 - s / 2),
            between + (outer - between) * s,
            -pressure / 2 * (1 - s),
        ]
    )
    found = solve_bvp(equations, ends, s, start, tol=1e-9, max_nodes=20_000)
    assert found.success, found.message
    return found.sol(0)[0] - inner, found.sol(1)[0] - between, found.sol(1)[2] - outer
