"""Peaks that parabolas expect between samples, and the worst samples of cells."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.limits.rows.sampled import DIGITS
from pneumorph.limits.tube.peaks import expected_peaks, peaks_at
from pneumorph.limits.tube.samples import worst_samples

fields = st.builds(
    lambda seed, scale: np.round(scale * np.random.default_rng(seed).normal(size=(2, 17, 12)), 1),
    st.integers(0, 99),
    st.floats(0.1, 3.0),
)


@pytest.mark.parametrize(("aside", "up"), [(0.0, 0.0), (0.3, -0.4), (-0.5, 0.2)])
def test_the_peak_of_a_parabola_is_found(aside, up):
    row, column = np.arange(9)[:, None], np.arange(8)[None]
    c = (1.0 - 0.03 * (column - 4 - aside) ** 2 - 0.02 * (row - 5 - up) ** 2)[None]
    value, *at = peaks_at(c, np.array([0]), np.array([5]), np.array([4]))
    assert (value[0], at[0][0], at[1][0]) == pytest.approx((1.0, aside, up), abs=1e-6)


def test_peaks_near_the_ends_stay_within_them():
    row = np.arange(9)[:, None] + np.zeros((1, 8))
    for sign in (1.0, -1.0):
        c = (sign * (row - 4.0) - 0.1 * (row - 4.0) ** 2)[None]
        for end in (0, 8):
            value, aside, up = peaks_at(c, np.array([0]), np.array([end]), np.array([3]))
            assert 0.0 <= end + up[0] <= 8.0
            assert aside[0] == 0.0
            assert value[0] >= c[0, end, 3]


@given(fields, st.floats(-2.0, 4.0))
@settings(max_examples=50)
def test_all_peaks_above_a_value_are_found_and_no_others(c, least):
    kind, row, column = (part.ravel() for part in np.indices(c.shape))
    every = peaks_at(c, kind, row, column)[0].reshape(c.shape)
    np.testing.assert_array_equal(
        expected_peaks(c, least, np.ones(c.shape[1:], bool)), np.where(every > least, every, -np.inf)
    )


@given(fields, st.integers(0, 99), st.floats(-2.0, 2.0))
@settings(max_examples=50)
def test_worst_samples_are_the_first_largest_of_half_cells(c, seed, least):
    # Rounding errors do not decide between equal values, of which there are many here.
    rng = np.random.default_rng(seed)
    c = c[0] + 1e-13 * rng.normal(size=c[0].shape)
    own = rng.random(c.shape) < 0.7
    row, column = np.nonzero((c > least) & own)
    half = 2 * (np.minimum(row // 8, 1) * 3 + column // 4) + (row // 4) % 2
    order = np.lexsort((-np.round(c[row, column], DIGITS), half))
    pick = order[np.flatnonzero(np.diff(half[order], prepend=-1))]
    expected = row[pick], column[pick], half[pick] // 2
    for one, other in zip(worst_samples(c, own, (4, 8), (3, 2), least), expected, strict=True):
        np.testing.assert_array_equal(one, other)
