"""Meshes of which some elements are divided: the same body, whose parts fit together and follow its surfaces."""

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import part_of
from pneumorph.mesh.bisect import as_fine_as, bisected, divided_morph
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.tets import TET_FACES, TURNED, area_and_volume
from pneumorph.problem import loads

TASK = '[[task]]\nname = "move"\npressure = { A = "10 kPa" }\nobjective = { motion = "extension" }\n'
FIBRES = '[[fibres]]\nname = "wrap"\nsurfaces = ["exterior"]\nstiffness = "5 N/mm"\nwinding = "70 deg"\n'

PARTS = {
    "whole": ("", TWO_BESIDE),
    "quarter": ('symmetry = { mirror = ["xz", "yz"] }', None),
    "sector": ("symmetry = { rotation = 3 }", None),
}


@pytest.fixture(scope="module", params=list(PARTS))
def body(request):
    """A meshed body with fibres."""
    symmetry, chambers = PARTS[request.param]
    options = {} if chambers is None else {"chambers": chambers}
    text = problem_text(TASK + FIBRES, radius=10, **options)
    problem = loads(text.replace("[body]", f"[body]\n{symmetry}", 1)).with_changes({"mesh.size": "8 mm"})
    start = starting_body(problem.tubes)
    return start, mesh_of(problem, start, part_of(problem))


@pytest.fixture(scope="module")
def divided(body):
    start, morph = body
    marked = np.arange(0, len(morph.mesh.tets), 7)
    return morph, *divided_morph(morph, start.control_points(), marked)


def test_the_parts_fit_together_and_the_body_is_the_same(divided):
    morph, finer, fine = divided
    mesh, there = morph.mesh, finer.mesh
    assert len(mesh.tets) < len(there.tets) < 8 * len(mesh.tets) and there.part == mesh.part
    assert scaled_jacobian(there.points, there.tets).min() > 0.0
    assert there.volume() == pytest.approx(mesh.volume(), rel=1e-9)
    for name in mesh.faces:
        old, new = (area_and_volume(each.points, each.faces[name])[0] for each in (mesh, there))
        np.testing.assert_allclose(new, old, atol=1e-6)
    # Every face of an element is one of two elements, or one of the mesh's faces.
    inside = np.sort(there.tets[:, TET_FACES].reshape(-1, 3), axis=1)
    outside = np.sort(np.concatenate(list(there.faces.values()))[:, :3], axis=1)
    assert set(np.unique(np.concatenate([inside, outside]), axis=0, return_counts=True)[1]) == {2}
    np.testing.assert_allclose(there.points, fine.P @ mesh.points, atol=1e-9)


def test_marked_elements_are_halved_in_size(divided):
    morph, finer, fine = divided
    assert np.bincount(fine.owner)[::7].tolist() == [8] * len(range(0, len(morph.mesh.tets), 7))
    halved = finer.mesh.halved
    np.testing.assert_allclose(halved[np.isin(fine.owner, np.arange(0, len(morph.mesh.tets), 7))], 1.0)
    assert set(np.round(3.0 * halved, 9)) <= {0.0, 1.0, 2.0, 3.0}


def test_another_mesh_becomes_as_fine_at_the_same_places(body):
    """By the elements near the base, which are divided twice; also from the fields of the whole body."""
    start, morph = body
    P = start.control_points()

    def low(mesh):
        return np.flatnonzero(mesh.points[mesh.tets[:, :4], 2].mean(axis=1) < 4.0)

    once, _ = divided_morph(morph, P, low(morph.mesh))
    twice, _ = divided_morph(once, P, low(once.mesh))
    again = as_fine_as(morph, P, twice.mesh)
    assert 0.5 * len(twice.mesh.tets) < len(again.mesh.tets) < 1.5 * len(twice.mesh.tets)
    assert again.mesh.halved[low(again.mesh)].mean() > 1.2
    high = again.mesh.points[again.mesh.tets[:, :4], 2].mean(axis=1) > 16.0
    assert again.mesh.halved[high].mean() < 0.4
    assert as_fine_as(morph, P, morph.mesh) is morph


def test_what_covers_a_face_is_as_large_as_before(divided):
    morph, finer, _ = divided

    def area(mesh):
        own = mesh.covers["wrap"]
        corners = mesh.points[own.nodes[:, :3]]
        size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        return size @ own.points[..., 2].sum(axis=1)

    # Of chords, which are nearer to the surface on the finer mesh.
    assert area(finer.mesh) == pytest.approx(area(morph.mesh), rel=0.04)
    assert len(finer.mesh.covers["wrap"].nodes) > len(morph.mesh.covers["wrap"].nodes)


def test_surfaces_are_followed_as_by_the_coarser_mesh(body, divided):
    """Where control points move, the nodes of a divided face stay on it."""
    start, _ = body
    morph, finer, fine = divided
    P = start.control_points()
    moved = P * (1.0, 1.0, 1.1)
    carried, own = fine.P @ morph.positions(moved), finer.positions(moved)
    np.testing.assert_allclose(own[: finer.n_surface], carried[: finer.n_surface], atol=1e-9)
    assert np.abs(own - carried).max() < 0.3 and scaled_jacobian(own, finer.mesh.tets).min() > 0.0
    gradient = np.random.default_rng(1).standard_normal(own.shape)
    step = np.random.default_rng(2).standard_normal(P.shape)
    assert np.sum(finer.pullback(gradient) * step) == pytest.approx(np.sum(gradient * finer.push(step)), rel=1e-9)


def test_the_second_cut_of_a_sector_is_still_the_image_of_the_first(divided):
    _, finer, _ = divided
    for name in finer.mesh.part:
        if name in finer.mesh.mirrors:
            continue
        first, second = finer.mesh.faces[name][:, TURNED], finer.mesh.faces[f"{name} image"]
        one, other = finer.mesh.points[first], finer.mesh.points[second]
        np.testing.assert_allclose(np.hypot(*one[..., :2].T), np.hypot(*other[..., :2].T), atol=1e-5)
        np.testing.assert_allclose(one[..., 2], other[..., 2], atol=1e-5)


def test_linear_fields_are_carried_to_corners(body):
    _, morph = body
    fine = bisected(morph.mesh.at(morph.reference), np.arange(3))
    corners, slope = np.unique(fine.mesh.tets[:, :4]), (1.0, 2.0, 3.0)
    found = (fine.linear @ (morph.reference @ slope))[corners]
    np.testing.assert_allclose(found, fine.mesh.points[corners] @ slope, atol=1e-9)
