"""Halves and quarters: cut exactly in their mirror planes, closed, and a whole again when they are unfolded."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parts import check_pullback, perturbed, symmetric
from wholes import boundary, named, solid

from pneumorph.errors import MeshError
from pneumorph.mesh import needs_remesh, scaled_jacobian, unfold
from pneumorph.mesh.plane import triangulate
from pneumorph.mesh.tets import TET_EDGES
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem
from pneumorph.symmetry.operations import NORMALS


def problem(mirrors: str, *centres: tuple[float, float], radius: float = 2.0, ends: str = "flat") -> Problem:
    return symmetric({"mirror": mirrors.split()}, centres, radius, 30, ends, {"radius": "9 mm"})


CASES = {
    "cut": (problem("xz", (0, 0), radius=4), ["A"]),
    "domes": (problem("yz", (0, 0), radius=4, ends="pole"), ["A"]),
    "two cut": (problem("xz", (-4, 0), (4, 0)), ["A", "B"]),
    "a pair": (problem("yz", (-4, 0), (4, 0)), ["B A"]),
    "cut and pair": (problem("xz", (0, 4.5), (-4.5, 0), (0, -4.5), (4.5, 0)), ["A C", "B", "D"]),
    "a quarter": (problem("xz yz", (0, 0), radius=4), ["A"]),
    "a quarter with domes": (problem("xz yz", (0, 0), radius=4, ends="pole"), ["A"]),
    "a quarter and pairs": (problem("xz yz", (0, 4.5), (-4.5, 0), (0, -4.5), (4.5, 0)), ["A C", "D B"]),
    "a quarter and four": (problem("xz yz", (3.5, -3.5), (3.5, 3.5), (-3.5, -3.5), (-3.5, 3.5)), ["B A D C"]),
    "a quarter of both": (problem("xz yz", (0, 0), (0, 5.5), (0, -5.5), radius=1.5), ["A", "B C"]),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=list(CASES))
def case(request: pytest.FixtureRequest):
    asked, names = request.param
    space, phi = perturbed(asked)
    body, mirrors = space.body(phi), asked.body.symmetry.mirror
    return body, mirrors, names, mesh_body(body, 4.0, mirrors), space, phi


def test_a_part_is_closed_and_a_half_or_quarter_as_large(case) -> None:
    body, mirrors, names, morph, _, _ = case
    mesh = morph.mesh
    assert mesh.mirrors == mirrors
    cuts = [f"mirror {plane}" for plane in mirrors]
    assert set(mesh.faces) == {"base", "tip", "exterior", *cuts, *(f"chamber {name}" for name in names)}
    assert boundary(mesh) == named(mesh)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.1
    assert 2 ** len(mirrors) * mesh.volume() == pytest.approx(solid(body), rel=5e-3)
    for plane in mirrors:
        across, inside = mesh.points[:, NORMALS[plane]], mesh.mirror_nodes(plane)
        assert (across[inside] == 0).all()
        assert np.delete(across, inside).min() > 0


def test_unfolded_it_is_whole(case) -> None:
    body, mirrors, _, morph, _, _ = case
    image = unfold(morph.mesh)
    mesh = image.mesh
    assert mesh.mirrors == ()
    assert set(mesh.faces) == {"base", "tip", "exterior", *(f"chamber {chamber.name}" for chamber in body.chambers)}
    assert boundary(mesh) == named(mesh)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.1
    assert mesh.volume() == pytest.approx(2 ** len(mirrors) * morph.mesh.volume(), rel=1e-12)
    middles = mesh.points[mesh.tets[:, TET_EDGES]].mean(axis=2) - mesh.points[mesh.tets[:, 4:]]
    first, *images = (np.sort(np.linalg.norm(part, axis=-1).ravel()) for part in np.split(middles, 2 ** len(mirrors)))
    for other in images:
        np.testing.assert_allclose(first, other)
    for chamber in body.chambers:
        where = mesh.points[mesh.faces[f"chamber {chamber.name}"]].mean(axis=(0, 1))
        np.testing.assert_allclose(where[:2], chamber.net.mean(axis=(0, 1))[:2], atol=0.3)
    assert unfold(mesh).mesh is mesh


def test_planes_are_unfolded_one_by_one(case) -> None:
    body, mirrors, _, morph, _, _ = case
    for plane in mirrors:
        image = unfold(morph.mesh, keep=[plane])
        mesh = image.mesh
        assert mesh.mirrors == (plane,)
        assert boundary(mesh) == named(mesh)
        assert mesh.volume() == pytest.approx(2 ** (len(mirrors) - 1) * morph.mesh.volume(), rel=1e-12)
        np.testing.assert_allclose(image.vectors(morph.mesh.points), mesh.points, atol=1e-15)
        whole = unfold(mesh).mesh
        for chamber in body.chambers:
            where = whole.points[whole.faces[f"chamber {chamber.name}"]].mean(axis=(0, 1))
            np.testing.assert_allclose(where[:2], chamber.net.mean(axis=(0, 1))[:2], atol=0.3)


def test_the_morph_is_affine_and_keeps_the_plane(case) -> None:
    _, mirrors, _, morph, space, phi = case
    rng = np.random.default_rng(1)
    d, e = 0.05 * rng.normal(size=(2, space.n))
    P, dP, eP = space.control_points(phi), space.L @ d, space.L @ e
    dP, eP = dP.reshape(-1, 3), eP.reshape(-1, 3)
    moved = morph.positions(P + 2 * dP - 3 * eP)
    np.testing.assert_allclose(moved, morph.positions(P) + 2 * morph.push(dP) - 3 * morph.push(eP), atol=1e-11)
    for plane in mirrors:
        assert (moved[morph.mesh.mirror_nodes(plane), NORMALS[plane]] == 0).all()
    np.testing.assert_allclose(morph.positions(P)[: morph.n_surface], morph.B @ P, atol=1e-10)
    assert needs_remesh(morph, P) is None


def test_its_pullback_is_the_transpose(case) -> None:
    _, _, _, morph, space, _ = case
    check_pullback(morph, space.reference.n_points)


def ring(radii: np.ndarray) -> np.ndarray:
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return radii[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def loops(*polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and edges, the first polygon anticlockwise, the others, holes, clockwise."""
    first = np.cumsum([0, *(len(polygon) for polygon in polygons)])
    edges = [
        np.column_stack([start + np.arange(len(p)), start + (np.arange(len(p)) + 1) % len(p)])
        for start, p in zip(first, polygons, strict=False)
    ]
    return np.concatenate(polygons), np.concatenate([edges[0], *(edge[:, ::-1] for edge in edges[1:])])


@settings(max_examples=40)
@given(
    st.lists(st.floats(6, 9), min_size=9, max_size=30),
    st.lists(st.floats(2, 5), min_size=5, max_size=20),
    st.floats(1, 4),
)
def test_triangles_fill_the_plane_between_polygons(outer, inner, size) -> None:
    points, edges = loops(ring(np.array(outer)), ring(np.array(inner)))
    inside, triangles = triangulate(points, edges, points[edges].mean(axis=1), size)
    corners = np.concatenate([points, inside])[triangles]
    sides = corners[:, 1:] - corners[:, :1]
    areas = (sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]) / 2
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(0.5 * np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), rel=1e-10)
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert set(map(tuple, edges.tolist())) <= set(map(tuple, directed.tolist()))


def test_profiles_that_cross_are_refused() -> None:
    points, edges = loops(ring(np.full(12, 6.0)), ring(np.full(12, 2.0)) + np.array([5.0, 0.0]))
    with pytest.raises(MeshError, match="cross in a plane"):
        triangulate(points, edges, points[edges].mean(axis=1), 2.0)
