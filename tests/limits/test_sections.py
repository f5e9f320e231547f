"""Limits of tubes of every kind of section: certified values against samples of the surfaces."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from sections import SECTIONS, problem

from pneumorph.geometry.tube import starting_body
from pneumorph.limits.of_shape import limits_of


@pytest.mark.parametrize("kind", SECTIONS)
def test_certified_values_are_those_of_samples(kind):
    asked = problem(kind, taper=0.9)
    body = starting_body(asked.tubes)
    found = limits_of(asked, body).certify(body)
    assert found.satisfied()
    q, r = np.arange(200) / 200, np.linspace(0.0, 1.0, 150)
    exterior, chamber = (surface.sample(q, r).reshape(-1, 3) for surface in body.surfaces)
    sampled = cKDTree(exterior).query(chamber)[0].min()
    assert sampled > 1.05 * asked.limits.wall
    assert found["wall"].value <= sampled
    assert found["wall"].attained == pytest.approx(sampled, rel=0.01)
    assert found["curvature"].value >= max(_curvature(surface, q, r) for surface in body.surfaces)
    assert found["curvature"].value < 0.3


def _curvature(surface, q, r):
    """The largest h₁ of (25), half the sum of the squared principal curvatures, 1/mm²."""
    a, b, c, d, e = (surface.sample(q, r, *order) for order in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    normal = np.cross(a, b)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)

    def form(x, y, z):
        return np.stack([np.stack([x, y], -1), np.stack([y, z], -1)], -2)

    first = form((a * a).sum(2), (a * b).sum(2), (b * b).sum(2))
    second = form((c * normal).sum(2), (d * normal).sum(2), (e * normal).sum(2))
    principal = np.linalg.eigvals(np.linalg.solve(first, second))
    return 0.5 * float((np.abs(principal) ** 2).sum(-1).max())
