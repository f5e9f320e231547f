import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.geometry import clamped, periodic

bases = st.one_of(
    st.builds(periodic, st.integers(4, 40)),
    st.builds(clamped, st.integers(1, 40)),
)
parameters = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20)


@given(bases, parameters)
def test_functions_are_a_partition_of_unity(basis, t):
    values = basis.matrix(t)
    assert values.shape == (len(t), basis.count)
    assert np.all(values >= -1e-14)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-12)
    for order in (1, 2):
        np.testing.assert_allclose(basis.matrix(t, order).sum(axis=1), 0.0, atol=1e-9 * basis.count**order)


@given(bases, st.floats(0.02, 0.98))
def test_derivatives_agree_with_differences(basis, t):
    step = 1e-6
    if np.abs(basis.breaks - t).min() < 2 * step:
        t += 4 * step
    for order in (1, 2):
        difference = (basis.matrix([t + step], order - 1) - basis.matrix([t - step], order - 1)) / (2 * step)
        scale = float(basis.count) ** order
        np.testing.assert_allclose(basis.matrix([t], order) / scale, difference / scale, atol=1e-4)


@given(st.integers(4, 40), st.floats(-3.0, 3.0), st.integers(0, 2))
def test_periodic_functions_repeat(count, t, order):
    basis = periodic(count)
    np.testing.assert_allclose(basis.matrix([t], order), basis.matrix([t + 1.0], order), atol=1e-9 * count**order)
    # The functions are shifts of one another.
    shifted = np.roll(basis.matrix([t], order), 1, axis=1)
    np.testing.assert_allclose(basis.matrix([t + 1.0 / count], order), shifted, atol=1e-8 * count**order)


@given(st.integers(1, 40), parameters)
def test_clamped_basis_reproduces_straight_lines_and_ends(spans, t):
    basis = clamped(spans)
    np.testing.assert_allclose(basis.matrix(t) @ basis.greville, t, atol=1e-13)
    np.testing.assert_allclose(basis.matrix([0.0, 1.0])[[0, 1], [0, -1]], 1.0)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="lie in"):
        clamped(5).matrix([1.1])
    with pytest.raises(ValueError, match="at least four"):
        periodic(3)
    with pytest.raises(ValueError, match="at least one"):
        clamped(0)
