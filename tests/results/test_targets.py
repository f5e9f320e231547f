"""Whether targets are reached, by the distances that are left."""

import pytest

from pneumorph.results.targets import Reached, reached


@pytest.mark.parametrize(
    ("left", "at_start", "found"),
    [
        ({"orientation_rad": 0.004}, {"orientation_rad": 1.0}, Reached.YES),
        ({"orientation_rad": 0.02}, {"orientation_rad": 1.0}, Reached.NEARLY),
        ({"orientation_rad": 0.1}, {"orientation_rad": 1.0}, Reached.NO),
        # What started at its target need not come nearer to it.
        ({"position_mm": 0.04}, {"position_mm": 0.03}, Reached.YES),
        # All of several distances count.
        ({"position_mm": 0.01, "orientation_rad": 0.1}, {"position_mm": 20.0, "orientation_rad": 1.0}, Reached.NO),
        ({"force_N": 1.0}, {"force_N": 5.0}, Reached.NO),
    ],
)
def test_how_near_a_task_is_to_its_target(left, at_start, found):
    assert reached(left, at_start) is found
