"""Nodes that slide along surfaces: poor elements become sound, surfaces stay, and the morph stays affine."""

import numpy as np
import pytest

from pneumorph.geometry import Body
from pneumorph.mesh import Morph, between, poor, relax, scaled_jacobian, slide
from pneumorph.mesh.tets import is_cut, triangle_shape
from pneumorph.mesh.tube import mesh_body


def sheared(body: Body, angle: float) -> np.ndarray:
    """Control points of a tube whose sections are turned to and fro along it, by up to `angle` rad."""
    points = body.control_points()
    turned = points.copy()
    by = angle * np.sin(2.0 * np.pi * points[:, 2] / 20.0)
    turned[:, 0] = np.cos(by) * points[:, 0] - np.sin(by) * points[:, 1]
    turned[:, 1] = np.sin(by) * points[:, 0] + np.cos(by) * points[:, 1]
    return turned


def worst(morph: Morph, points: np.ndarray) -> float:
    return float(scaled_jacobian(morph.positions(points), morph.mesh.tets).min())


@pytest.fixture(scope="module")
def slid(tube: Body, tube_morph: Morph) -> tuple[Morph, Morph, np.ndarray]:
    """A morph whose nodes inside were moved, the same after sliding, and the control points."""
    points = sheared(tube, 1.0)
    relaxed = relax(tube_morph, points)
    return relaxed, slide(relaxed, points), points


def test_elements_become_sound_that_nodes_inside_cannot_help(slid: tuple[Morph, Morph, np.ndarray]) -> None:
    relaxed, moved, points = slid
    assert poor(relaxed, points) is not None
    assert worst(moved, points) > worst(relaxed, points) + 0.05
    assert poor(moved, points) is None


def test_nodes_stay_on_the_surface_and_at_its_edges(slid: tuple[Morph, Morph, np.ndarray]) -> None:
    relaxed, moved, points = slid
    before, after, count = relaxed.positions(points), moved.positions(points), relaxed.n_surface
    went = np.linalg.norm(after - before, axis=1)
    assert went[:count].max() > 0.1
    faces = list(relaxed.mesh.faces.values())
    shared = np.concatenate([np.intersect1d(a, b) for k, a in enumerate(faces) for b in faces[:k]])
    assert len(shared) and went[shared].max() < 1e-12
    # Where it was a fine triangulation of the surface is near.
    fine = triangle_shape(_grid(40))
    for name, face in relaxed.mesh.faces.items():
        own = np.unique(face)
        far = own[went[own] > 1e-9]
        places = np.einsum("ga,fad->fgd", fine, before[face]).reshape(-1, 3)
        for node in far[:10]:
            assert np.linalg.norm(places - after[node], axis=1).min() < 0.1, name
    assert moved.at(points).volume() == pytest.approx(relaxed.at(points).volume(), rel=2e-3)


def _grid(count: int) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    return np.column_stack([x.ravel(), y.ravel()])[(x + y).ravel() <= 1.0]


def test_the_morph_stays_affine_and_its_transpose_fits(slid: tuple[Morph, Morph, np.ndarray], tube: Body) -> None:
    _, moved, points = slid
    rng = np.random.default_rng(0)
    dP, dX = rng.standard_normal(points.shape), rng.standard_normal(moved.mesh.points.shape)
    ahead = moved.positions(points + 0.3 * dP)
    np.testing.assert_allclose(ahead, moved.positions(points) + 0.3 * moved.push(dP), atol=1e-10)
    assert np.sum(moved.push(dP) * dX) == pytest.approx(np.sum(dP * moved.pullback(dX)), rel=1e-10)
    # A motion of the whole body moves all nodes alike: rows of B are means.
    np.testing.assert_allclose(
        moved.push(np.broadcast_to([1.0, 2.0, 3.0], points.shape)),
        np.broadcast_to([1.0, 2.0, 3.0], dX.shape),
        atol=1e-9,
    )


def test_a_sound_mesh_is_left_alone(tube: Body, tube_morph: Morph) -> None:
    assert slide(tube_morph, tube.control_points()) is tube_morph


def test_parts_keep_their_cuts(tube: Body) -> None:
    morph, points = mesh_body(tube, 3.0, ("xz",)), tube.control_points()
    points[:, 2] += 1.5 * np.sin(2.0 * np.pi * points[:, 2] / 8.0) * (points[:, 2] > 1.0) * (points[:, 2] < 29.0)
    moved = slide(morph, points)
    assert moved is not morph
    went = np.abs(moved.positions(points) - morph.positions(points)).max(axis=1)
    assert worst(moved, points) > worst(morph, points)
    for name, face in morph.mesh.faces.items():
        if is_cut(name):
            on_surface = np.unique(face)[np.unique(face) < morph.n_surface]
            assert went[on_surface].max() < 1e-12
            np.testing.assert_allclose(moved.positions(points)[np.unique(face), 1], 0.0, atol=1e-9)


def test_half_of_the_way_between_two_morphs(slid: tuple[Morph, Morph, np.ndarray]) -> None:
    relaxed, moved, points = slid
    middle = between(relaxed, moved, 0.5).positions(points)
    np.testing.assert_allclose(middle, 0.5 * (relaxed.positions(points) + moved.positions(points)), atol=1e-9)
