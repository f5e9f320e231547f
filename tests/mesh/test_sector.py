"""Sectors: closed by cuts that are images of each other, and a whole again when they are unfolded."""

import numpy as np
import pytest
from parts import around, check_pullback, perturbed, symmetric
from wholes import boundary, named, solid

from pneumorph.errors import MeshError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mesh import needs_remesh, scaled_jacobian, unfold
from pneumorph.mesh.tets import TRIANGLE_EDGES
from pneumorph.mesh.tube import mesh_body
from pneumorph.mesh.tube.finer import with_divided_edges
from pneumorph.mesh.tube.surface import surface_mesh
from pneumorph.problem import Problem
from pneumorph.symmetry.operations import turned
from pneumorph.symmetry.part import onwards, sector, turns_of


def problem(turns: int, radius: float, *centres: tuple[float, float], ends: str = "flat") -> Problem:
    body = {"radius": "9 mm", "ripple": {"amplitude": "0.4 mm", "period": "30 mm", "lobes": turns}}
    return symmetric({"rotation": turns}, centres, radius, 30, ends, body, motion="twist")


CASES = {
    "two": (problem(2, 4.0, (0, 0)), ["A"]),
    "three": (problem(3, 4.0, (0, 0)), ["A"]),
    "five with domes": (problem(5, 4.0, (0, 0), ends="pole"), ["A"]),
    "six": (problem(6, 4.0, (0, 0)), ["A"]),
    "three beside the axis": (problem(3, 1.5, *around(3, 4.5, 0.3)), ["A B C"]),
    "three and one between": (problem(3, 1.5, (0, 0), *around(3, 5.0, 0.3)), ["A", "B C D"]),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=list(CASES))
def case(request: pytest.FixtureRequest):
    asked, names = request.param
    space, phi = perturbed(asked)
    body, part = space.body(phi), (sector(asked.body.symmetry.rotation),)
    return body, part, names, mesh_body(body, 4.0, part), space, phi


def test_a_sector_is_closed_and_its_cuts_are_images(case) -> None:
    body, part, names, morph, _, _ = case
    mesh = morph.mesh
    assert mesh.part == part and mesh.mirrors == ()
    cuts = [*part, f"{part[0]} image"]
    tubes = {f"chamber {each}" for each in map(sorted_names, names)}
    assert {"base", "tip", "exterior", *cuts, *tubes} == {as_sorted(name) for name in mesh.faces}
    assert boundary(mesh) == named(mesh)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.04
    turns = turns_of(part)
    assert turns * mesh.volume() == pytest.approx(solid(body), rel=1e-2)
    nodes, sources = mesh.tied
    np.testing.assert_allclose(mesh.points[nodes], mesh.points[sources] @ turned(turns)[1].T, atol=1e-13)
    assert (mesh.points[mesh.axis, :2] == 0.0).all()
    assert set(nodes) | set(sources) | set(mesh.axis) == set(np.unique([*map(mesh.faces.get, cuts)]).tolist())


def sorted_names(names: str) -> str:
    return " ".join(sorted(names.split()))


def as_sorted(face: str) -> str:
    return f"chamber {sorted_names(face[8:])}" if face.startswith("chamber ") else face


def test_unfolded_it_is_whole(case) -> None:
    body, part, _, morph, _, _ = case
    image, turns = unfold(morph.mesh), turns_of(part)
    mesh = image.mesh
    assert mesh.part == () and image.copies == turns
    assert set(mesh.faces) == {"base", "tip", "exterior", *(f"chamber {chamber.name}" for chamber in body.chambers)}
    assert boundary(mesh) == named(mesh)
    assert mesh.volume() == pytest.approx(turns * morph.mesh.volume(), rel=1e-12)
    np.testing.assert_allclose(image.vectors(morph.mesh.points), mesh.points, atol=1e-13)
    for chamber in body.chambers:
        where = mesh.points[mesh.faces[f"chamber {chamber.name}"]].mean(axis=(0, 1))
        np.testing.assert_allclose(where[:2], chamber.net.mean(axis=(0, 1))[:2], atol=0.3)
    assert unfold(morph.mesh, keep=part).mesh is morph.mesh


def test_divided_surfaces_are_those_of_a_sector(case) -> None:
    body, part, _, _, _, _ = case
    P, turns = body.control_points(), turns_of(part)
    mesh = surface_mesh(body, 4.0, part=part)
    along = np.intersect1d(mesh.seam[:, 0], mesh.triangles[:, 3:])
    finer = with_divided_edges(mesh, P, np.union1d(along[::3], np.unique(mesh.triangles[:, 3:])[::31]))
    assert len(finer.seam) >= len(mesh.seam) + 2 * len(along[::3])
    first, last = (finer.B @ P)[finer.seam.T]
    np.testing.assert_allclose(first @ onwards(turns).T, last, atol=1e-9)
    edges = np.concatenate([finer.triangles[:, TRIANGLE_EDGES], finer.triangles[:, 3:, None]], axis=2).reshape(-1, 3)
    middles, count = np.unique(edges[:, 2], return_counts=True)
    assert set(middles[count == 1]) == set(np.intersect1d(finer.seam, middles))


def test_the_morph_is_affine_and_keeps_the_images(case) -> None:
    _, part, _, morph, space, phi = case
    random = np.random.default_rng(1)
    P = space.control_points(phi)
    dP, eP = ((space.L @ each).reshape(-1, 3) for each in 0.05 * random.normal(size=(2, space.n)))
    moved = morph.positions(P + 2 * dP - 3 * eP)
    np.testing.assert_allclose(moved, morph.positions(P) + 2 * morph.push(dP) - 3 * morph.push(eP), atol=1e-11)
    nodes, sources = morph.mesh.tied
    np.testing.assert_allclose(moved[nodes], moved[sources] @ turned(turns_of(part))[1].T, atol=1e-13)
    assert (moved[morph.mesh.axis, :2] == 0.0).all()
    np.testing.assert_allclose(morph.positions(P)[: morph.n_surface], morph.B @ P, atol=1e-10)
    assert needs_remesh(morph, P) is None


def test_its_pullback_is_the_transpose(case) -> None:
    _, _, _, morph, space, _ = case
    check_pullback(morph, space.reference.n_points)


def test_a_body_that_is_not_symmetric_has_no_sectors() -> None:
    asked = problem(3, 4.0, (0, 0))
    space = build_design_space(asked.with_changes({"body.symmetry": {}}), starting_body(asked.tubes))
    body = space.body(space.start + 0.1 * np.random.default_rng(0).normal(size=space.n))
    with pytest.raises(MeshError, match="not the same after a turn"):
        mesh_body(body, 4.0, (sector(3),))


def test_a_chamber_outside_of_its_sector_is_no_mesh():
    """The exterior's parameters may have turned so far that its cuts are on the other side of a chamber."""
    asked = problem(3, 1.3, *around(3, 4.5, 0.3))
    body = starting_body(asked.tubes)
    angle = np.radians(90.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    points = body.control_points()
    points[body.slices[0]] = points[body.slices[0]] @ turn.T
    with pytest.raises(MeshError, match="outside of the sector"):
        mesh_body(body.with_control_points(points), 4.0, (sector(3),))
