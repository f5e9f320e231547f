"""Bodies of two solids of a file are designed, and where the solids meet moves with the surfaces."""

import numpy as np
import pytest
from solids import box, occ, problem, written

from pneumorph.analysis import analyse, build_discretisation, design_gradient
from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.lattice.between import Interface, in_the_file, shares, weights_between
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.mesh import scaled_jacobian
from pneumorph.optimize import DesignAccepted, build_setup, optimise
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.problem import loads
from pneumorph.sensitivity.taylor import taylor_test

MORE = """
[design]
spacing = "7 mm"
[limits]
wall = "1 mm"
[[region]]
name = "floor"
inside = ["-5 mm", "0 mm", "20 mm"]
material = { model = "neo-hookean", shear_modulus = "2.5 MPa", bulk_modulus = "24 MPa", density = "1.1 g/cm^3" }
[optimizer]
step = "0.3 mm"
iterations = 2
"""


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A PneuNet along z with two chambers and a channel, which are closed by a stiff floor at x = −4 mm."""
    where = tmp_path_factory.mktemp("two")
    rooms = box((-4, -4, 3), (5, 4, 12)) + box((-4, -4, 15), (5, 4, 24)) + box((-4, -1.5, 12), (-1, 1.5, 15))
    soft = box((-4, -6, 0), (7, 6, 27)) - rooms
    written(occ().Compound([soft, box((-6, -6, 0), (-4, 6, 27))]), where / "pneunet.step")
    text = problem("pneunet.step", size="6 mm").replace('motion = "extension"', 'motion = "bending_y"')
    return loads(text + MORE, folder=where)


@pytest.fixture(scope="module")
def space(asked):
    return space_of(asked)


def direction(space, seed=0):
    z = build_smoothing(space).apply(np.random.default_rng(seed).uniform(-1, 1, space.n))
    return z / np.abs(z).max()


def test_displacements_do_not_tear(asked, space):
    """What is between surfaces is displaced as they are where it ends in them."""
    body = space.body(space.start + 0.7 * direction(space))
    whole = Interface(body, np.zeros((0, 3)), np.zeros((0, 6), int))
    for surface in body.surfaces:
        moved = surface.moved(surface.outline)
        assert np.abs(moved - surface.outline).max() > 0.1
        np.testing.assert_allclose(whole.moved(surface.outline), moved, atol=1e-6)
    line = np.linspace([-4.0, -4.0, 8.0], [-4.0, -6.0, 8.0], 41)
    weights = shares(body.surfaces, line)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0)
    np.testing.assert_allclose(weights[:, [0, -1]], [[0.0, 1.0], [1.0, 0.0]], atol=1e-9)
    assert np.abs(np.diff(weights, axis=1)).max() < 0.15
    by = weights_between(body, line) @ (body.control_points() - in_the_file(body))
    np.testing.assert_allclose(line + by, whole.moved(line), atol=1e-12)


def test_regions_depend_on_the_design_alone(asked, space):
    """A body that is meshed anew has its rubbers where the mesh that followed it has them."""
    start = body_of(asked)
    body = space.body(space.start + 0.5 * direction(space))
    followed, anew = mesh_of(asked, start, ()).at(body.control_points()), mesh_of(asked, body, ()).mesh
    for mesh in (followed, anew):
        assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.0
        assert set(mesh.regions) == {"body", "floor"}
    volumes = [volume_of(mesh, "floor") for mesh in (followed, anew)]
    assert abs(volumes[0] - 2 * 12 * 27) > 1.0
    assert volumes[0] == pytest.approx(volumes[1], rel=2e-3)


def volume_of(mesh, region):
    corners = mesh.points[mesh.tets[mesh.regions[region], :4]]
    return float(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum()) / 6.0


def test_gradient_is_exact(asked, space):
    start = body_of(asked)
    disc = build_discretisation(asked, mesh_of(asked, start, ()), start.control_points())
    found = analyse(asked, space, disc, space.start, tolerance=1e-11)
    slope = design_gradient(asked, space, disc, found)
    states = {name: each.state for name, each in found.equilibria.items()}

    def value(phi):
        return analyse(asked, space, disc, phi, states, tolerance=1e-11).value

    way = np.random.default_rng(1).uniform(-1, 1, space.n)
    test = taylor_test(value, space.start, slope, way, 0.1, count=3, start=found.value)
    assert test.rate == pytest.approx(2.0, abs=0.02)


def test_designs_gain_within_the_limits(asked):
    accepted = [event for event in optimise(build_setup(asked)) if isinstance(event, DesignAccepted)]
    values = [event.entry.objective for event in accepted]
    assert len(values) == 3
    assert values == sorted(values, reverse=True)
    assert all(event.entry.held for event in accepted)


def test_solids_of_a_design_are_written(asked, space, tmp_path):
    pytest.importorskip("pneumorph.make", reason="needs the extra cad")
    from pneumorph.make.faces.files import make_faces
    from pneumorph.make.printing import read_3mf

    body = space.body(space.start + 0.5 * direction(space))
    files = make_faces(asked, body, tmp_path, chord=0.05)
    assert [(check.file, check.what, check.value) for check in files.failed] == []
    read = occ().OCCGeometry(str(tmp_path / "body.step")).shape
    assert len(read.solids) == 2
    floor = min(read.solids, key=lambda each: each.mass)
    mesh = mesh_of(asked, body, ()).mesh
    assert abs(floor.mass - 2 * 12 * 27) > 1.0
    assert floor.mass == pytest.approx(volume_of(mesh, "floor"), rel=2e-3)
    parts = read_3mf(tmp_path / "body.3mf")
    assert set(parts) == {"body", "floor", "chamber A"}
    assert parts["floor"].volume == pytest.approx(floor.mass, rel=2e-3)
