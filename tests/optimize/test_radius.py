"""The trust region: how it changes within a search and from design to design."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.optimize.radius import TrustRegion, begin, largest, next_radius
from pneumorph.optimize.settings import RadiusSettings

SETTINGS = RadiusSettings()
RADII = st.floats(SETTINGS.smallest, SETTINGS.largest)


def after(radius, ratio, kept=1.0, long=True, trials=1, first=None, stride=1.0):
    region = TrustRegion(radius, first or radius, 0.0, trials)
    return next_radius(SETTINGS, region, ratio, kept, long, stride)


@given(RADII, st.floats(0.05, 3.0), st.floats(0.0, 1.0), st.booleans(), st.integers(1, 6))
def test_it_stays_between_its_bounds(radius, ratio, kept, long, trials):
    assert SETTINGS.smallest <= after(radius, ratio, kept, long, trials) <= SETTINGS.largest


@given(RADII, st.floats(0.05, 0.39), st.floats(0.0, 1.0), st.booleans(), st.integers(1, 6))
def test_a_poor_step_shrinks_it(radius, ratio, kept, long, trials):
    assert after(radius, ratio, kept, long, trials) == pytest.approx(max(0.5 * radius, SETTINGS.smallest))


@given(RADII, st.floats(0.71, 3.0), st.integers(2, 6))
def test_it_does_not_grow_where_a_step_was_rejected(radius, ratio, trials):
    assert after(radius, ratio, trials=trials) == radius


@pytest.mark.parametrize(
    ("ratio", "kept", "long", "becomes"),
    [
        (1.0, 1.0, True, 2.0),
        (0.6, 1.0, True, 1.0),  # neither good nor poor
        (1.0, 0.4, True, 1.0),  # the limits took more than half of the gain
        (1.0, 0.2, True, 0.5),  # and more than three quarters
        (1.0, 1.0, False, 1.0),  # a short step says nothing of a longer one
    ],
)
def test_what_makes_it_grow(ratio, kept, long, becomes):
    assert after(1.0, ratio, kept, long) == becomes


@given(RADII, st.floats(0.0, 1.0), st.booleans())
def test_a_small_region_recovers_by_doubling(radius, kept, long):
    assert after(radius, 1.0, kept, long) >= min(2.0 * radius, SETTINGS.ordinary)


def test_a_search_ends_after_six_rejections():
    region, rejections = begin(SETTINGS, 1.0, 1.0), 0
    while not region.exhausted(SETTINGS):
        region, rejections = region.after_trial().rejected(SETTINGS.shrink), rejections + 1
    assert rejections == region.trials == 6


def test_a_region_that_was_too_large_is_not_entered_again():
    smaller = begin(SETTINGS, 2.0, 1.0).too_large(SETTINGS)
    assert smaller.longer(SETTINGS).radius == smaller.radius == 1.0
    assert begin(SETTINGS, 1.0, 1.0).longer(SETTINGS).radius == 2.0


@pytest.mark.parametrize(("stride", "expected"), [(0.5, 3.0), (3.0, 3.0), (4.5, 4.5), (6.0, 6.0)])
def test_it_is_larger_where_states_are_predicted_far_at_once(stride, expected):
    assert largest(SETTINGS, stride) == begin(SETTINGS, 1.0, stride).longest == expected
    assert after(3.0, 1.0, stride=stride) == expected
    assert after(6.0, 1.0, stride=stride) == expected
