"""Features of imposed motions."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pneumorph.mechanics import build_model, neo_hookean_rubber
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.objective import maximize, measure_features
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


@pytest.mark.parametrize("theta", [[0.0, 0.0, 0.0], [1e-5, 0, 0], [0.3, -0.2, 0.9], [0, 2.9, 0]])
def test_a_free_tip_reports_its_rigid_motion(theta):
    mesh = tube(4, 8, 20, (1, 12, 4))
    built = build_model(mesh, RUBBER, plate=False)
    turn = np.asarray(rotation(jnp.array(theta)))
    centre, shift = np.array([0, 0, 20.0]), np.array([1.0, 2.0, -3.0])
    u = (mesh.points - centre) @ turn.T + centre + shift - mesh.points
    found = measure_features(built, mesh.points, State(u, np.zeros(6)))
    assert np.abs(np.asarray(found.translation) - shift).max() < 1e-9
    assert np.abs(np.asarray(found.rotation) - theta).max() < 1e-9


@pytest.mark.parametrize(("axis", "degrees"), [(1, 100.0), (1, 200.0), (0, -260.0), (2, 330.0), (2, -190.0)])
def test_a_free_tip_bends_and_twists_beyond_half_a_turn(axis, degrees):
    """Nodes are moved onto an arc of a circle, or turned in proportion to their height."""
    mesh, length, angle = tube(4, 8, 80, (1, 12, 40)), 80.0, np.radians(degrees)
    built = build_model(mesh, RUBBER, plate=False)
    x = []
    for point in mesh.points:
        part = angle * point[2] / length
        turn = Rotation.from_rotvec(part * np.eye(3)[axis]).as_matrix()
        line = np.array([0.0, 0.0, point[2]])
        if axis != 2:
            across = np.cross(np.eye(3)[axis], [0.0, 0.0, 1.0])
            line = length / angle * (np.sin(part) * np.array([0.0, 0.0, 1.0]) + (1 - np.cos(part)) * across)
        x.append(line + turn @ [point[0], point[1], 0.0])
    found = measure_features(built, mesh.points, State(np.array(x) - mesh.points, np.zeros(6)))
    expected = angle * np.eye(3)[axis]
    np.testing.assert_allclose(np.asarray(found.rotation), expected, atol=2e-3)


def test_a_plate_is_read_off_beyond_a_full_turn():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    plate = jnp.array([1.0, 2, 3, 0, 0, 6.0])  # 344°
    found = measure_features(built, mesh.points, State(np.zeros_like(mesh.points), plate))
    assert float(maximize("twist").value(found)) == -6.0
    assert float(maximize("-extension").value(found)) == 3.0
    bent = measure_features(
        built,
        mesh.points,
        State(np.zeros_like(mesh.points), plate[jnp.array([0, 1, 2, 3, 5, 4])]),
    )
    assert float(maximize("bending_y").value(bent)) == -6.0


def test_every_motion_of_the_problem_file_has_its_objective():
    from pneumorph.problem import Maximize

    for name in ("extension", "bending_x", "bending_y", "twist"):
        assert Maximize(motion=name).component == name
