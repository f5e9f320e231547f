"""A body from a CAD file by another solver on the same mesh."""

import numpy as np
import pytest
from installed import needs

import pneumorph as pm
from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import Equilibrium, Tangent, configure, loads_of, model_of, solve
from pneumorph.problem import load
from pneumorph.verify import calculix

PRESSURE = 0.05


@pytest.fixture(scope="module")
def pneunet(tmp_path_factory):
    """Mesh, configuration and equilibrium of a short PneuNet with a plate on its tip."""
    folder = tmp_path_factory.mktemp("pneunet")
    path = pm.bodies.pneunet("30 mm", "14 mm", "12 mm", 2, wall="1.2 mm", floor="2 mm").write(folder / "finger")
    changes = {"mesh.size": "4.5 mm", "mesh.element": "quadratic", "end_effector.kind": "plate"}
    asked = load(path).with_changes(changes)
    mesh = mesh_of(asked, body_of(asked), ()).mesh
    model = model_of(asked, mesh)
    at = configure(model, mesh.points, loads_of(asked, model, {"A": PRESSURE}))
    found = solve(at, Tangent(model), tolerance=1e-11)
    assert isinstance(found, Equilibrium)
    # It bends by degrees.
    assert abs(found.plate[4]) > 0.02
    return mesh, at, found


def difference(found, u):
    """Of two fields of displacements, relative to the largest one."""
    return np.abs(found.u - u).max() / np.abs(found.u).max()


def test_calculix_bends_a_pneunet_as_far(pneunet):
    needs(calculix.program)
    mesh, at, found = pneunet
    u, plate = calculix.equilibrium(mesh, at, tolerance=1e-4)
    assert difference(found, u) < 1e-3
    # Its quadrature is another one.
    assert plate[4] == pytest.approx(found.plate[4], rel=2e-3)
