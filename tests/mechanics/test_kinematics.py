"""Deformation measures at quadrature points."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from pneumorph.mechanics.elements.kinematics import SQUARINGS, largest_stretch
from pneumorph.mechanics.elements.points import turn_on


def points_first(F):
    return np.moveaxis(F, (0, 1), (-2, -1))


@pytest.mark.parametrize("spread", [0.0, 1e-9, 0.3, 3.0])
def test_the_largest_stretch_is_the_largest_singular_value(spread):
    rng = np.random.default_rng(0)
    F = np.eye(3)[:, :, None, None] + spread * rng.standard_normal((3, 3, 4, 50))
    turn = Rotation.random(random_state=1).as_matrix()
    found = largest_stretch(np.einsum("ij,jk...->ik...", turn, F))
    np.testing.assert_allclose(found, np.linalg.svd(points_first(F), compute_uv=False)[..., 0], rtol=3e-8)


def test_gradients_turn_by_the_exponential_of_their_change():
    rng = np.random.default_rng(2)
    F = np.eye(3)[:, :, None, None] + 0.2 * rng.standard_normal((3, 3, 4, 5))
    dF = 0.3 * rng.standard_normal(F.shape)
    turned = F.copy()
    turn_on(turned, dF, SQUARINGS)
    before, change = points_first(F), points_first(dF)
    exact = [[expm(change[q, e] @ np.linalg.inv(before[q, e])) @ before[q, e] for e in range(5)] for q in range(4)]
    np.testing.assert_allclose(points_first(turned), exact, rtol=0.02, atol=0.02)
    # What only turns is not stretched, however far it turns.
    turning = np.einsum("ij,jk...->ik...", np.array([[0.0, -0.8, 0.2], [0.8, 0.0, 0.5], [-0.2, -0.5, 0.0]]), F)
    turned = F.copy()
    turn_on(turned, turning, SQUARINGS)
    squared = [np.einsum("ki...,kj...->ij...", each, each) for each in (turned, F)]
    np.testing.assert_allclose(*squared, atol=1e-13)
