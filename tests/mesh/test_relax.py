"""Moving the nodes inside: poor elements become sound, everything on surfaces stays, and the morph stays affine."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of
from pneumorph.mesh import Morph, relax, scaled_jacobian
from pneumorph.mesh.tets import is_cut
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import load
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import Part, onwards, sector, turns_of


def widened(body: Body, factor: float) -> np.ndarray:
    """Control points with a wider chamber, the walls thinner."""
    points = body.control_points()
    points[body.slices[1], :2] *= factor
    return points


@pytest.mark.parametrize("part", [(), ("xz",)])
def test_poor_elements_become_sound(tube: Body, part: tuple[str, ...]) -> None:
    morph, points = mesh_body(tube, 3.0, part), widened(tube, 1.6)
    relaxed = relax(morph, points)
    before, after = (scaled_jacobian(each.positions(points), each.mesh.tets) for each in (morph, relaxed))
    assert before.min() < 0.05 and after.min() > before.min() + 0.1
    moved = np.flatnonzero(np.abs(relaxed.positions(points) - morph.positions(points)).max(axis=1))
    assert len(moved) and moved.min() >= morph.n_surface


@pytest.mark.parametrize("part", [("xz", "yz"), (sector(3),)])
def test_nodes_in_cuts_move_and_stay_in_them(part: Part) -> None:
    body = body_of(load("examples/twisting.toml"))
    morph, points = mesh_body(body, 3.0, part), widened(body, 1.5)
    if turns_of(part) > 1:
        twist = Rotation.from_rotvec(np.outer(points[:, 2] / points[:, 2].max(), [0.0, 0.0, 1.2]))
        points = twist.apply(points)
    relaxed, mesh = relax(morph, points), morph.mesh
    places = relaxed.positions(points)
    before, after = (scaled_jacobian(each, mesh.tets).min() for each in (morph.positions(points), places))
    assert after > before + 0.05
    moved = np.flatnonzero(np.abs(relaxed.shift - morph.shift).max(axis=1))
    faces = {name: np.unique(face) for name, face in mesh.faces.items()}
    assert sum(np.isin(moved, nodes).sum() for name, nodes in faces.items() if is_cut(name)) > 5
    assert not any(np.isin(moved, nodes).any() for name, nodes in faces.items() if not is_cut(name))
    for plane in mesh.mirrors:
        assert (relaxed.shift[mesh.mirror_nodes(plane), NORMALS[plane]] == 0.0).all()
    images, sources = mesh.tied
    np.testing.assert_allclose(places[images], places[sources] @ onwards(turns_of(part)).T, atol=1e-12)
    assert (relaxed.shift[mesh.axis, :2] == 0.0).all()


def test_a_relaxed_morph_is_the_same_affine_map_but_for_a_shift(tube: Body, tube_morph: Morph) -> None:
    relaxed = relax(tube_morph, widened(tube, 1.6))
    for points in (tube.control_points(), widened(tube, 1.2)):
        apart = relaxed.positions(points) - tube_morph.positions(points)
        np.testing.assert_allclose(apart, relaxed.shift - tube_morph.shift, atol=1e-12)
    assert relaxed.mesh is tube_morph.mesh


def test_a_sound_mesh_is_left_alone(tube: Body, tube_morph: Morph) -> None:
    assert relax(tube_morph, tube.control_points()) is tube_morph


def test_no_element_becomes_worse_than_the_worst_was(tube: Body, tube_morph: Morph) -> None:
    for factor in (1.5, 1.8):
        points = widened(tube, factor)
        relaxed = relax(tube_morph, points)
        before, after = (
            scaled_jacobian(each.positions(points), each.mesh.tets).min() for each in (tube_morph, relaxed)
        )
        assert after > before


def test_rounding_does_not_decide_where_nodes_go() -> None:
    """Elements that are images of each other in a mirrored mesh are equally poor but for rounding."""
    body = body_of(load("examples/gripper.toml"))
    morph, points = mesh_body(body, 4.0), widened(body, 1.3)
    relaxed = relax(morph, points)
    assert relaxed is not morph
    for seed in range(3):
        noise = 1e-13 * np.random.default_rng(seed).normal(size=points.shape)
        np.testing.assert_allclose(relax(morph, points + noise).shift, relaxed.shift, atol=1e-9)
