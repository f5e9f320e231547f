"""Files for Gmsh, VTK, FEBio and SOFA are read back by small readers, and have the whole model."""

import sys
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import jax.numpy as jnp
import numpy as np
import pytest
import pyvista as pv
from tiny import tiny

from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import build_loads, build_model, configure, mirrors_of, rubber_of
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, TetMesh, area_vectors
from pneumorph.output.export import export, formats_of
from pneumorph.output.formats.febio import febio_input, material_of, yeoh_of_arruda_boyce
from pneumorph.output.formats.gmsh import gmsh_mesh
from pneumorph.output.formats.sofa import sofa_scene
from pneumorph.problem import loads
from pneumorph.problem.material import elastomer, library
from pneumorph.results import Fields

SOFT, STIFF = Rubber(energies.ogden, (0.05, 3.0, 50.0), 1.0e-9), Rubber(energies.yeoh, (0.11, 0.02, 220.0), 1.2e-9)


@pytest.fixture(scope="module")
def problem():
    return loads(tiny())


@pytest.fixture(scope="module")
def mesh(problem):
    found = mesh_of(problem, body_of(problem), mirrors_of(problem), 6.0).mesh
    assert not found.part
    half = np.arange(len(found.tets)) % 2 == 0
    return TetMesh(found.points, found.tets, found.faces, {"body": np.flatnonzero(half), "rib": np.flatnonzero(~half)})


@pytest.fixture(scope="module")
def at(mesh):
    model = build_model(mesh, {"body": SOFT, "rib": STIFF})
    acting = build_loads(
        model, {"A": 0.04}, acceleration=np.array([0, 0, -9810.0]), wrench=np.array([0, 0.2, 0, 0, 0, 3.0])
    )
    return configure(model, mesh.points, acting, np.array([1, 0, 0, 0, 1, 0], bool))


def middles(points, nodes, edges):
    """How far mid-side nodes are from the middles of their edges, over the lengths of these."""
    ends = points[nodes[:, edges]]
    return np.linalg.norm(points[nodes[:, len(nodes[0]) - len(edges) :]] - ends.mean(axis=2), axis=2) / np.linalg.norm(
        ends[:, :, 1] - ends[:, :, 0], axis=2
    )


def test_a_mesh_for_gmsh(mesh):
    lines = gmsh_mesh(mesh).splitlines()

    def section(name):
        return lines[lines.index(f"${name}") + 1 : lines.index(f"$End{name}")]

    names = {}
    for line in section("PhysicalNames")[1:]:
        dimension, number, name = line.split(maxsplit=2)
        names[name.strip('"')] = int(dimension), int(number)
    assert names.keys() == {*mesh.faces, *mesh.regions}
    assert [names["chamber A"][0], names["rib"][0]] == [2, 3]
    nodes = np.array([line.split() for line in section("Nodes")[1:]], float)
    np.testing.assert_allclose(nodes[:, 1:], mesh.points, atol=1e-11)
    elements = [[int(word) for word in line.split()] for line in section("Elements")[1:]]
    assert [row[0] for row in elements] == list(range(1, int(section("Elements")[0]) + 1))
    faces = np.array([row[5:] for row in elements if row[1] == 9 and row[3] == names["chamber A"][1]]) - 1
    np.testing.assert_array_equal(faces, mesh.faces["chamber A"])
    tets = np.array([row[5:] for row in elements if row[1] == 11 and row[3] == names["rib"][1]]) - 1
    assert len(tets) == len(mesh.regions["rib"])
    # Gmsh's edges: 01, 12, 20, 30, 32, 31.
    gmsh_edges = np.array([[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]])
    assert middles(mesh.points, tets, gmsh_edges).max() < 0.2 < middles(mesh.points, tets, TET_EDGES).max()


def test_a_grid_has_its_faces_as_named_groups(problem, mesh, tmp_path):
    fields = Fields(mesh, {"extend": 0.1 * mesh.points}, {"extend": np.ones(len(mesh.points))})
    plain = Fields(TetMesh(mesh.points, mesh.tets, mesh.faces), fields.u, fields.stretch)
    export(tmp_path / "body.vtu", "vtu", problem, plain, {"A": 0.04})
    found = pv.read(tmp_path / "body.vtu")
    assert set(mesh.faces) <= set(found.cell_data)
    wall = found.extract_cells(np.flatnonzero(found.cell_data["chamber A"]))
    assert set(wall.celltypes) == {pv.CellType.QUADRATIC_TRIANGLE}
    assert wall.n_cells == len(mesh.faces["chamber A"])
    assert wall.n_points == len(np.unique(mesh.faces["chamber A"]))
    tets = found.cells_dict[pv.CellType.QUADRATIC_TETRA]
    np.testing.assert_array_equal(tets, mesh.tets)
    np.testing.assert_allclose(found.point_data["extend displacement"], 0.1 * mesh.points)


def test_an_input_file_for_febio(mesh, at):
    root = ElementTree.fromstring(febio_input(mesh, at))
    assert (root.tag, root.get("version"), root.find("Module").get("type")) == ("febio_spec", "4.0", "solid")
    nodes = np.array([node.text.split(",") for node in root.iterfind("Mesh/Nodes/node")], float)
    np.testing.assert_allclose(nodes, mesh.points, atol=1e-11)
    parts = {part.get("name"): part for part in root.iterfind("Mesh/Elements")}
    assert {part.get("type") for part in parts.values()} == {"tet10"}
    for name, own in mesh.regions.items():
        rows = {int(row.get("id")) - 1: [int(node) - 1 for node in row.text.split(",")] for row in parts[name]}
        assert set(rows) == set(own) and all(rows[k] == mesh.tets[k].tolist() for k in own)
    domains = {domain.get("name"): domain.get("mat") for domain in root.iterfind("MeshDomains/SolidDomain")}
    materials = {material.get("name"): material for material in root.iterfind("Material/material")}
    assert set(domains) == set(parts) and set(domains.values()) | {"plate"} == set(materials)
    assert [materials[name].get("type") for name in ("body", "rib", "plate")] == ["Ogden", "Yeoh", "rigid body"]
    assert len({material.get("id") for material in materials.values()}) == 3
    surfaces = {surface.get("name"): surface for surface in root.iterfind("Mesh/Surface")}
    wall = np.array([face.text.split(",") for face in surfaces["chamber A"].iterfind("tri6")], int) - 1
    np.testing.assert_array_equal(wall, mesh.faces["chamber A"])
    assert middles(mesh.points, wall, TRIANGLE_EDGES).max() < 0.2
    (pressure,) = root.iterfind("Loads/surface_load")
    assert (pressure.get("type"), pressure.get("surface")) == ("pressure", "chamber A")
    assert float(pressure.find("pressure").text) == 0.04
    # FEBio takes the body force away.
    assert root.find("Loads/body_load/force").text.split(",")[2] == f"{9810:.12e}"
    (held,) = root.iterfind("Rigid/rigid_bc")
    assert {child.tag for child in held if child.text == "1"} == {"Rx_dof", "Rv_dof"}
    pulled = {load.find("dof").text: float(load.find("value").text) for load in root.iterfind("Rigid/rigid_load")}
    assert pulled == {"Ry": 0.2, "Rw": 3.0}
    sets = {each.get("name"): each.text.split(",") for each in root.iterfind("Mesh/NodeSet")}
    assert {bc.get("node_set") for bc in root.iterfind("Boundary/bc")} == set(sets) == {"base", "tip"}
    assert len(sets["base"]) == len(np.unique(mesh.faces["base"]))
    control = root.find("Control")
    assert int(control.find("time_steps").text) * float(control.find("step_size").text) == pytest.approx(1.0)
    curves = {curve.get("id") for curve in root.iterfind("LoadData/load_controller")}
    assert {each.get("lc") for each in root.iter() if each.get("lc")} == curves


def test_what_a_file_for_febio_cannot_hold(mesh):
    model = build_model(mesh, {"body": SOFT, "rib": STIFF})
    sprung = build_loads(model, {"A": 0.04}, spring=np.array([0, 0, 0.5, 0, 0, 0]))
    with pytest.raises(ProblemError, match="springs"):
        febio_input(mesh, configure(model, mesh.points, sprung))


@pytest.mark.parametrize("name", library())
def test_every_rubber_of_the_library_is_in_every_format(name):
    of = rubber_of(elastomer(name))
    kind, parameters = material_of(of)
    assert kind in ("Mooney-Rivlin", "Ogden", "Yeoh") and parameters["k"] == of.bulk_modulus
    shear = {
        "Mooney-Rivlin": 2 * (parameters["c1"] + parameters.get("c2", 0.0)),
        "Yeoh": 2 * parameters["c1"],
        "Ogden": sum(parameters[f"c{i}"] for i in range(1, 7) if f"c{i}" in parameters) / 2,
    }[kind]
    assert shear == pytest.approx(of.shear_modulus, rel=1e-6)
    assert formats_of(of) == ("vtu", "inp", "msh", "feb", "py")


def test_arruda_and_boyces_model_is_a_yeoh_model():
    F = jnp.diag(jnp.array([1.9, 0.8, 1 / (1.9 * 0.8)]))
    series = energies.arruda_boyce(F, jnp.array([0.2, 2.0, 0.0]))
    assert float(energies.yeoh(F, jnp.array([*yeoh_of_arruda_boyce(0.2, 2.0), 0.0]))) == pytest.approx(float(series))


class Node:
    """What a scene needs of SOFA, which takes note of what is added."""

    def __init__(self, name=""):
        self.name, self.objects, self.children, self.time = name, [], {}, SimpleNamespace(value=0.0)

    def addObject(self, kind, **values):
        added = SimpleNamespace(kind=kind, **values)
        self.objects.append(added)
        return added

    def addChild(self, name):
        return self.children.setdefault(name, Node(name))

    def of(self, kind):
        return next(each for each in self.objects if each.kind == kind)


def test_a_scene_for_sofa(mesh, at, monkeypatch):
    fake = ModuleType("Sofa")
    fake.Core = SimpleNamespace(Controller=type("Controller", (), {"__init__": lambda self, *args, **values: None}))
    monkeypatch.setitem(sys.modules, "Sofa", fake)
    scene = {}
    exec(compile(sofa_scene(mesh, at), "scene.py", "exec"), scene)
    root = Node()
    scene["createScene"](root)
    body, cavity = root.children["body"], root.children["body"].children["cavity_A"]
    position = np.array(body.of("TetrahedronSetTopologyContainer").position)
    tets = np.array(body.of("TetrahedronSetTopologyContainer").tetrahedra)
    assert len(tets) == len(mesh.tets) and len(position) == len(np.unique(mesh.tets[:, :4]))
    volumes = np.linalg.det(position[tets[:, 1:]] - position[tets[:, :1]]) / 6
    assert volumes.min() > 0 and volumes.sum() == pytest.approx(mesh.volume(), rel=0.1)
    assert np.abs(position[body.of("FixedProjectiveConstraint").indices][:, 2]).max() < 1e-6
    elastic = body.of("TetrahedronFEMForceField")
    young = np.array(elastic.youngModulus)
    shear = young[mesh.regions["rib"]] / (2 * (1 + elastic.poissonRatio))
    np.testing.assert_allclose(shear, 1e3 * 2 * 0.11)
    assert 1.0e-6 < body.of("UniformMass").totalMass / volumes.sum() < 1.2e-6
    wall = np.array(cavity.of("MeshTopology").triangles)
    corners = np.array(cavity.of("MeshTopology").position)[wall]
    # The volume within: normals point out of the cavity.
    inside = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    places, normals = area_vectors(mesh.points, mesh.faces["chamber A"])
    assert inside == pytest.approx(-np.einsum("fgi,fgi->", places, normals) / 3, rel=0.1) and inside > 0
    (inflation,) = [each.kind for each in root.objects if not isinstance(each.kind, str)]
    pressure = cavity.of("SurfacePressureConstraint")
    assert pressure.value == [0.0] and pressure.valueType == "pressure"
    root.time.value = 5.0
    inflation.onAnimateBeginEvent(None)
    assert pressure.value == [pytest.approx(40.0 * root.dt)]
