"""Triangulated surfaces: exact, closed, oriented, symmetric."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.mesh.tets import TRIANGLE_EDGES, area_and_volume
from pneumorph.mesh.tube.surface import SurfaceMesh, surface_mesh

BODIES = ["tube", "pole_tube", "bellows"]


def exterior(mesh: SurfaceMesh) -> np.ndarray:
    return np.concatenate([mesh.faces[name] for name in ("base", "exterior", "tip")])


@pytest.mark.parametrize("name", BODIES)
def test_nodes_are_on_the_exact_surface(name: str, request: pytest.FixtureRequest) -> None:
    body: Body = request.getfixturevalue(name)
    mesh = surface_mesh(body, 3.0)
    nodes = mesh.B @ body.control_points()
    for surface in body.surfaces:
        faces = mesh.faces[f"chamber {surface.name}" if surface.cavity else "exterior"]
        q, r = mesh.param[surface.name].reshape(-1, 2).T
        exact = surface.points(q, r).reshape(-1, 6, 3)
        np.testing.assert_allclose(nodes[faces[: len(exact)]], exact, atol=1e-10)
        discs = faces[len(exact) :].ravel()
        if not any(surface.poles):
            ends = surface.end_centres[:, 2]
            assert np.abs(nodes[discs, 2][:, None] - ends).min(axis=1).max(initial=0) < 1e-10


@pytest.mark.parametrize("name", BODIES)
def test_surfaces_are_closed_and_oriented(name: str, request: pytest.FixtureRequest) -> None:
    body: Body = request.getfixturevalue(name)
    mesh = surface_mesh(body, 3.0)
    nodes = mesh.B @ body.control_points()
    outer, volume = area_and_volume(nodes, exterior(mesh))
    np.testing.assert_allclose(outer, 0, atol=1e-10)
    np.testing.assert_allclose(volume, enclosed_volume(body.exterior), rtol=2e-3)
    inner, volume = area_and_volume(nodes, mesh.faces["chamber A"])
    np.testing.assert_allclose(inner, 0, atol=1e-10)
    np.testing.assert_allclose(-volume, enclosed_volume(body.chambers[0]), rtol=1e-2)
    base, _ = area_and_volume(nodes, mesh.faces["base"])
    assert base[2] < -150
    edges = np.sort(mesh.triangles[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_volume_converges_at_the_rate_of_quadratic_triangles(tube: Body) -> None:
    exact = enclosed_volume(tube.chambers[0])
    errors = []
    for size in (4.0, 2.0):
        mesh = surface_mesh(tube, size)
        errors.append(abs(area_and_volume(mesh.B @ tube.control_points(), mesh.faces["chamber A"])[1] + exact))
    assert 3.0 < np.log2(errors[0] / errors[1]) < 5.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_pattern_has_the_mirror_symmetries_of_the_body(bellows: Body, axis: int) -> None:
    mesh = surface_mesh(bellows, 3.0)
    nodes = mesh.B @ bellows.control_points()
    mirrored = nodes.copy()
    mirrored[:, axis] = (nodes[:, axis].min() + nodes[:, axis].max()) - nodes[:, axis]

    # Nets of an odd number of columns are themselves off the mirror symmetry by a micrometre.
    edges = np.unique(mesh.triangles[:, 3:])
    assert KDTree(nodes[edges]).query(mirrored[edges])[0].max() < 2e-3


def test_folds_get_more_rows(tube: Body, bellows: Body) -> None:
    plain, folded = (len(surface_mesh(body, 3.0).faces["exterior"]) for body in (tube, bellows))
    assert folded > 2 * plain
