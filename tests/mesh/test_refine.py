"""Meshes whose elements are divided into eight: the same body, and what its parts, faces and regions need."""

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import part_of
from pneumorph.mesh.refine import refine
from pneumorph.mesh.tets import TURNED, area_and_volume, tet_gradient, triangle_gradient
from pneumorph.problem import loads

TASK = '[[task]]\nname = "move"\npressure = { A = "10 kPa" }\nobjective = { motion = "extension" }\n'

PARTS = {
    "whole": ("", TWO_BESIDE),
    "quarter": ('symmetry = { mirror = ["xz", "yz"] }', None),
    "sector": ("symmetry = { rotation = 3 }", None),
}


def meshed(which):
    symmetry, chambers = PARTS[which]
    options = {} if chambers is None else {"chambers": chambers}
    text = problem_text(TASK, radius=10, **options)
    problem = loads(text.replace("[body]", f"[body]\n{symmetry}", 1)).with_changes({"mesh.size": "8 mm"})
    return mesh_of(problem, starting_body(problem.tubes), part_of(problem)).mesh


@pytest.fixture(scope="module", params=list(PARTS))
def refined(request):
    mesh = meshed(request.param)
    return mesh, refine(mesh)


def test_the_body_is_the_same(refined):
    mesh, fine = refined
    assert len(fine.mesh.tets) == 8 * len(mesh.tets) and fine.mesh.part == mesh.part
    nodes = fine.mesh.points[fine.mesh.tets]
    centre = tet_gradient(np.full((1, 3), 0.25))[0]
    assert np.linalg.det(np.einsum("eni,nk->eik", nodes, centre)).min() > 0.0
    for name, face in mesh.faces.items():
        old, new = area_and_volume(mesh.points, face), area_and_volume(fine.mesh.points, fine.mesh.faces[name])
        np.testing.assert_allclose(new[0], old[0], atol=1e-9)
        assert new[1] == pytest.approx(old[1], abs=1e-8)
    assert fine.mesh.volume() == pytest.approx(mesh.volume(), rel=1e-12)


def test_mid_side_nodes_are_between_corners_where_edges_are_straight(refined):
    """A linear field on nodes in barycentric coordinates is reproduced: P has the shape functions of the elements."""
    mesh, fine = refined
    assert np.abs(fine.P @ np.ones(len(mesh.points)) - 1.0).max() < 1e-14
    np.testing.assert_array_equal(fine.mesh.points[: len(mesh.points)], mesh.points)


def test_the_second_cut_of_a_sector_is_still_the_image_of_the_first():
    fine = refine(meshed("sector")).mesh
    (name,) = fine.part
    first, second = fine.faces[name][:, TURNED], fine.faces[f"{name} image"]
    turn = np.array([[-0.5, -np.sqrt(0.75), 0.0], [np.sqrt(0.75), -0.5, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(fine.points[second], fine.points[first] @ turn.T, atol=1e-9)


COVERED = """
[[membrane]]
name = "patch"
surfaces = ["exterior"]
stiffness = "1 N/mm"
span = ["3 mm", "13 mm"]
angles = ["20 deg", "200 deg"]
"""


def test_what_is_covered_of_a_face_is_that_of_its_parts():
    """Areas of parts of faces are the same, and so are the directions on them at the points of the whole."""
    text = problem_text(TASK + COVERED, chambers=TWO_BESIDE, radius=10)
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    mesh = mesh_of(problem, starting_body(problem.tubes), part_of(problem)).mesh
    fine = refine(mesh).mesh
    area, along = zip(*(measured(each) for each in (mesh, fine)), strict=True)
    assert area[0] > 0.0 and len(fine.covers["patch"].nodes) > len(mesh.covers["patch"].nodes)
    assert area[1] == pytest.approx(area[0], rel=2e-3)
    np.testing.assert_allclose(along[1], along[0], atol=5e-3)


def measured(mesh):
    """Area of what is covered, and the mean of the unit vectors from base to tip there."""
    own = mesh.covers["patch"]
    tangents = np.einsum("eai,eqak->eqik", mesh.points[own.nodes], triangle_gradient(own.points[..., :2]))
    shares = own.points[..., 2] * np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1)
    along = np.einsum("eqik,eqk->eqi", tangents, own.points[..., 3:])
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    return shares.sum(), np.einsum("eq,eqi->i", shares, along) / shares.sum()
