import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.geometry.regions import Cylinder, HalfSpace, box

TILTED = np.array([1.0, 2.0, 2.0]) / 3.0
REGIONS = {
    "half-space": HalfSpace(tuple(TILTED), 2.0),
    "cylinder": Cylinder(3.0, (1.0, 0.0, 0.0), tuple(TILTED)),
    "box": box((-1.0, -2.0, -np.inf), (1.0, 2.0, 5.0)),
}


@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)
def test_outward_is_the_derivative_of_the_distance(region):
    x = np.random.default_rng(0).normal(size=(50, 3), scale=4.0)
    slope = jax.vmap(jax.grad(region.beyond))(jnp.asarray(x))
    assert np.allclose(region.outward(x), slope, atol=1e-12)
    assert np.allclose(np.linalg.norm(region.outward(x), axis=1), 1.0)


@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)
@given(seed=st.integers(0, 1000), share=st.floats(0.0, 1.0))
def test_the_distance_is_convex(region, seed, share):
    a, b = np.random.default_rng(seed).normal(size=(2, 3), scale=5.0)
    between = region.beyond(share * a + (1.0 - share) * b)
    assert between <= share * region.beyond(a) + (1.0 - share) * region.beyond(b) + 1e-12


def test_distances_of_known_points():
    assert REGIONS["half-space"].beyond(3.0 * TILTED) == pytest.approx(1.0)
    assert Cylinder(2.0).beyond(np.array([3.0, 4.0, 9.0])) == pytest.approx(3.0)
    assert REGIONS["box"].beyond(np.array([[0.0, 0.0, -90.0], [0.0, 2.5, 0.0], [0.0, 0.0, 4.5]])).tolist() == [
        -1,
        0.5,
        -0.5,
    ]
    assert np.isfinite(Cylinder(2.0).outward(np.zeros((1, 3)))).all()
