"""Nearest samples found through a grid of cubes, against a search tree."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from pneumorph.limits.tube.measures.nearest_samples import facing_samples, nearest_samples


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), reach=st.floats(1e-3, 30.0), spread=st.floats(0.1, 50.0))
def test_nearest_samples_are_those_of_a_tree(seed, reach, spread):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(400, 3)) * [spread, 3.0, 1.0]
    # Points far beyond all samples on every side are among them.
    points = rng.normal(size=(300, 3)) * 20.0
    distance, near = nearest_samples(points, x, reach)
    expected, index = KDTree(x).query(points, distance_upper_bound=reach)
    np.testing.assert_allclose(distance, expected, rtol=1e-12)
    within = np.isfinite(expected)
    np.testing.assert_array_equal(near[within], index[within])
    assert not near[~within].any()


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), reach=st.floats(0.5, 5.0))
def test_facing_samples_are_nearest_in_place_and_normal(seed, reach):
    rng = np.random.default_rng(seed)
    x, normals = rng.uniform(-4, 4, (400, 3)), 1.5 * rng.normal(size=(400, 3))
    points, ways = rng.uniform(-5, 5, (300, 3)), 1.5 * rng.normal(size=(300, 3))
    distance, near = facing_samples(points, ways, x, normals, reach)
    expected, index = KDTree(np.hstack([x, normals])).query(np.hstack([points, ways]), distance_upper_bound=reach)
    np.testing.assert_allclose(distance, expected, rtol=1e-12)
    within = np.isfinite(expected)
    np.testing.assert_array_equal(near[within], index[within])


def test_of_equally_near_samples_the_first_is_taken():
    x = np.array([[5.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    distance, near = nearest_samples(np.zeros((1, 3)), x, 2.0)
    assert (distance[0], near[0]) == (1.0, 1)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((2, 3), 1e6)])
def test_there_may_be_nothing_to_find(points):
    distance, near = nearest_samples(points, np.zeros((1, 3)), 1.0)
    assert np.isinf(distance).all()
    assert not near.any()
