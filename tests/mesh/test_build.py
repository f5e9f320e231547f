"""Whole meshes: filled, positively oriented, of fair quality, for all kinds of bodies."""

import numpy as np
import pytest

from pneumorph.errors import MeshError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.mesh import Morph, scaled_jacobian
from pneumorph.mesh.tets import TET_EDGES, TET_FACES, TET_RULE, tet_gradient
from pneumorph.mesh.tube import mesh_body
from pneumorph.mesh.volume import fill


def check(body: Body, morph: Morph, least_quality: float) -> None:
    mesh = morph.mesh
    assert scaled_jacobian(mesh.points, mesh.tets).min() > least_quality
    assert len(np.unique(mesh.tets)) == len(mesh.points)
    np.testing.assert_allclose(mesh.points[: morph.n_surface], morph.B @ body.control_points(), atol=1e-10)
    assert set(mesh.faces) == {"base", "tip", "exterior", *(f"chamber {chamber.name}" for chamber in body.chambers)}

    # The boundary of the tetrahedra is the named faces, same corners, same orientation, same mid-side nodes.
    corners = mesh.tets[:, TET_FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True)
    boundary = corners[first[count == 1]]
    faces = np.concatenate(list(mesh.faces.values()))
    assert _rotations(boundary) == _rotations(faces[:, :3])
    middle = {
        frozenset(ends): mid
        for ends, mid in zip(mesh.tets[:, TET_EDGES].reshape(-1, 2).tolist(), mesh.tets[:, 4:].ravel(), strict=True)
    }
    for face in faces[:: len(faces) // 50].tolist():
        a, b, c = face[:3]
        assert face[3:] == [middle[frozenset(ends)] for ends in ((a, b), (b, c), (c, a))]

    jacobian = np.einsum("eai,gak->egik", mesh.points[mesh.tets], tet_gradient(TET_RULE))
    by_tets = np.linalg.det(jacobian).sum() / 24
    np.testing.assert_allclose(mesh.volume(), by_tets, rtol=1e-4)
    exact = enclosed_volume(body.exterior) - sum(enclosed_volume(chamber) for chamber in body.chambers)
    np.testing.assert_allclose(mesh.volume(), exact, rtol=5e-3)


def _rotations(triangles: np.ndarray) -> set[tuple[int, ...]]:
    start = triangles.argmin(axis=1)[:, None]
    return set(map(tuple, np.take_along_axis(triangles, (start + np.arange(3)) % 3, axis=1).tolist()))


def test_tube(tube: Body, tube_morph: Morph) -> None:
    check(tube, tube_morph, 0.25)


def test_walls_thicker_than_an_edge_have_vertices_inside(tube: Body) -> None:
    mesh = mesh_body(tube, 2.0).mesh
    ends = mesh.points[mesh.tets[:, TET_EDGES]]
    assert np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2).max() < 2.2 * 2.0


@pytest.mark.parametrize(("name", "least"), [("pole_tube", 0.1), ("parallel", 0.1), ("series", 0.2)])
def test_chambers(name: str, least: float, request: pytest.FixtureRequest) -> None:
    body = request.getfixturevalue(name)
    check(body, mesh_body(body, 3.0), least)


def test_many_points_on_one_sphere(ring: Body) -> None:
    """Netgen took minutes for this regular body, and filled it with 12,918 elements."""
    assert len(mesh_body(ring, 2.59).mesh.tets) < 5000


@pytest.mark.parametrize("name", ["bellows", "thin_bellows"])
def test_deep_folds(name: str, request: pytest.FixtureRequest) -> None:
    body = request.getfixturevalue(name)
    check(body, mesh_body(body, 2.5), 0.02)


@pytest.mark.parametrize("few", [0.05, 0.001])
def test_where_few_elements_are_poor_nodes_slide(
    few: float, parallel_folds: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One in eighty is: a mesh of the size that is asked for is found if that counts as few, and else none."""
    monkeypatch.setattr("pneumorph.mesh.build._FEW", few)
    monkeypatch.setattr("pneumorph.mesh.build._FINER", (1.0,))
    if few < 0.01:
        with pytest.raises(MeshError, match="quality"):
            mesh_body(parallel_folds, 4.0)
    else:
        check(parallel_folds, mesh_body(parallel_folds, 4.0), 0.02)


def test_touching_walls_are_refused_in_a_sentence(tube: Body) -> None:
    points = tube.control_points().copy()
    points[tube.slices[1], :2] *= 2.2
    with pytest.raises(MeshError, match=r"could not be filled.*surfaces may touch") as refusal:
        mesh_body(tube.with_control_points(points), 4.0)
    assert "\n" not in str(refusal.value)


def test_a_flat_element_makes_another_attempt(tube: Body, monkeypatch: pytest.MonkeyPatch) -> None:
    """Netgen may leave one on an end plane that no new vertex repairs."""
    filled = []

    def with_flat_element(*given):
        mesh = fill(*given)
        filled.append(mesh)
        if len(filled) == 1:
            on_base = np.isin(mesh.tets[:, :4], mesh.faces["base"])
            element = np.argmax(on_base.sum(axis=1) == 3)
            mesh.points[mesh.tets[element, :4][~on_base[element]], 2] = 0.0
            mesh.points[mesh.tets[:, 4:]] = mesh.points[mesh.tets[:, TET_EDGES]].mean(axis=2)
        return mesh

    monkeypatch.setattr("pneumorph.mesh.build.fill", with_flat_element)
    check(tube, mesh_body(tube, 3.0), 0.1)
    assert len(filled) == 2
