"""Sheets and fibres on faces of bodies from files: where they lie, what they do, and their gradients."""

import numpy as np
import pytest
from solids import box, occ, problem, written

from pneumorph.analysis import analyse, build_discretisation, design_gradient
from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.interface.design import starting_design
from pneumorph.mesh.tets import triangle_gradient
from pneumorph.problem import loads
from pneumorph.sensitivity.taylor import taylor_test

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

SHEET = """
[[membrane]]
name = "paper"
{on}
stiffness = "{stiffness}"
{more}
"""
FIBRES = """
[[fibres]]
name = "wire"
{on}
stiffness = "20 N/mm"
winding = "{winding}"
{more}
"""
FLOOR = 'on = [{ name = "floor" }]'
# By default stiffer sheets wrinkle earlier.
WRINKLING = "wrinkling = 0.005\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("covers")
    block = box((-5, -6, 0), (5, 6, 24))
    block.faces.Min(occ().X).name = "floor"
    written(block - box((-2, -3, 3), (3, 3, 21)), where / "block.step")
    soft = box((-2, -6, 0), (5, 6, 24)) - box((-2, -3, 3), (3, 3, 21))
    written(occ().Compound([soft, box((-5, -6, 0), (-2, 6, 24))]), where / "two.step")
    return where


def asked(folder, rest="", name="block.step", size="4 mm"):
    text = problem(name, size=size).replace('motion = "extension"', 'motion = "bending_y"')
    return loads(text + rest, folder=folder)


def sheet(on=FLOOR, stiffness="40 N/mm", more=""):
    return SHEET.format(on=on, stiffness=stiffness, more=more)


def area(mesh, name):
    own = mesh.covers[name]
    tangents = np.einsum("eai,eqak->eqki", mesh.points[own.nodes], triangle_gradient(own.points[..., :2]))
    areas = np.linalg.norm(np.cross(tangents[..., 0, :], tangents[..., 1, :]), axis=-1)
    return float((own.points[..., 2] * areas).sum())


@pytest.mark.parametrize(
    ("on", "name", "exact"),
    [
        (FLOOR, "block.step", 12 * 24),
        ('on = [{ faces = "x = 5 mm" }, { faces = "y = -6 mm" }]', "block.step", (12 + 10) * 24),
        ('surfaces = ["A"]', "block.step", 2 * (5 * 6 + 5 * 18 + 6 * 18)),
        ("", "block.step", 2 * (10 + 12) * 24),
    ],
)
def test_they_lie_on_their_faces(folder, on, name, exact):
    found = asked(folder, sheet(on), name)
    assert area(mesh_of(found, body_of(found), ()).mesh, "paper") == pytest.approx(exact, rel=1e-9)


def test_a_plane_has_where_solids_meet_too(folder):
    region = """
[[region]]
name = "floor"
inside = ["-4 mm", "0 mm", "12 mm"]
material = { model = "neo-hookean", shear_modulus = "1 MPa", bulk_modulus = "9 MPa", density = "1.1 g/cm^3" }
"""
    found = asked(folder, sheet('on = [{ faces = "x = -2 mm" }]') + region, "two.step")
    # The floor of the void, and all around it.
    assert area(mesh_of(found, body_of(found), ()).mesh, "paper") == pytest.approx(12 * 24, rel=1e-9)


def test_sheets_and_fibres_limit_strain_on_their_side(folder):
    # What keeps the floor from becoming longer bends the body towards it. Fibres across it bear the hoop stress that
    # makes it shorter, so they bend the body away.
    bent = [
        starting_design(asked(folder, rest)).simulate({"A": "30 kPa"}).steps[0].rotation[1]
        for rest in (
            "",
            sheet(more=WRINKLING),
            sheet(more=WRINKLING + "coverage = 0.5"),
            sheet(stiffness="20 N/mm", more=WRINKLING),
            FIBRES.format(on=FLOOR, winding="0 deg", more=""),
            FIBRES.format(on=FLOOR, winding="90 deg", more=""),
            FIBRES.format(on=FLOOR, winding="90 deg", more="along = [0, 1, 0]"),
        )
    ]
    way = np.sign(bent[1] - bent[0])
    plain, whole, half, weak, along, across, turned = (way * each for each in bent)
    assert plain < half < whole
    assert half == pytest.approx(weak, rel=1e-6)
    assert across < plain < along
    assert turned == pytest.approx(along, rel=1e-3)


def test_gradients_by_shape_and_data_are_exact(folder):
    turned = FIBRES.format(on='on = [{ faces = "x = 3 mm" }, { faces = "y = 3 mm" }]', winding="40 deg", more="")
    turned = turned.replace('"40 deg"', '{ start = "40 deg", min = "20 deg", max = "70 deg" }')
    rest = sheet(more="coverage = { start = 0.5, min = 0.1, max = 1.0 }") + turned
    found = asked(folder, rest + '[design]\nspacing = "8 mm"\n', size="5 mm")
    space, start = space_of(found), body_of(found)
    assert len(space.free_data) == 2
    disc = build_discretisation(found, mesh_of(found, start, ()), start.control_points())
    at = analyse(found, space, disc, space.start, tolerance=1e-11)
    slope = design_gradient(found, space, disc, at)
    assert np.abs(slope[-2:]).min() > 0
    states = {name: each.state for name, each in at.equilibria.items()}

    def value(phi):
        return analyse(found, space, disc, phi, states, tolerance=1e-11).value

    way = np.random.default_rng(1).uniform(-1, 1, space.n)
    test = taylor_test(value, space.start, slope, way, 0.1, count=3, start=at.value)
    assert test.rate == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize(
    ("rest", "key"),
    [
        (sheet('on = [{ name = "roof" }]'), r"membrane\[0\]\.on\[0\]"),
        (sheet('span = ["0 mm", "9 mm"]'), r"membrane\[0\]\.span"),
        (sheet('surfaces = ["B"]'), r"membrane\[0\]\.surfaces"),
        (sheet(FLOOR + '\nsurfaces = ["A"]'), r"membrane\[0\]\.on"),
        (sheet() + FIBRES.format(on=FLOOR, winding="0 deg", more="along = [0, 0, 0]"), r"fibres\[0\]\.along"),
        (sheet() + sheet(), r"membrane\[1\]\.name"),
    ],
)
def test_what_is_refused(folder, rest, key):
    with pytest.raises(ProblemError, match=key):
        asked(folder, rest)


def test_fibres_need_a_direction_in_their_faces(folder):
    # The ends of the void are normal to the line from base to tip.
    for on, more in ((FLOOR, "along = [1, 0, 0]"), ('surfaces = ["A"]', "")):
        found = asked(folder, FIBRES.format(on=on, winding="0 deg", more=more))
        with pytest.raises(ComputationError, match="wire"):
            mesh_of(found, body_of(found), ())
