"""Closest points of surfaces by expansions at their samples, against points tried all around."""

import numpy as np
import pytest
from texts import problem_text

from pneumorph.geometry.tube.start import starting_body
from pneumorph.limits.tube.measures import expansion
from pneumorph.limits.tube.measures.distances import sampled_surface
from pneumorph.limits.tube.measures.grid import SampledFields
from pneumorph.limits.tube.samples import sample_limits
from pneumorph.problem import loads

REST = '[[task]]\nname = "t"\npressure = { A = "10 kPa" }\nobjective = { kind = "maximize", motion = "extension" }\n'


def sampled(twist=0.0):
    """Exterior and chamber of a wavy tube, sampled, twisted by some rad/mm; the chamber with its end discs."""
    problem = loads(problem_text(REST, 30, body='control_density = "0.4 /mm"'))
    body = starting_body(problem.tubes)
    limits = sample_limits(body, problem.limits)
    x, y, z = (body.control_points() * (1.0 + 0.1 * np.cos(body.control_points()[:, 2:] / 3.0) * [1.0, 1.0, 0.0])).T
    turned = np.exp(1j * twist * z) * (x + 1j * y)
    wavy = body.with_control_points(np.column_stack([turned.real, turned.imag, z]))
    orders = ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0))
    return [
        sampled_surface(SampledFields(*grid.combine(surface.net, grid.local_r, orders)), grid, discs=grid.cavity)
        for surface, grid in zip(wavy.surfaces, limits.coarse, strict=True)
    ]


@pytest.fixture(scope="module")
def surfaces():
    """Those without a twist."""
    return sampled()


def test_closest_points_are_closer_than_those_around(surfaces):
    _, chamber = surfaces
    rng = np.random.default_rng(0)
    near = rng.integers(0, len(chamber.x), 200)
    points = chamber.x[near] + rng.normal(size=(200, 3))
    distance, closest, offset = chamber.closest(points, near)
    np.testing.assert_allclose(np.linalg.norm(closest - points, axis=1), distance, rtol=1e-12)
    np.testing.assert_allclose(chamber.positions(near, offset), closest)
    row = near // chamber.columns
    for a in np.linspace(-0.75, 0.75, 7):
        for b in np.linspace(-0.75, 0.75, 7):
            room = np.where(b < 0.0, chamber.behind[row], chamber.ahead[row])
            there = chamber.positions(near, np.stack([np.full(200, a * chamber.across), b * room], axis=1))
            # Newton's method stops after four steps, and ends near a saddle for few points far from their samples.
            worse = distance > np.linalg.norm(there - points, axis=1) + 0.02
            assert np.count_nonzero(worse) <= 4


def test_the_closest_point_of_a_rim_is_between_its_samples():
    """Of points beyond the rim of a disc: the twisted lines of the tube beside it must not draw them aside."""
    _, chamber = sampled(twist=0.25)
    near = chamber.rings[0] * chamber.columns + np.arange(chamber.columns)
    for part in (-0.4, -0.2, 0.1, 0.3):
        offset = np.stack([np.full(len(near), part * chamber.across), np.zeros(len(near))], axis=1)
        rim = chamber.positions(near, offset)
        outward = rim * [1.0, 1.0, 0.0] / np.linalg.norm(rim[:, :2], axis=1, keepdims=True)
        distance, _, found = chamber.closest(rim + outward + [0.0, 0.0, -1.0], near)
        np.testing.assert_allclose(distance, np.sqrt(2.0), atol=2e-3)
        np.testing.assert_allclose(found, offset, atol=0.1 * chamber.across)


def test_closest_pairs_around_samples_are_the_closest_of_those_tried(surfaces):
    exterior, chamber = surfaces
    some = np.arange(0, len(exterior.x), 7)
    near = np.array([np.argmin(np.linalg.norm(chamber.x - x, axis=1)) for x in exterior.x[some]])
    before, _, offset = chamber.closest(exterior.x[some], near)
    aside, there = np.zeros((len(some), 2)), offset.copy()
    around = np.array([-0.5, 0.0, 0.5])
    one, other = ((tuple(side.fields), side.columns, side.steps) for side in surfaces)
    expansion.closest_around(some, near, one, other, around, 9, aside, there)
    found = np.linalg.norm(exterior.positions(some, aside) - chamber.positions(near, there), axis=1)
    assert (found <= before + 1e-9).all()
    assert (found < before - 1e-6).any()
    row = some // exterior.columns
    for a in around:
        for b in around:
            room = np.where(b < 0.0, exterior.behind[row], exterior.ahead[row])
            tried = np.stack([np.full(len(some), a * exterior.across), b * room], axis=1)
            away, _, _ = chamber.closest(exterior.positions(some, tried), near)
            assert (found <= away + 1e-8).all()
    # Nor does another pair that is as near to each other's points come closer, between the places that were tried.
    back, _, _ = exterior.closest(chamber.positions(near, there), some)
    assert (found <= back + 2e-3).all()
