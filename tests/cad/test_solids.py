"""Bodies in STEP files: what is found in them, what is refused, and that they move as the same tubes do."""

import json

import numpy as np
import pytest
from solids import box, cylinder, occ, problem, written

from pneumorph.analysis.bodies import mesh_of
from pneumorph.cad.findings import crossing, findings_of, thinnest
from pneumorph.cad.parts import InBox, InPlane, Named, faces_where
from pneumorph.cad.read import read_faces
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.interface.design import starting_design
from pneumorph.mechanics import model_of
from pneumorph.mechanics.elements.sums import cap_volumes, summed
from pneumorph.mesh import scaled_jacobian
from pneumorph.problem import load, loads
from pneumorph.results.fields import unpack_fields

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

TUBE = {"length": "24 mm", "radius": "8 mm"}
CHAMBER = {"name": "A", "radius": "5 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "21 mm"]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Files with a tube with one void, with two voids, and others."""
    where = tmp_path_factory.mktemp("solids")
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21), where / "tube.step")
    block = box((0, 0, 0), (20, 16, 40))
    block.faces.name = "side"
    block.faces.Min(occ().Y).name = "mount"
    two = block - box((3, 3, 3), (17, 13, 12)) - box((4, 4, 15.5), (16, 12, 38))
    written(two, where / "two.step")
    return where


def body(folder, name, more="", size="3 mm"):
    return loads(problem(name, more, size), folder=folder).body


def test_voids_are_found_by_size(folder):
    found = body(folder, "two.step")
    assert [chamber.name for chamber in found.chamber] == ["A", "B"]
    faces = findings_of(found.outline)
    assert [-void.volume for void in faces.shells.voids] == pytest.approx([12 * 8 * 22.5, 14 * 10 * 9], rel=1e-9)
    assert faces.volume == pytest.approx(20 * 16 * 40 - 12 * 8 * 22.5 - 14 * 10 * 9, rel=1e-9)
    assert faces.wall.thickness == pytest.approx(2.0)
    assert faces.wall.place[2] == pytest.approx(39.0)
    assert faces.crossing is None


@pytest.mark.parametrize("swapped", [False, True])
def test_equal_voids_are_in_the_order_of_their_places(tmp_path, swapped):
    places = [(3, 3, 22), (3, 3, 3), (11, 3, 3), (3, 11, 3)]
    solid = box((0, 0, 0), (18, 18, 40))
    for x, y, z in reversed(places) if swapped else places:
        solid = solid - box((x, y, z), (x + 4, y + 4, z + 15))
    written(solid, tmp_path / "four.step")
    found = body(tmp_path, "four.step").chamber
    assert [np.subtract(each.inside, (2, 2, 7.5)).round(6).tolist() for each in found] == [
        [3, 3, 3], [11, 3, 3], [3, 11, 3], [3, 3, 22],
    ]  # fmt: skip


def test_curved_faces_are_followed(folder):
    found = findings_of(body(folder, "tube.step").faces(2.0))
    assert found.volume == pytest.approx(np.pi * (64 * 24 - 25 * 18), rel=1e-4)
    assert found.wall.thickness == pytest.approx(3.0, rel=5e-3)


def test_chambers_are_named_by_points(folder):
    named = """
[[body.chamber]]
name = "low"
inside = ["10 mm", "8 mm", "6 mm"]
[[body.chamber]]
name = "A"
inside = ["10 mm", "8 mm", "30 mm"]
"""
    found = body_of(loads(problem("two.step", named), folder=folder))
    assert [surface.name for surface in found.chambers] == ["low", "A"]
    assert found.chambers[0].outline[:, 2].max() == pytest.approx(12.0)


def test_faces_are_chosen_by_plane_box_and_name(folder):
    faces = body(folder, "two.step").outline
    chosen = [
        faces_where(faces, InPlane(1, 0.0)),
        faces_where(faces, InBox((-1, -1, -1), (21, 1, 41))),
        faces_where(faces, Named("mount")),
    ]
    assert chosen[0].any()
    for other in chosen[1:]:
        np.testing.assert_array_equal(other, chosen[0])
    text = 'base = { faces = "x = 0" }\ntip = { name = "mount" }'
    base, tip = body(folder, "two.step", text).ends
    np.testing.assert_allclose([base, tip], [[0, 8, 20], [10, 0, 20]], atol=1e-9)


def test_problems_are_complete_without_the_file(folder, tmp_path):
    asked = loads(problem("two.step"), folder=folder)
    (tmp_path / "problem.toml").write_text(asked.to_toml(), encoding="utf-8")
    assert load(tmp_path / "problem.toml") == asked


def test_its_mesh_is_on_the_faces_and_follows_the_lattice(folder):
    asked = loads(problem("tube.step"), folder=folder)
    start = body_of(asked)
    morph = mesh_of(asked, start, ())
    mesh = morph.mesh
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.02
    assert mesh.volume() == pytest.approx(np.pi * (64 * 24 - 25 * 18), rel=1e-3)
    radii = np.hypot(*mesh.points[np.unique(mesh.faces["chamber A"]), :2].T)
    heights = mesh.points[np.unique(mesh.faces["chamber A"]), 2]
    np.testing.assert_allclose(radii[(heights > 3.001) & (heights < 20.999)], 5.0, atol=1e-5)
    # Splines of degree three displace by quadratic functions exactly, if control points are their polar forms.
    shift = np.array([0.5, -0.25, 1.0])
    moved = morph.positions(start.control_points() + shift)
    np.testing.assert_allclose(moved, mesh.points + shift, atol=1e-8)
    turned = start.control_points() @ np.diag([1.1, 0.9, 1.2])
    on = morph.positions(turned)[: morph.n_surface]
    np.testing.assert_allclose(on, mesh.points[: morph.n_surface] * [1.1, 0.9, 1.2], atol=1e-8)


@pytest.mark.slow
def test_it_moves_like_the_same_tube(folder):
    asked = loads(problem("tube.step", size="2 mm", element="mixed"), folder=folder)
    table = asked.model_dump(mode="json", exclude_none=True) | {"body": TUBE | {"chamber": [CHAMBER]}}
    tube = type(asked).model_validate({key: each for key, each in table.items() if key != "limits"})
    moved = [starting_design(each).simulate().steps[0].translation[2] for each in (asked, tube)]
    assert moved[0] == pytest.approx(moved[1], rel=3e-3)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda path: path.write_text("no STEP file\n" * 9), "cannot be read"),
        (lambda path: path.write_text(""), "cannot be read"),
        (lambda path: path.write_text("#1=ADVANCED_FACE('',(#2),#3,.T.);\n" * 100_000), "100000 faces, more than"),
        (lambda path: written(box((0, 0, 0), (9, 9, 9)), path), "no closed void"),
        (lambda path: written(occ().Compound(list(box((0, 0, 0), (9, 9, 9)).faces)[:5]), path), "5 faces"),
        (
            lambda path: written(occ().Compound([box((0, 0, 0), (9, 9, 9)), box((20, 0, 0), (29, 9, 9))]), path),
            "second body at",
        ),
        (lambda path: written(occ().Sphere(occ().Pnt(0, 0, 0), 9) - cylinder(3, -2, 2), path), "no face in the lowest"),
    ],
)
def test_wrong_files_are_refused_in_a_line(tmp_path, make, said):
    make(tmp_path / "wrong.step")
    with pytest.raises(ProblemError, match="body") as error:
        loads(problem("wrong.step"), folder=tmp_path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) <= 300


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ('base = { faces = "w = 0" }', "body.base.faces"),
        ('base = { faces = "z = 3" }', "body.base.faces"),
        ('base = { faces = "z = 7 mm" }', "body.file"),
        ('base = { name = "none" }', "body.file"),
        ("base = {}", "body.base.faces"),
        ('base = { faces = "z = 0", name = "mount" }', "body.base.name"),
        ('base = { faces = "z = 0" }\ntip = { faces = "z = 0" }', "body.file"),
        ('unit = "m"', "body.unit"),
        ('length = "24 mm"', "body.length"),
        ('[[body.chamber]]\nname = "A"\ninside = ["0 mm", "0 mm", "1 mm"]', "body.file"),
        ('[[body.chamber]]\nname = "A"\ninside = ["10 mm", "8 mm", "6 mm"]', "body.file"),
    ],
)
def test_wrong_tables_are_refused_by_their_key(folder, more, key):
    with pytest.raises(ProblemError, match=key.replace(".", r"\.")):
        body(folder, "two.step", more)


def test_bodies_cannot_be_larger_than_their_mesh(folder):
    with pytest.raises(ProblemError, match=r"mesh\.size"):
        body(folder, "two.step", size="40 mm")


def test_crossings_and_thin_walls_are_found():
    faces = read_faces(_step(box((0, 0, 0), (10, 10, 10)) - box((1, 1, 0.4), (9, 9, 9))), "step")
    flat = faces.triangles[:, :3]
    assert thinnest(faces.points, flat, faces.diagonal).thickness == pytest.approx(0.4)
    pushed = faces.points.copy()
    inner = np.all((faces.points > 0.3) & (faces.points < 9.5), axis=1)
    pushed[inner, 2] -= 0.6
    place = crossing(pushed, flat)
    assert place is not None
    assert -0.3 < place[2] < 0.1


def _step(shape):
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        return written(shape, Path(folder) / "a.step").read_bytes()


PORT = """
[[body.chamber]]
name = "A"
inside = ["0 mm", "0 mm", "12 mm"]
port = "{plane}"
"""


@pytest.mark.parametrize(("hole", "plane"), [((-1, 4), "z = 0"), ((20, 25), "z = 24 mm")])
def test_a_cap_closes_a_port_for_pressure_and_volume(folder, tmp_path, hole, plane):
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21) - cylinder(1.5, *hole, x=1), tmp_path / "port.step")
    opened, closed = (
        starting_design(loads(problem(name, more, "3.5 mm"), folder=where)).simulate({"A": "0:60:60kPa"}).steps
        for name, more, where in (("port.step", PORT.format(plane=plane), tmp_path), ("tube.step", "", folder))
    )
    bore = np.pi * 1.5**2 * 3
    assert opened[0].volumes["A"] == pytest.approx(np.pi * 25 * 18 + bore, rel=2e-3)
    # The load of a closed volume is balanced: only the material that the bore takes away changes the motion.
    assert opened[1].translation[2] == pytest.approx(closed[1].translation[2], rel=0.02)
    grown = [steps[1].volumes["A"] - steps[0].volumes["A"] for steps in (opened, closed)]
    assert grown[0] == pytest.approx(grown[1], rel=0.02)
    assert abs(opened[1].translation[0]) < 0.05


def test_caps_are_stored_with_the_mesh(tmp_path):
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21) - cylinder(1.5, -1, 4), tmp_path / "port.step")
    asked = loads(problem("port.step", PORT.format(plane="z = 0"), "6 mm"), folder=tmp_path)
    fields = starting_design(asked).fields
    again = unpack_fields(fields.pack())
    np.testing.assert_array_equal(again.mesh.caps["A"], fields.mesh.caps["A"])
    volumes = [
        summed(cap_volumes, model_of(asked, mesh).caps, mesh.points, np.zeros_like(mesh.points))
        for mesh in (fields.mesh, again.mesh)
    ]
    # The rim is in the plane z = 0, where x·n is zero.
    np.testing.assert_allclose(volumes, 0.0, atol=1e-9)
    moved = again.mesh.points + np.array([0.0, 0.0, 1.0])
    grown = summed(cap_volumes, model_of(asked, again.mesh).caps, moved, np.zeros_like(moved))
    assert abs(grown[0]) == pytest.approx(np.pi * 1.5**2 / 3, rel=1e-2)


@pytest.mark.parametrize("plane", ["z = 24 mm", "x = 1 mm"])
def test_ports_that_are_not_there(tmp_path, plane):
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21) - cylinder(1.5, -1, 4), tmp_path / "port.step")
    with pytest.raises(ProblemError, match="port"):
        loads(problem("port.step", PORT.format(plane=plane)), folder=tmp_path)
    with pytest.raises(ProblemError, match="port"):
        loads(problem("port.step"), folder=tmp_path)


def test_commands_show_and_export_it(folder, tmp_path, capsys):
    from pneumorph.cli.commands import check, draw, export, simulate

    path = tmp_path / "two.toml"
    path.write_text(problem(folder / "two.step", 'tip = { faces = "x = 20 mm" }', "6 mm"), encoding="utf-8")
    simulate(path, json=tmp_path / "steps.json", pressure=["A=0:20:20kPa"])
    steps = json.loads((tmp_path / "steps.json").read_text())["steps"]
    assert [set(step["volume_mm3"]) for step in steps] == [{"A", "B"}] * 2
    check(path, quick=True)
    said = capsys.readouterr().out
    assert "wall      at least 2 mm" in said
    assert "chamber   B: 1260 mm³" in said
    assert "deviate by at most 0 mm" in said
    export(path, tmp_path / "two.inp")
    assert (tmp_path / "two.inp").stat().st_size > 10_000
    draw(path, cut="xz", out=tmp_path / "two.png")
    assert (tmp_path / "two.png").stat().st_size > 10_000


def test_obstacles_vacuum_and_contact_with_itself(folder):
    more = """
[contact]
distance = "0.2 mm"
[[obstacle]]
name = "table"
kind = "plane"
point = ["0 mm", "0 mm", "-1 mm"]
normal = [0, 0, 1]
"""
    text = problem("tube.step", "", "4 mm") + more
    steps = starting_design(loads(text, folder=folder)).simulate({"A": "0:-20:-20kPa"}).steps
    assert all(step.converged for step in steps)
    assert steps[1].translation[2] < -0.02
    assert steps[1].volumes["A"] < 0.99 * steps[0].volumes["A"]


SPINE = """
[[region]]
name = "spine"
inside = ["11 mm", "5 mm", "20 mm"]
material = { model = "neo-hookean", shear_modulus = "4.9 MPa", bulk_modulus = "48 MPa", density = "1.1 g/cm^3" }
"""


@pytest.fixture(scope="module")
def two_rubbers(tmp_path_factory):
    """A file with a soft block with a void, and beside it a second solid, and the same as one solid."""
    where = tmp_path_factory.mktemp("rubbers")
    soft = box((0, 0, 0), (10, 10, 40)) - box((2, 2, 2), (8, 8, 38))
    written(occ().Compound([soft, box((10, 0, 0), (12, 10, 40))]), where / "two.step")
    written(soft + box((10, 0, 0), (12, 10, 40)), where / "one.step")
    return where


def test_solids_are_regions_of_their_own_rubbers(two_rubbers):
    asked = loads(problem("two.step", size="5 mm") + SPINE, folder=two_rubbers)
    mesh = mesh_of(asked, body_of(asked), ()).mesh
    assert set(mesh.regions) == {"body", "spine"}
    assert mesh.volume() == pytest.approx(12 * 10 * 40 - 6 * 6 * 36, rel=1e-9)
    middles = mesh.points[mesh.tets[mesh.regions["spine"], :4]].mean(axis=1)
    assert middles[:, 0].min() > 10.0
    bent = [
        starting_design(each).simulate({"A": "20 kPa"}).steps[0].rotation[1]
        for each in (
            asked,
            *(loads(problem(name, size="5 mm"), folder=two_rubbers) for name in ("two.step", "one.step")),
        )
    ]
    # Towards the stiff side; solids of the same rubber are one.
    assert bent[0] > 1.5 * bent[1] > 0
    assert bent[1] == pytest.approx(bent[2], rel=0.05)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (SPINE.replace("11 mm", "5 mm"), "region"),
        (SPINE.replace('inside = ["11 mm", "5 mm", "20 mm"]', 'beyond = "20 mm"'), r"region\[0\]"),
        (SPINE + SPINE.replace("spine", "skin"), "region"),
    ],
)
def test_regions_that_are_refused(two_rubbers, text, key):
    with pytest.raises(ProblemError, match=key):
        loads(problem("two.step", size="5 mm") + text, folder=two_rubbers)
