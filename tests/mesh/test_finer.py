"""Edges of surfaces divided beside poor elements: surfaces keep their shape, fit together, and are as symmetric."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.errors import MeshError
from pneumorph.geometry import Body
from pneumorph.mesh import scaled_jacobian
from pneumorph.mesh.tets import TRIANGLE_EDGES, area_and_volume
from pneumorph.mesh.tube import build, mesh_body
from pneumorph.mesh.tube.finer import with_divided_edges
from pneumorph.mesh.tube.surface import SurfaceMesh, surface_mesh


def some_middles(mesh: SurfaceMesh, share: int = 17) -> np.ndarray:
    """Nodes in the middle of one in so many edges."""
    return np.unique(mesh.triangles[:, 3:])[::share]


@pytest.mark.parametrize("name", ["tube", "pole_tube", "bellows"])
def test_divided_surfaces_keep_their_shape_and_are_closed(name: str, request: pytest.FixtureRequest) -> None:
    body: Body = request.getfixturevalue(name)
    mesh, P = surface_mesh(body, 3.0), body.control_points()
    finer = with_divided_edges(mesh, P, some_middles(mesh))
    assert len(mesh.triangles) < len(finer.triangles) < 2 * len(mesh.triangles)
    before, after = mesh.B @ P, finer.B @ P
    np.testing.assert_array_equal(after[: len(before)], before)
    for face in mesh.faces:
        for was, now in zip(
            area_and_volume(before, mesh.faces[face]), area_and_volume(after, finer.faces[face]), strict=True
        ):
            np.testing.assert_allclose(now, was, atol=1e-9)
    edges = np.sort(finer.triangles[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert len(np.unique(finer.triangles)) == len(after)
    assert not np.isin(some_middles(mesh), finer.triangles[:, 3:]).any()


@pytest.mark.parametrize("name", ["tube", "bellows"])
@pytest.mark.parametrize("chamber", ["A", "tip"])
def test_parameters_stay_those_of_the_nodes(name: str, chamber: str, request: pytest.FixtureRequest) -> None:
    body: Body = request.getfixturevalue(name)
    body = replace(body, chambers=(replace(body.chambers[0], name=chamber),))
    mesh, P = surface_mesh(body, 3.0), body.control_points()
    finer = with_divided_edges(mesh, P, some_middles(mesh))
    nodes = finer.B @ P
    for surface in body.surfaces:
        param = finer.param[surface.name]
        face = finer.faces[f"chamber {surface.name}" if surface.cavity else "exterior"][: len(param)]
        exact = surface.points(*param.reshape(-1, 2).T).reshape(-1, 6, 3)
        away = np.linalg.norm(nodes[face] - exact, axis=2)
        # Nodes there were are exact; new ones are on triangles of the mesh there was.
        assert away[face < len(mesh.offset)].max() < 1e-9 < away.max() < 0.05


def test_a_body_with_few_poor_elements_keeps_most_of_their_size(
    parallel_folds: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    morph = mesh_body(parallel_folds, 4.5, finest=3.5)
    assert scaled_jacobian(morph.mesh.points, morph.mesh.tets).min() > 0.1
    monkeypatch.setattr(build, "_TIMES", 0)
    with pytest.raises(MeshError, match="quality"):
        mesh_body(parallel_folds, 4.5, finest=3.5)
