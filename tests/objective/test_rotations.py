"""Rotations that fit a motion: against scipy's, against finite differences, where singular values meet and vanish."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from pneumorph.objective.rotations import angle_residual, polar_rotation, rotation_logarithm


def turned(seed, values):
    """A matrix with these singular values and a random rotation: R and M = R S."""
    R, Q = Rotation.random(2, rng=seed).as_matrix()
    return R, R @ Q @ np.diag(values) @ Q.T


VALUES = [(3.0, 2.0, 0.5), (2.0, 2.0, 1.0), (2.0, 2.0, 2.0), (3.0, 1.0, 0.0), (2.0, 2.0, 0.0)]
KINDS = ["random", "round", "ball", "flat", "flat and round"]


@pytest.mark.parametrize("values", VALUES, ids=KINDS)
def test_the_polar_rotation_is_the_nearest(values):
    for seed in range(5):
        R, M = turned(seed, values)
        found = np.asarray(polar_rotation(jnp.array(M)))
        np.testing.assert_allclose(found, R, atol=1e-12)
        assert np.linalg.det(found) == pytest.approx(1.0)
        if min(values) > 0:
            np.testing.assert_allclose(found, polar(M)[0], atol=1e-12)


@pytest.mark.parametrize("values", VALUES, ids=KINDS)
def test_its_derivative_is_that_of_finite_differences(values):
    for seed in range(5):
        _, M = turned(seed, values)
        change = np.random.default_rng(seed).normal(size=(3, 3))
        _, found = jax.jvp(polar_rotation, (jnp.array(M),), (jnp.array(change),))
        h = 1e-5
        difference = (polar_rotation(jnp.array(M + h * change)) - polar_rotation(jnp.array(M - h * change))) / (2 * h)
        np.testing.assert_allclose(found, difference, atol=1e-7)
        back = jax.vjp(polar_rotation, jnp.array(M))[1](jnp.array(change))[0]
        assert float(np.sum(back * change)) == pytest.approx(float(np.sum(change * found)), rel=1e-9)


@given(st.integers(0, 10_000), st.floats(0.0, 3.1))
def test_the_logarithm_is_the_rotation_vector(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    vector = angle * axis / np.linalg.norm(axis)
    found = rotation_logarithm(jnp.array(Rotation.from_rotvec(vector).as_matrix()))
    np.testing.assert_allclose(found, vector, atol=1e-9)


def test_the_logarithm_is_smooth_at_no_rotation():
    derivative = jax.jacfwd(rotation_logarithm)(jnp.eye(3))
    assert np.isfinite(derivative).all()
    spin = np.array([[0.0, -0.3, 0.2], [0.3, 0.0, -0.1], [-0.2, 0.1, 0.0]])
    np.testing.assert_allclose(np.einsum("kij,ij->k", derivative, spin), [0.1, 0.2, 0.3], atol=1e-12)


@given(st.integers(0, 10_000), st.floats(0.0, 3.1))
def test_the_geodesic_distance_is_twice_the_squared_angle(seed, angle):
    here, other = Rotation.random(2, rng=seed)
    axis = other.as_rotvec() / np.linalg.norm(other.as_rotvec())
    there = here * Rotation.from_rotvec(angle * axis)
    found = jnp.sum(angle_residual(jnp.array(here.as_matrix()), jnp.array(there.as_matrix())) ** 2)
    assert float(found) == pytest.approx(2 * angle**2, abs=1e-8)
    assert float(
        jnp.sum(angle_residual(jnp.array(there.as_matrix()), jnp.array(here.as_matrix())) ** 2)
    ) == pytest.approx(float(found), abs=1e-8)
