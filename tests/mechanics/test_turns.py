"""The closed form of a rotation's derivatives beside those by jax."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.mechanics import rotation
from pneumorph.mechanics.elements.turns import turns


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.5, 1.0 - 1e-12, 1.0, 2.0, 3.1, 7.0])
def test_it_is_what_jax_differentiates(angle):
    theta = angle * np.array([2.0, -1.0, 2.0]) / 3.0
    first = jax.jacfwd(rotation)
    expected = rotation(jnp.array(theta)) - jnp.eye(3), first(theta), jax.jacfwd(first)(theta)
    for found, other in zip(turns(theta), expected, strict=True):
        assert found == pytest.approx(np.asarray(other), abs=1e-13)


@pytest.mark.parametrize("square", [1e-5, 0.01, 0.9999999, 1.0000001, 30.0])
def test_the_derivatives_are_those_of_the_rotation(square):
    theta, along = np.sqrt(square) * np.array([0.6, 0.0, -0.8]), np.array([0.3, -0.5, 0.7])
    step = 1e-5
    (ahead, slope_ahead, _), (behind, slope_behind, _) = turns(theta + step * along), turns(theta - step * along)
    _, first, second = turns(theta)
    assert first @ along == pytest.approx((ahead - behind) / (2 * step), abs=1e-9)
    assert second @ along == pytest.approx((slope_ahead - slope_behind) / (2 * step), abs=1e-9)
