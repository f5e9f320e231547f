"""A chamber that a plane closes: its volume, and what the pressure in it presses on."""

import numpy as np
import pytest
from solids import cylinder, problem, written

from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics.assembly.potential import total
from pneumorph.mechanics.assembly.volumes import volume_parts, volumes_of
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.setup import model_of
from pneumorph.mechanics.solve.equilibrium import build_loads, configure
from pneumorph.mechanics.solve.forces import contact_forces
from pneumorph.objective.features import measure_features
from pneumorph.problem import loads

CUP = """
[[body.chamber]]
name = "A"
inside = ["0 mm", "0 mm", "12 mm"]
port = "z = 16 mm"
{seal}
[[obstacle]]
name = "plate"
kind = "plane"
point = ["3 mm", "2 mm", "17 mm"]
normal = [0, 0, -1]
"""
SEALED = 'seal = "plate"'


def asked(folder, seal):
    return loads(problem("cup.step", CUP.format(seal=seal), "4 mm"), folder=folder)


@pytest.fixture(scope="module")
def cup(tmp_path_factory):
    """A thick cup of radius 9 mm that opens at z = 16 mm by a bore of radius 6 mm and depth 10 mm, and its mesh."""
    folder = tmp_path_factory.mktemp("cup")
    written(cylinder(9, 0, 16) - cylinder(6, 6, 18), folder / "cup.step")
    found = asked(folder, SEALED)
    mesh = mesh_of(found, body_of(found), ()).mesh
    return folder, mesh, model_of(found, mesh)


def pose(z, turn=0.0):
    return np.array([[0.0, 0.0, z, turn, 0.0, 0.0]])


def test_the_space_up_to_the_plane_is_its_volume(cup):
    _, mesh, model = cup
    area, none = np.pi * 36.0, np.zeros_like(mesh.points)
    rest = volumes_of(model, mesh.points, none, pose(0.0))
    assert rest == pytest.approx(area * 11.0, rel=2e-3)
    assert volumes_of(model, mesh.points, none, pose(-1.0)) == pytest.approx(area * 10.0, rel=2e-3)
    away = np.tile([0.4, -0.3, -2.0], (len(mesh.points), 1))
    assert volumes_of(model, mesh.points, away, pose(0.0)) - rest == pytest.approx(area * 2.0, rel=2e-3)
    # A plane that turns about a point 2 mm beside the axis; heights are along its normal.
    turned = volumes_of(model, mesh.points, none, pose(0.0, 0.1)) - rest
    assert turned == pytest.approx(area * ((1.0 - 2.0 * np.tan(0.1)) * np.cos(0.1) ** 2 - 1.0), rel=2e-2)


def test_pressure_acts_on_walls_and_not_on_the_rim(cup):
    """With the rim in the plane, the resultant on the cup is the pressure on the part of the plane."""
    _, mesh, model = cup
    u, ones = np.zeros_like(mesh.points), np.ones((1, 1))
    forces = sum(
        sums.pulled_back(measure, part, mesh.points, u, ones, *given)[1][0]
        for measure, part, given in volume_parts(model, pose(-1.0))
    )
    np.testing.assert_allclose(forces.sum(axis=0), [0.0, 0.0, -np.pi * 36.0], atol=0.3)
    rim = np.unique(mesh.caps["A"][:, 1:])
    # The bore is a cylinder up to the error of its triangles.
    assert np.abs(forces[rim, 2]).max() < 1e-4 * np.pi * 36.0
    on_floor = np.abs(mesh.points[:, 2] - 6.0) < 1e-6
    assert forces[on_floor, 2].sum() == pytest.approx(-np.pi * 36.0, rel=2e-3)


def test_a_cap_presses_on_the_rim(cup):
    """Without the seal the load of the closed volume is balanced."""
    folder, mesh, _ = cup
    model = model_of(asked(folder, ""), mesh)
    assert not model.seals
    u, ones = np.zeros_like(mesh.points), np.ones((1, 1))
    forces = sum(
        sums.pulled_back(measure, part, mesh.points, u, ones, *given)[1][0]
        for measure, part, given in volume_parts(model, None)
    )
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-8)


def test_the_pull_is_what_moves_the_plane(cup):
    """It is the derivative of the potential by how far the plane is from the body."""
    _, mesh, model = cup

    def at(z):
        return configure(model, mesh.points, build_loads(model, {"A": -0.02}, moves={"plate": (0.0, 0.0, z)}))

    def energy(z):
        return total(model.potential, mesh.points, model.state(np.zeros(model.size)), at(z).loads)

    there = at(-0.95)
    touched = contact_forces(there, model.state(np.zeros(model.size)))
    step = 1e-5
    slope = (energy(-0.95 + step) - energy(-0.95 - step)) / (2.0 * step)
    assert touched.normal["plate"] > 0.1
    assert touched.pull["plate"] == pytest.approx(slope, rel=1e-6)
    assert touched.pull["plate"] + touched.normal["plate"] == pytest.approx(0.02 * np.pi * 36.0, rel=2e-3)


def test_features_are_those_with_the_plane_in_its_place_unless_it_is_given(cup):
    """The rates of a design's motion are asked for without poses."""
    _, mesh, model = cup
    state = model.state(np.zeros(model.size))
    for shift in (None, pose(0.0)):
        found = measure_features(model, mesh.points, state, shift=shift)
        assert float(found.volume["A"]) == pytest.approx(np.pi * 36.0 * 11.0, rel=2e-3)


@pytest.mark.parametrize("seal", ['seal = "table"', "seal = 3"])
def test_seals_that_are_refused(cup, seal):
    with pytest.raises(ProblemError, match=r"body\.chamber\[0\]\.seal"):
        asked(cup[0], seal)
