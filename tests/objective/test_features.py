"""Features of imposed motions."""

import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.mechanics import model, rubber
from pneumorph.mechanics.plate import rotation
from pneumorph.mechanics.potential import State
from pneumorph.objective import features, maximize
from pneumorph.objective.target import MOTIONS
from pneumorph.verify.solids import tube

RUBBER = rubber(0.49, 4.80, 1.1e-9)


@pytest.mark.parametrize("theta", [[0.0, 0.0, 0.0], [1e-5, 0, 0], [0.3, -0.2, 0.9], [0, 2.9, 0]])
def test_a_free_tip_reports_its_rigid_motion(theta):
    mesh = tube(4, 8, 20, (1, 12, 4))
    built = model(mesh, RUBBER, plate=False)
    turn = np.asarray(rotation(jnp.array(theta)))
    centre, shift = np.array([0, 0, 20.0]), np.array([1.0, 2.0, -3.0])
    u = (mesh.points - centre) @ turn.T + centre + shift - mesh.points
    found = features(built, built.pad(mesh.points), State(built.pad(u), jnp.zeros(6)))
    assert np.abs(np.asarray(found.translation) - shift).max() < 1e-9
    assert np.abs(np.asarray(found.rotation) - theta).max() < 1e-9


def test_a_plate_is_read_off_beyond_a_full_turn():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = model(mesh, RUBBER)
    plate = jnp.array([1.0, 2, 3, 0, 0, 6.0])
    found = features(built, built.pad(mesh.points), State(jnp.zeros_like(built.pad(mesh.points)), plate))
    assert float(maximize("twist").value(found)) == -6.0
    assert float(maximize("-extension").value(found)) == 3.0


def test_every_motion_of_the_problem_file_has_its_objective():
    from pneumorph.problem import Maximize

    for name in MOTIONS:
        assert Maximize(motion=name).component == name
