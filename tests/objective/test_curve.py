"""Target curves: arc length, directions and orientations without twist."""

import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline
from scipy.spatial.transform import Rotation

from pneumorph.objective.curve import section_targets, smallest_turns

FRACTIONS = (np.arange(10) + 0.5) / 10


def clamped(curve, count):
    """Control points of a clamped cubic on uniform knots through points of a curve on [0, 1]."""
    t = np.linspace(0.0, 1.0, count)
    knots = np.r_[[0.0] * 4, np.linspace(0.0, 1.0, count - 2)[1:-1], [1.0] * 4]
    return make_interp_spline(t, curve(t), k=3, t=knots).c


def spline(points, degree):
    inner = np.linspace(0.0, 1.0, len(points) - degree + 1)
    return BSpline(np.r_[[0.0] * degree, inner, [1.0] * degree], points, degree)


def test_a_circular_arc():
    radius, angle = 50.0, 2.0

    def arc(t):
        return radius * np.column_stack([1 - np.cos(angle * t), 0 * t, np.sin(angle * t)])

    position, rotation = section_targets(clamped(arc, 60), 3, FRACTIONS)
    np.testing.assert_allclose(position, arc(FRACTIONS), atol=1e-4)
    wanted = Rotation.from_rotvec(np.outer(angle * FRACTIONS, [0.0, 1.0, 0.0])).as_matrix()
    np.testing.assert_allclose(rotation, wanted, atol=2e-4)
    relative = rotation[:-1].transpose(0, 2, 1) @ rotation[1:]
    np.testing.assert_allclose(Rotation.from_matrix(relative).magnitude(), angle / 10, atol=2e-4)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_a_straight_line_in_unequal_steps(degree):
    direction = np.array([0.3, -0.4, 1.0]) / np.linalg.norm([0.3, -0.4, 1.0])
    points = np.array([5.0, 1.0, -2.0]) + np.outer([0.0, 5.0, 20.0, 22.0, 60.0, 80.0], direction)
    position, rotation = section_targets(points, degree, FRACTIONS)
    np.testing.assert_allclose(position, np.outer(80 * FRACTIONS, direction), atol=1e-3)
    np.testing.assert_allclose(rotation, np.broadcast_to(rotation[0], rotation.shape), atol=1e-12)
    np.testing.assert_allclose(rotation[0] @ [0.0, 0.0, 1.0], direction, atol=1e-12)


def test_corners_of_a_polyline_turn_by_their_angle():
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 10.0], [10.0, 0.0, 10.0], [10.0, 10.0, 10.0]])
    position, rotation = section_targets(points, 1, np.array([0.25, 0.5, 0.75]))
    np.testing.assert_allclose(position, [[0, 0, 7.5], [5, 0, 10], [10, 2.5, 10]], atol=0.01)
    np.testing.assert_allclose(rotation[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation[1], Rotation.from_euler("y", 90, degrees=True).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rotation[2][:, 2], [0.0, 1.0, 0.0], atol=1e-12)


SPATIAL = np.array([[0, 0, 0], [0, 0, 30], [25, 10, 50], [30, 40, 60], [0, 60, 90], [-10, 40, 120]], float)


def test_a_space_curve():
    position, rotation = section_targets(SPATIAL, 3, FRACTIONS)
    curve = spline(SPATIAL, 3)
    t = np.linspace(0.0, 1.0, 40001)
    speed = np.linalg.norm(curve(t, 1), axis=1)
    length = np.r_[0.0, np.cumsum((speed[1:] + speed[:-1]) / 2) * (t[1] - t[0])]
    at = np.interp(FRACTIONS * length[-1], length, t)
    np.testing.assert_allclose(position, curve(at), atol=1e-3)
    np.testing.assert_allclose(rotation @ [0.0, 0.0, 1.0], curve(at, 1) / np.linalg.norm(curve(at, 1), axis=1)[:, None],
                               atol=1e-4)  # fmt: skip
    np.testing.assert_allclose(
        rotation.transpose(0, 2, 1) @ rotation, np.broadcast_to(np.eye(3), (10, 3, 3)), atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-9)


def test_the_frame_does_not_spin_about_the_curve():
    # Neighbours that are close differ by a turn about an axis across the curve, to second order in their distance.
    _, rotation = section_targets(SPATIAL, 3, np.linspace(0.0, 1.0, 401))
    turn = Rotation.from_matrix(rotation[:-1].transpose(0, 2, 1) @ rotation[1:]).as_rotvec()
    assert np.abs(turn[:, 2]).max() < 2e-3 * np.abs(turn[:, :2]).max()
    assert abs(turn[:, 2].sum()) < 1e-3


def test_a_curve_in_a_plane_does_not_twist():
    flat = SPATIAL * [1.0, 0.0, 1.0]
    _, rotation = section_targets(flat, 3, FRACTIONS)
    np.testing.assert_allclose(rotation[:, 1], np.broadcast_to([0.0, 1.0, 0.0], (10, 3)), atol=1e-12)


def test_the_smallest_turns():
    a, b = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0], [0.6, 0.0, 0.8]])
    R = smallest_turns(a, b)
    np.testing.assert_allclose(np.einsum("mij,mj->mi", R, a), b, atol=1e-15)
    angle = np.arccos([[0.0], [0.8]]) / [[1.0], [0.6]]
    np.testing.assert_allclose(Rotation.from_matrix(R).as_rotvec(), angle * np.cross(a, b), atol=1e-12)
