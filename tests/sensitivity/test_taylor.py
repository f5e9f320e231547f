"""Taylor tests of functions that are smooth only near by, as where surfaces begin to touch."""

import numpy as np
import pytest

from pneumorph.sensitivity import taylor_test, taylor_test_nearby

AT, WAY, STEP = np.zeros(1), np.ones(1), 0.05


def touching(x):
    """Beyond 0.01 something is touched."""
    return float(3.0 * x[0] + x[0] ** 2 + 1e3 * max(0.0, x[0] - 0.01) ** 3)


def test_the_order_shows_near_by():
    assert not taylor_test(touching, AT, np.array([3.0]), WAY, STEP).passed
    found = taylor_test_nearby(touching, AT, np.array([3.0]), WAY, STEP)
    assert found.passed
    assert found.rate == pytest.approx(2.0, abs=1e-6)


def test_a_wrong_gradient_is_found_at_any_step():
    assert not taylor_test_nearby(touching, AT, np.array([3.01]), WAY, STEP).passed
