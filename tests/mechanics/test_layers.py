"""Two rubbers in one body: a tube of two layers against its radial boundary-value problem."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from pneumorph.mechanics import Equilibrium, Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.verify.inflation import SECTION, tube_supports, wall_displacement
from pneumorph.verify.solids import tube, with_lids

INNER, BETWEEN, OUTER, PRESSURE = 4.0, 6.0, 8.0, 0.10
LAYERS = {"inner": neo_hookean_rubber(0.3, 3.0, 1.1e-9), "outer": neo_hookean_rubber(0.9, 6.0, 1.3e-9)}
NEARLY_INCOMPRESSIBLE = {"inner": neo_hookean_rubber(0.3, 3e3, 1.1e-9), "outer": neo_hookean_rubber(0.9, 2e4, 1.3e-9)}


def exact(layers):
    """Radial displacements at the inner wall, between the layers and at the outer wall, mm.

    Both layers are solved side by side over s in (0, 1), each for r and its radial Cauchy stress: in plane strain with
    λ_r = r′, λ_θ = r/R these obey σ_r′ = r′ (σ_θ − σ_r)/r, and both are continuous where the layers meet.
    """
    spans = [(INNER, BETWEEN), (BETWEEN, OUTER)]
    shears, bulks = np.array([rubber.parameters for rubber in layers.values()]).T

    def stresses(k, stretch, hoop):
        """σ_r and σ_θ of μ/2 (J^(−2/3) I₁ − 3) + κ/2 (J − 1)²."""
        J = stretch * hoop
        mean = (stretch**2 + hoop**2 + 1) / 3
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
            slopes += [(end - start) * stretch, (end - start) * stretch * (around - stress) / r]
        return np.stack(slopes)

    def ends(first, last):
        return np.array([first[1] + PRESSURE, last[0] - first[2], last[1] - first[3], last[3]])

    s = np.linspace(0, 1, 21)
    start = np.stack([4 + 2 * s, -PRESSURE * (1 - s / 2), 6 + 2 * s, -PRESSURE / 2 * (1 - s)])
    found = solve_bvp(equations, ends, s, start, tol=1e-9, max_nodes=20_000)
    assert found.success, found.message
    return found.sol(0)[0] - INNER, found.sol(1)[0] - BETWEEN, found.sol(1)[2] - OUTER


@pytest.mark.parametrize(("layers", "mixed", "error"), [(LAYERS, False, 1e-3), (NEARLY_INCOMPRESSIBLE, True, 1e-3)])
def test_a_tube_of_two_layers(layers, mixed, error):
    """Plane strain, as the tube of one layer in the verification; the mesh has its nodes where the layers meet."""
    mesh, lids = with_lids(tube(INNER, OUTER, 2, (4, 16, 1)), 2)
    middle = np.linalg.norm(mesh.points[mesh.tets[:, :4]].mean(axis=1)[:, :2], axis=1)
    outside = middle > 0.99 * BETWEEN
    mesh = replace(mesh, regions={"inner": np.flatnonzero(~outside), "outer": np.flatnonzero(outside)})
    built = build_model(mesh, layers, plate=False, supports=tube_supports(mesh, lids), mixed=mixed)
    found = solve(configure(built, mesh.points, build_loads(built, {"A": PRESSURE})), Tangent(built))
    assert isinstance(found, Equilibrium)
    assert found.stable
    walls = [wall_displacement(mesh, found.u, radius, SECTION) for radius in (INNER, BETWEEN, OUTER)]
    assert walls == pytest.approx(exact(layers), rel=error)
    if mixed:
        at_meeting = np.abs(np.linalg.norm(mesh.points[:, :2], axis=1) - BETWEEN) < 1e-6
        inside, beyond = np.asarray(found.state.hydrostatic).reshape(2, -1)[:, : len(mesh.points)][:, at_meeting]
        assert np.count_nonzero(inside) > 0
        # The hoop stress jumps where rubbers meet, and π with it.
        assert np.abs(inside - beyond).max() > 0.01
