"""Modes of surfaces: as many as the states differ in, and exact where amounts are polynomials."""

import numpy as np

from pneumorph.surrogate.modes import modes_of
from pneumorph.surrogate.states import Sample

SIZE = np.array([0.06, 0.04])


def samples(x, amounts, slopes, patterns):
    """States at scaled pressures x (n, 2) that look like a sum of patterns (k, S, 4) with amounts (n, k)."""
    looks = np.tensordot(amounts, patterns, axes=1)
    by = np.tensordot(slopes, patterns, axes=1) / (SIZE / 2)[:, None, None]
    nothing = np.zeros(2), np.zeros(6), np.zeros((6, 2)), np.eye(6)
    return [Sample(*nothing, look, each) for look, each in zip(looks, by, strict=True)]


def quadratic(x):
    """Three amounts (n, 3) that are quadratic in x (n, 2), and their slopes (n, 2, 3)."""
    a, b = x.T
    amounts = np.stack([1 + a, a * b, b**2], axis=-1)
    by_a = np.stack([np.ones_like(a), b, 0 * a], axis=-1)
    by_b = np.stack([0 * a, a, 2 * b], axis=-1)
    return amounts, np.stack([by_a, by_b], axis=1)


def test_three_patterns_are_three_modes():
    rng = np.random.default_rng(0)
    patterns, x = rng.normal(size=(3, 40, 4)), np.cos(np.pi * rng.random((12, 2)))
    found = modes_of(x, SIZE, samples(x, *quadratic(x), patterns), 1e-4)
    assert len(found.modes) == 3
    for point in rng.uniform(-1, 1, (5, 2)):
        expected = np.tensordot(quadratic(point[None])[0][0], patterns, axes=1)
        np.testing.assert_allclose(found.at(point), expected, atol=1e-8 * np.abs(patterns).max())


def test_what_is_small_has_no_mode_unless_it_is_asked_for():
    rng = np.random.default_rng(0)
    x = np.cos(np.pi * rng.random((12, 2)))
    patterns = np.array([1.0, 1.0, 1e-4])[:, None, None] * rng.normal(size=(3, 40, 4))
    every = samples(x, *quadratic(x), patterns)
    assert [len(modes_of(x, SIZE, every, tolerance).modes) for tolerance in (0.1, 1e-6)] == [2, 3]


def test_states_that_were_not_looked_at_have_none():
    assert (
        modes_of(np.zeros((1, 2)), SIZE, [Sample(np.zeros(2), np.zeros(6), np.zeros((6, 2)), np.eye(6))], 0.01) is None
    )


def test_a_body_that_does_not_move_has_no_modes():
    x = np.cos(np.pi * np.random.default_rng(0).random((6, 2)))
    found = modes_of(x, SIZE, samples(x, *quadratic(x), np.zeros((3, 10, 4))), 0.01)
    assert not len(found.modes) and not found.at(x[0]).any() and found.at(x[0]).shape == (10, 4)
