"""Halves and quarters of symmetric bodies from files move as the whole bodies do."""

from dataclasses import replace

import numpy as np
import pytest
from solids import box, cylinder, occ, problem, written

from pneumorph.analysis import analyse, build_discretisation, design_gradient
from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.interface.design import starting_design
from pneumorph.mechanics import model_of, part_of
from pneumorph.mesh import unfold
from pneumorph.problem import loads
from pneumorph.sensitivity.taylor import taylor_test

SYMMETRIC = 'symmetry = { mirror = ["xz"] }\n'
QUARTER = 'symmetry = { mirror = ["xz", "yz"] }\n'
BENDING = ('motion = "extension"', 'motion = "bending_y"')


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("halves")
    block = box((-6, -8, 0), (6, 8, 24))
    block.faces.Min(occ().X).name = "floor"
    written(block - cylinder(3, 3, 21, x=1), where / "one.step")
    written(block - box((-2, 1.5, 3), (4, 6, 21)) - box((-2, -6, 3), (4, -1.5, 21)), where / "pair.step")
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21), where / "tube.step")
    skin = box((-8, -8, 0), (-6, 8, 24))
    written(occ().Compound([block - cylinder(3, 3, 21, x=1), skin]), where / "skin.step")
    written(block - cylinder(3, 3, 21, x=1) - cylinder(1, -1, 4, x=1), where / "port.step")
    bores = [cylinder(1, -1, 4, y=y) for y in (-4, 4)]
    pair = block - box((-2, 1.5, 3), (4, 6, 21)) - box((-2, -6, 3), (4, -1.5, 21))
    written(pair - bores[0] - bores[1], where / "ports.step")
    written(cylinder(8, 0, 24) - cylinder(5, 3, 21) - cylinder(2, -1, 4), where / "open.step")
    return where


def asked(folder, name, more="", rest="", motion=True, size="4 mm"):
    text = problem(name, more, size)
    return loads((text.replace(*BENDING) if motion else text) + rest, folder=folder)


REGION = """
[[region]]
name = "skin"
inside = ["-7 mm", "1 mm", "12 mm"]
material = { model = "neo-hookean", shear_modulus = "2.5 MPa", bulk_modulus = "24 MPa", density = "1.1 g/cm^3" }
"""
SHEET = """
[[membrane]]
name = "paper"
on = [{ name = "floor" }]
stiffness = "30 N/mm"
"""


def open_at(port="z = 0 mm", **chambers):
    """Tables of chambers with ports around points, mm."""
    tables = [
        f'[[body.chamber]]\nname = "{name}"\ninside = ["{x} mm", "{y} mm", "{z} mm"]\nport = "{port}"\n'
        for name, (x, y, z) in chambers.items()
    ]
    return "".join(tables)


PORT, PORTS = open_at(A=(1, 0, 12)), open_at(A=(0, 4, 12), B=(0, -4, 12))


@pytest.mark.parametrize(
    ("name", "more", "rest", "motion"),
    [
        ("port.step", SYMMETRIC + PORT, "", True),
        ("ports.step", SYMMETRIC + PORTS, "", True),
        ("open.step", QUARTER + open_at(A=(0, 0, 12)), "", False),
        ("one.step", SYMMETRIC, "", True),
        ("one.step", SYMMETRIC, SHEET, True),
        ("pair.step", SYMMETRIC, "", True),
        ("skin.step", SYMMETRIC, REGION, True),
        ("tube.step", QUARTER, "", False),
    ],
)
def test_a_part_moves_as_the_whole(folder, name, more, rest, motion):
    if name == "pair.step":
        rest += "\n"
    part, whole = (
        asked(folder, name, mirrors, rest, motion)
        for mirrors in (more, more.replace(SYMMETRIC, "").replace(QUARTER, ""))
    )
    # A port that both planes cut leaves half of the body.
    planes = ("xz", "yz") if name == "tube.step" else ("xz",)
    if name in ("pair.step", "ports.step"):
        pressures = {"A": "30 kPa", "B": "30 kPa"}
        assert part_of(part) == ()
    else:
        pressures = {"A": "30 kPa"}
        assert part_of(part) == planes
    assert part_of(whole) == ()
    own, other = (starting_design(each).prepare_simulation(pressures) for each in (part, whole))
    assert (own.mesh.part, other.mesh.part) == (planes, ())
    image = unfold(own.mesh).mesh
    unfolded = replace(own, mesh=image, model=model_of(part, image))
    step, same, apart = (next(each.run([])) for each in (own, unfolded, other))
    component = (lambda each: each.rotation[1]) if motion else (lambda each: each.translation[2])
    assert abs(component(step)) > 1e-3
    # On the same mesh, and on a mesh of the whole body, which is as coarse but not symmetric.
    assert component(step) == pytest.approx(component(same), rel=1e-6)
    assert component(step) == pytest.approx(component(apart), rel=0.06)
    # So is the estimate on a refined mesh, which has the faces, caps and sheets of the file too.
    fine, same_fine = ((each.fine_rotation[1] if motion else each.fine_translation[2]) for each in (step, same))
    # Images of elements are divided along other diagonals.
    assert abs(fine - component(step)) > 0.0 and fine == pytest.approx(same_fine, abs=0.1 * abs(fine - component(step)))
    assert set(step.volumes) <= set(same.volumes) == set(apart.volumes)
    for chamber, volume in step.volumes.items():
        assert volume == pytest.approx(same.volumes[chamber], rel=1e-6)
        assert volume == pytest.approx(apart.volumes[chamber], rel=3e-3)


def test_meshes_of_parts_are_closed(folder):
    for name, more, rest, planes, volume in (
        ("one.step", SYMMETRIC, "", ("xz",), 12 * 16 * 24 - np.pi * 9 * 18),
        ("skin.step", SYMMETRIC, REGION, ("xz",), 14 * 16 * 24 - np.pi * 9 * 18),
        ("tube.step", QUARTER, "", ("xz", "yz"), np.pi * (64 * 24 - 25 * 18)),
        ("pair.step", SYMMETRIC, "", ("xz",), 12 * 16 * 24 - 2 * 6 * 4.5 * 18),
    ):
        found = asked(folder, name, more, rest)
        mesh = mesh_of(found, body_of(found), planes).mesh
        assert mesh.part == planes
        assert 2 ** len(planes) * mesh.volume() == pytest.approx(volume, rel=2e-3)
        assert mesh.points[:, 1].min() > -1e-6
        chambers = [face for face in mesh.faces if face.startswith("chamber ")]
        assert len(chambers) == 1
        assert chambers[0] in (("chamber A B", "chamber B A") if name == "pair.step" else ("chamber A",))
        assert set(mesh.regions) == ({"body", "skin"} if rest else set())
        whole = unfold(mesh).mesh
        assert whole.volume() == pytest.approx(volume, rel=2e-3)


def test_what_is_not_symmetric_is_solved_as_a_whole(folder):
    aside = SHEET.replace('{ name = "floor" }', '{ faces = "y = 8 mm" }')
    tip = 'tip = { faces = "y = 8 mm" }\n' + SYMMETRIC
    handed = '[[fibres]]\nname = "wire"\nstiffness = "9 N/mm"\nwinding = "30 deg"\nfamilies = 1\n'
    assert part_of(asked(folder, "one.step", SYMMETRIC)) == ("xz",)
    for name, more, rest in (
        ("one.step", SYMMETRIC, aside),
        ("one.step", tip, ""),
        ("one.step", SYMMETRIC, handed),
        ("one.step", SYMMETRIC, "[gravity]\ndirection = [0, 1, 0]\n"),
    ):
        assert part_of(asked(folder, name, more, rest)) == ()


def test_gradients_of_halves_are_exact(folder):
    found = asked(folder, "one.step", SYMMETRIC, '[design]\nspacing = "7 mm"\n', size="5 mm")
    space, start = space_of(found), body_of(found)
    disc = build_discretisation(found, mesh_of(found, start, part_of(found)), start.control_points())
    assert disc.model.part == ("xz",)
    at = analyse(found, space, disc, space.start, tolerance=1e-11)
    slope = design_gradient(found, space, disc, at)
    states = {name: each.state for name, each in at.equilibria.items()}

    def value(phi):
        return analyse(found, space, disc, phi, states, tolerance=1e-11).value

    way = np.random.default_rng(1).uniform(-1, 1, space.n)
    test = taylor_test(value, space.start, slope, way, 0.1, count=3, start=at.value)
    assert test.rate == pytest.approx(2.0, abs=0.02)
