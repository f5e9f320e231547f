"""Two rubbers in one body: a tube of two layers against its radial boundary-value problem."""

from dataclasses import replace

import numpy as np
import pytest
from layers import layered

from pneumorph.mechanics import Equilibrium, Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.verify.inflation import SECTION, tube_supports, wall_displacement
from pneumorph.verify.solids import tube, with_lids

INNER, BETWEEN, OUTER, PRESSURE = 4.0, 6.0, 8.0, 0.10
LAYERS = {"inner": neo_hookean_rubber(0.3, 3.0, 1.1e-9), "outer": neo_hookean_rubber(0.9, 6.0, 1.3e-9)}
NEARLY_INCOMPRESSIBLE = {"inner": neo_hookean_rubber(0.3, 3e3, 1.1e-9), "outer": neo_hookean_rubber(0.9, 2e4, 1.3e-9)}


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
    assert walls == pytest.approx(layered(layers, (INNER, BETWEEN, OUTER), PRESSURE), rel=error)
    if mixed:
        at_meeting = np.abs(np.linalg.norm(mesh.points[:, :2], axis=1) - BETWEEN) < 1e-6
        inside, beyond = np.asarray(found.state.hydrostatic).reshape(2, -1)[:, : len(mesh.points)][:, at_meeting]
        assert np.count_nonzero(inside) > 0
        # The hoop stress jumps where rubbers meet, and π with it.
        assert np.abs(inside - beyond).max() > 0.01
