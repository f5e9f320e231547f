"""The CalculiX input file: its structure, and its answer where the program is installed."""

import numpy as np
import pytest
from installed import needs

from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import (
    Tangent,
    build_loads,
    build_model,
    configure,
    loads_of,
    mirrors_of,
    model_of,
    neo_hookean_rubber,
    solve,
    whole_of,
)
from pneumorph.mesh.tets import TET_FACES
from pneumorph.mesh.tube import mesh_body
from pneumorph.output.formats.abaqus import FACES, abaqus_input, as_whole, covered_faces, element_faces, plate_nodes
from pneumorph.problem import Problem
from pneumorph.verify import calculix
from pneumorph.verify.actuator import linear_actuator
from pneumorph.verify.solids import tube, with_lids

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


@pytest.fixture(scope="module")
def loaded():
    # A closed chamber: on an open one −pV also pulls at the rims, which tractions do not.
    mesh = mesh_body(starting_body(linear_actuator().body), 8.0).mesh
    built = build_model(mesh, RUBBER)
    acting = build_loads(
        built,
        {"A": 0.04},
        acceleration=np.array([9810.0, 0, 0]),
        spring=np.array([0, 0, 0.5, 0, 20, 0]),
        wrench=np.array([0.01, 0, 0.1, 0, 0.3, 0.5]),
    )
    return mesh, configure(built, mesh.points, acting)


def blocks(text):
    """Data lines by keyword line, those of the same keyword after each other."""
    found = {}
    for line in text.splitlines():
        if line.startswith("*"):
            found[line] = found.get(line, [])
            latest = found[line]
        else:
            latest.append(line)
    return found


def test_faces_are_numbered_as_the_manual_says():
    assert {tuple(sorted(face)) for face in TET_FACES.tolist()} == {tuple(face) for face in FACES.tolist()}
    # P2 of the manual is 1-4-2, P3 is 2-4-3, P4 is 3-4-1.
    assert FACES.tolist() == [[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]


def test_every_wall_triangle_is_a_face_of_its_element(loaded):
    mesh, _ = loaded
    wall = mesh.faces["chamber A"]
    elements, faces = element_faces(mesh, wall)
    assert len(elements) == len(wall)
    of_elements = np.take_along_axis(mesh.tets[elements], FACES[faces], axis=1)
    assert (np.sort(of_elements, axis=1) == np.sort(wall[:, :3], axis=1)).all()


def test_lids_without_elements_carry_no_load():
    mesh = tube(4, 8, 20, (1, 8, 4))
    closed, _ = with_lids(mesh, 20)
    assert len(element_faces(closed, closed.faces["chamber A"])[0]) == len(mesh.faces["chamber A"])


def test_the_file_holds_the_whole_model(loaded):
    mesh, at = loaded
    found = blocks(abaqus_input(mesh, at))
    nodes = np.array([line.split(",") for line in found["*NODE, NSET=ALL"]], float)
    assert np.abs(nodes[:, 1:] - mesh.points).max() < 1e-10
    elements = np.array([line.split(",") for line in found["*ELEMENT, TYPE=C3D10, ELSET=BODY"]], int)
    assert (elements[:, 1:] == mesh.tets + 1).all()
    c10, d1 = map(float, found["*HYPERELASTIC, NEO HOOKE"][0].split(","))
    assert (2 * c10, 2 / d1) == pytest.approx((0.49, 4.80))
    centre, turn = plate_nodes(mesh)
    assert f"*RIGID BODY, NSET=TIP, REF NODE={centre}, ROT NODE={turn}" in found
    assert float(found["*SPRING, ELSET=SPRING3"][1]) == 0.5
    assert found["*SPRING, ELSET=SPRING5"][0] == "2"
    pulled = [line.split(",") for line in found["*CLOAD"]]
    assert [(int(node), int(freedom)) for node, freedom, _ in pulled] == [
        (centre, 1),
        (centre, 3),
        (turn, 2),
        (turn, 3),
    ]
    pressed = [line for line in found["*DLOAD"] if "GRAV" not in line]
    assert len(pressed) == len(mesh.faces["chamber A"])
    gravity = next(line.split(",") for line in found["*DLOAD"] if "GRAV" in line)
    assert float(gravity[2]) == pytest.approx(9810)
    assert all(len(line) < 132 for line in abaqus_input(mesh, at).splitlines())


def test_calculix_gives_the_same_answer(loaded):
    needs(calculix.program)
    mesh, at = loaded
    u, plate = calculix.equilibrium(mesh, at)
    found = solve(at, Tangent(at.model))
    assert np.abs(u - found.u).max() < 5e-3 * np.abs(u).max()
    assert np.abs(plate - found.plate).max() < 5e-3 * np.abs(plate).max()


def test_calculix_blocks_components(loaded):
    needs(calculix.program)
    mesh, at = loaded
    blocked = configure(at.model, mesh.points, at.loads, np.isin(range(6), (2, 4)))
    u, plate = calculix.equilibrium(mesh, blocked)
    found = solve(blocked, Tangent(at.model))
    assert plate[2] == plate[4] == 0.0
    assert np.abs(u - found.u).max() < 5e-3 * np.abs(u).max()


@pytest.mark.parametrize("mirrors", [("xz",), ("xz", "yz")])
def test_part_of_a_body_is_written_whole(mirrors):
    """Its faces, loads and springs are those of the whole body, and the answer is the part's."""
    changes = {"body.symmetry.mirror": list(mirrors), "end_effector.spring.axial": "0.5 N/mm"}
    problem = linear_actuator().with_changes(changes)
    mesh = mesh_body(starting_body(problem.tubes), 8.0, mirrors).mesh
    part = model_of(problem, mesh)
    at = configure(part, mesh.points, loads_of(problem, part, {"A": 0.04}))
    found = blocks(abaqus_input(mesh, at))
    whole = whole_of(part, mesh).image.mesh
    assert len(found["*ELEMENT, TYPE=C3D10, ELSET=BODY"]) == 2 ** len(mirrors) * len(mesh.tets) == len(whole.tets)
    assert len(found["*DLOAD"]) == len(whole.faces["chamber A"])
    assert float(found["*SPRING, ELSET=SPRING3"][1]) == pytest.approx(0.5)
    needs(calculix.program)
    u, plate = calculix.equilibrium(mesh, at)
    ours = solve(at, Tangent(part))
    assert np.abs(plate - ours.plate).max() < 5e-3 * np.abs(plate).max()
    assert np.abs(u[: len(mesh.points)] - ours.u).max() < 5e-3 * np.abs(u).max()


def sheeted(**more):
    """A tube in a sheet, on a coarse mesh, with its configuration."""
    sheet = {"name": "sheet", "stiffness": "5 N/mm", "poisson": 0.3, "wrinkling": 1.0}
    tables = linear_actuator().model_dump(mode="json", exclude_none=True)
    tables["material"] = {
        "model": "neo-hookean",
        "shear_modulus": "0.49 MPa",
        "bulk_modulus": "4.8 MPa",
        "density": "1.1 g/cm^3",
    }
    tables["body"]["length"], tables["body"]["chamber"][0]["span"] = "30 mm", ["4 mm", "26 mm"]
    problem = Problem.model_validate(tables | {"membrane": [sheet | more]})
    mesh = mesh_of(problem, body_of(problem), mirrors_of(problem), 8.0).mesh
    model = model_of(problem, mesh)
    return mesh, configure(model, mesh.points, loads_of(problem, model, {"A": 0.04}))


def test_a_sheet_is_written_as_shells_of_its_stiffness():
    mesh, at = sheeted(coverage=0.5)
    found = blocks(abaqus_input(mesh, at))
    young, poisson = map(float, found["*ELASTIC"][0].split(","))
    (section,) = (lines for key, lines in found.items() if key.startswith("*SHELL SECTION"))
    (shells,) = (lines for key, lines in found.items() if key.startswith("*ELEMENT, TYPE=S6"))
    assert (young * float(section[0]), poisson) == pytest.approx((2.5, 0.3))
    whole = as_whole(mesh, at)[0]
    assert len(shells) == len(np.unique(whole.covers["sheet"].nodes, axis=0))


def test_a_sheet_on_a_part_is_as_large_in_the_file():
    """Faces that it covers in part have thinner shells, so that the areas add up."""
    mesh, at = sheeted(angles=["-80 deg", "80 deg"])
    whole, _ = as_whole(mesh, at)
    faces, shares = covered_faces(whole.covers["sheet"])
    assert 0 < shares.min() < shares.max() == 1.0
    assert shares.sum() == pytest.approx(2 * whole.covers["sheet"].points[..., 2].sum(), rel=1e-5)
    assert len(np.unique(faces, axis=0)) == len(faces)


def test_a_sheet_that_wrinkles_is_refused():
    mesh, at = sheeted(wrinkling=0.01)
    with pytest.raises(ProblemError, match="sheet") as refused:
        abaqus_input(mesh, at)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_calculix_gives_the_same_answer_with_a_sheet():
    needs(calculix.program)
    mesh, at = sheeted()
    u, plate = calculix.equilibrium(mesh, at)
    ours = solve(at, Tangent(at.model))
    assert plate[2] == pytest.approx(ours.plate[2], rel=1e-2)
    assert np.abs(u[: len(mesh.points)] - ours.u).max() < 3e-2 * np.abs(u).max()
