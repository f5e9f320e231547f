"""The morph: affine, exact on the surfaces, its pullback the exact transpose; and when it should be given up."""

from dataclasses import replace

import numpy as np

from pneumorph.geometry import Body
from pneumorph.mesh import Morph, needs_remesh, scaled_jacobian


def smooth_move(body: Body, amplitude: float, seed: int = 0) -> np.ndarray:
    """A motion of all control points that varies slowly over the body, its largest component the amplitude."""
    rng = np.random.default_rng(seed)
    points = body.control_points()
    waves = sum(
        rng.normal(size=3) * np.sin(points @ (direction / 6) + rng.uniform(0, 2 * np.pi))[:, None]
        for direction in rng.normal(size=(6, 3))
    )
    return amplitude * waves / np.abs(waves).max()


def test_positions_start_at_the_mesh(tube: Body, tube_morph: Morph) -> None:
    np.testing.assert_array_equal(tube_morph.positions(tube.control_points()), tube_morph.mesh.points)


def test_positions_are_affine_and_push_is_their_slope(tube: Body, tube_morph: Morph) -> None:
    P, d, e = tube.control_points(), smooth_move(tube, 1.0), smooth_move(tube, 1.0, seed=1)
    start = tube_morph.positions(P)
    moved = tube_morph.positions(P + 2 * d - 3 * e)
    np.testing.assert_allclose(moved, start + 2 * tube_morph.push(d) - 3 * tube_morph.push(e), atol=1e-11)


def test_pullback_is_the_transpose_of_push(tube: Body, tube_morph: Morph) -> None:
    rng = np.random.default_rng(3)
    dP, dX = rng.normal(size=(tube.n_points, 3)), rng.normal(size=tube_morph.mesh.points.shape)
    there, back = np.sum(tube_morph.push(dP) * dX), np.sum(dP * tube_morph.pullback(dX))
    assert abs(there - back) < 1e-12 * np.linalg.norm(dP) * np.linalg.norm(dX)


def test_rigid_motion_is_carried_exactly(tube: Body, tube_morph: Morph) -> None:
    shift = np.array([1.0, -2.0, 3.0])
    pushed = tube_morph.push(np.tile(shift, (tube.n_points, 1)))
    np.testing.assert_allclose(pushed, np.tile(shift, (len(pushed), 1)), atol=1e-10)


def test_a_design_step_keeps_the_elements_sound(tube: Body, tube_morph: Morph) -> None:
    P = tube.control_points()
    for seed in range(3):
        moved = P + smooth_move(tube, 0.2, seed)
        assert scaled_jacobian(tube_morph.positions(moved), tube_morph.mesh.tets).min() > 0.15
        assert needs_remesh(tube_morph, moved) is None


def test_poor_elements_ask_for_a_new_mesh(tube: Body, tube_morph: Morph) -> None:
    points = tube.control_points()
    points[tube.slices[1], :2] *= 1.5
    assert "quality" in (needs_remesh(tube_morph, points) or "")


def test_grown_surfaces_ask_for_a_new_mesh(tube: Body, tube_morph: Morph) -> None:
    points = tube.control_points()
    points[:, 2] *= 2.0
    assert "grew" in (needs_remesh(tube_morph, points) or "")


def test_a_mesh_that_was_poor_when_fresh_is_not_asked_for_again(tube: Body, tube_morph: Morph) -> None:
    points = tube.control_points()
    points[tube.slices[1], :2] *= 1.5
    poor = replace(tube_morph, mesh=tube_morph.at(points))
    assert 0 < scaled_jacobian(poor.mesh.points, poor.mesh.tets).min() < 0.15
    assert needs_remesh(poor, points) is None
