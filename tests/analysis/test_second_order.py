"""Deviations to second order, against quadratic functions; `test_scatter.py` has them with small tolerances."""

import numpy as np
import pytest

from pneumorph.analysis import second_order
from pneumorph.analysis.scatter import OneDeviation
from pneumorph.results import Cause, Scatter


def test_a_quadratic_function_has_its_deviation(monkeypatch):
    """Of three causes; of 200,000 samples the deviation is known to 0.2 %."""
    gradients = np.array(
        [[0.0, 0.0, 3.0, 0.0, 0.0, 0.0], [9.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 7.0, 0.0, 0.0, 0.0, 0.0]]
    )
    scatter = Scatter(
        (0.0, 0.0, 5.0, 0.0, 0.0, 0.0), tuple(Cause(str(k), "mm", 1.0, tuple(by)) for k, by in enumerate(gradients))
    )
    curved = np.array([0.3, -1.2, 0.8])

    def motion(change):
        return 5.0 + change @ gradients[:, 2] + np.square(change) @ curved

    def along(_whole, _task, _scatter, _motion, direction):
        return OneDeviation(motion(direction), motion(-direction))

    monkeypatch.setattr(second_order, "castings_along", along)
    own = OneDeviation(motion(np.array([1.0, 0.0, 0.0])), motion(np.array([-1.0, 0.0, 0.0])))
    found = second_order.second_order(None, "", scatter, 2, own)
    sampled = motion(np.random.default_rng(0).standard_normal((200_000, 3))).std()
    assert found == pytest.approx(np.sqrt(9.0 + 2.0 * curved @ curved)) and found == pytest.approx(sampled, rel=0.01)
    assert second_order.second_order(None, "", scatter, 2, OneDeviation(None, 2.0)) is None


def test_directions_are_orthogonal_and_leave_small_motions_out():
    by = np.random.default_rng(3).standard_normal((7, 6)) * [1.0, 1.0, 1.0, 0.1, 0.1, 1e-3]
    scatter = Scatter((0.0,) * 6, tuple(Cause(str(k), "mm", 0.5, tuple(row)) for k, row in enumerate(by)))
    own = by[:, 2] / np.linalg.norm(by[:, 2])
    found = np.array([own, *second_order.further_directions(scatter, 2)])
    assert len(found) == 3
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    alone = Scatter(
        (0.0,) * 6, tuple(Cause(each.name, "mm", 0.5, (0.0, 0.0, each.by[2], 0.0, 0.0, 0.0)) for each in scatter.causes)
    )
    assert second_order.further_directions(alone, 2) == []
