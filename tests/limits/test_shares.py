import numpy as np
import pytest
from certifying import certified

from pneumorph.limits.of_shape import tube_limits
from pneumorph.limits.rows.sampled import LEAST_SHARE
from pneumorph.limits.shares import NAMES
from pneumorph.limits.table import BY_NAME
from pneumorph.limits.tube.sampled import PER_SPAN


def of(body, spec):
    return tube_limits(body, spec).shares(body)


def test_a_body_at_a_bound_uses_all_of_it_there_and_only_there(make_body, table):
    body = make_body()
    exterior, chamber = of(body, table(wall=4.0, envelope=20.0))
    # Beside the chamber, whose ends lie 3 mm from the body's: nearer than the bound.
    height = np.linspace(0.0, 24.0, len(exterior.share))
    beside = np.abs(height - 12.0) < 8.0
    np.testing.assert_allclose(exterior.share[beside], 1.0, atol=5e-4)
    assert set(exterior.limit[beside].ravel()) == {NAMES.index("wall")}
    # On the rim the chamber's corner is nearest; a point has the worst of its surroundings, half a step high.
    nearest = np.hypot(4.0, 3.0 - 0.5 * height[1])
    np.testing.assert_allclose(exterior.share[0], 4.0 / nearest, atol=2e-3)
    np.testing.assert_allclose(chamber.share[[0, -1]], 4.0 / 3.0, atol=1e-6)
    assert set(chamber.limit[0]) == {NAMES.index("planes")}
    np.testing.assert_allclose(of(body, table(wall=0.1, envelope=8.0))[0].share, 1.0, atol=1e-3)


def test_the_grid_is_that_of_the_knot_spans(make_body, table):
    body = make_body(chambers=((3.0, (2.0, 1.0), (3.0, 21.0), "pole"),))
    for surface, found in zip(body.surfaces, of(body, table()), strict=True):
        along, around = PER_SPAN[1] * surface.basis_r.spans + 1, PER_SPAN[0] * surface.basis_q.spans
        assert found.share.shape == found.limit.shape == (along, around)
        assert np.isfinite(found.share).all()


@pytest.fixture
def bulged():
    """Control points of a body whose cross-sections are scaled by their heights: poles stay poles."""

    def move(body, phase):
        points = np.array(body.control_points())
        points[:, :2] *= 1.0 + 0.12 * np.cos(0.7 * points[:, 2:] + phase)
        return points

    return move


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("ends", ["flat", "pole"])
def test_shares_are_those_of_the_certified_values(make_body, table, waved, bulged, seed, ends):
    """Where a reading has its worst point, at least its share is used, and nowhere more than the worst of all."""
    start, spec = make_body(chambers=((4.0, (0.0, 0.0), (3.0, 21.0), ends),)), table(envelope=10.0)
    body = start.with_control_points(waved(start, seed, 0.8, 0.01) if ends == "flat" else bulged(start, seed))
    found = of(body, spec)
    readings = [reading for reading in certified(body, spec).readings if reading.limit != "ends"]
    used = {reading.limit: BY_NAME[reading.limit].used(reading.attained, reading.bound) for reading in readings}
    assert max(each.share.max() for each in found) == pytest.approx(max(used.values()), rel=0.03)
    counted = 0
    for reading in readings:
        if used[reading.limit] <= LEAST_SHARE:
            continue
        counted += 1
        number = [surface.name for surface in body.surfaces].index(reading.surface)
        rows, columns = found[number].share.shape
        row, column = round(reading.r * (rows - 1)), round(reading.q * columns) % columns
        assert found[number].share[row, column] >= 0.97 * used[reading.limit], reading
    assert counted >= 2


def test_two_walls_that_touch_within_a_surface(make_body, table, waved):
    """A deep fold uses more than all of the limit on folds, on both of its walls."""
    start = make_body(radius=8.0, chambers=((3.0, (0.0, 0.0), (3.0, 21.0), "flat"),), ripple=(1.5, 4.0))
    found = of(start, table(envelope=20.0))[0]
    report = certified(start, table(envelope=20.0))
    worst = max((each for each in report.readings if each.limit != "ends"), key=lambda each: each.excess())
    used = BY_NAME[worst.limit].used(worst.attained, worst.bound)
    assert used > 1.0 and found.share.max() == pytest.approx(used, rel=0.05)
