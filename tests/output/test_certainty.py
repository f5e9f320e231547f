"""What the summary of a run says of how sure a motion is."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from tiny import tiny

from pneumorph.output.certainty import certainty
from pneumorph.problem import loads
from pneumorph.results import MotionRates

STATE = cast(Any, SimpleNamespace(translation=(0.0, 0.0, 2.0), rotation=(0.0, 0.0, 0.5)))


@pytest.mark.parametrize(("motion", "rate"), [("twist", "+4.03°/kPa of A, -0.573°"), ("extension", "+70.3 mm/kPa")])
def test_units_stand_as_behind_motions(motion, rate):
    objective = loads(tiny().replace('motion = "extension"', f'motion = "{motion}"')).task[0].objective
    rates = MotionRates({"A": (0.0, 0.0, 7.03e4, 0.0, 0.0, 70.3)}, (0.0, 0.0, -1.0, 0.0, 0.0, -1.0))
    assert rate in next(certainty(objective, STATE, rates))


def test_of_pressures_that_are_not_given_nothing_is_said():
    objective = loads(tiny()).task[0].objective
    assert not any("changes by" in sentence for sentence in certainty(objective, STATE, MotionRates({})))
