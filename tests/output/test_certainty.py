"""What the summary of a run says of how sure a motion is."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tiny import tiny

from pneumorph.output.certainty import certainty, of_rubber, of_step, of_the_mesh
from pneumorph.problem import loads
from pneumorph.problem.objectives.words import Amount
from pneumorph.results import FineResult, MotionRates, SweepStep

STATE = cast(Any, SimpleNamespace(translation=(0.0, 0.0, 2.0), rotation=(0.0, 0.0, 0.5)))


@pytest.mark.parametrize(("motion", "rate"), [("twist", "+4.03°/kPa of A, -0.573°"), ("extension", "+70.3 mm/kPa")])
def test_units_stand_as_behind_motions(motion, rate):
    objective = loads(tiny().replace('motion = "extension"', f'motion = "{motion}"')).task[0].objective
    rates = MotionRates({"A": (0.0, 0.0, 7.03e4, 0.0, 0.0, 70.3)}, (0.0, 0.0, -1.0, 0.0, 0.0, -1.0))
    assert rate in next(certainty(objective, STATE, rates))


def test_of_pressures_that_are_not_given_nothing_is_said():
    objective = loads(tiny()).task[0].objective
    assert not any("changes by" in sentence for sentence in certainty(objective, STATE, MotionRates({})))


def test_what_the_rubber_alone_does_is_told_where_its_deviation_is_known():
    objective = loads(tiny()).task[0].objective
    rates = MotionRates({}, (0.0, 0.0, -8.0, 0.0, 0.0, 0.0))
    (sentence,) = of_rubber(objective, rates, 0.25)
    assert "extension ± 2 mm by the rubber alone" in sentence and "± 25 %" in sentence
    assert not list(of_rubber(objective, rates, None)) and not list(of_rubber(objective, MotionRates({}), 0.25))


def fine(**changes):
    return FineResult(0.0, {}, (0.0, 0.0, 2.25), (0.0, 0.0, 0.51), {}, **changes)


@pytest.mark.parametrize(
    ("motion", "told"), [("twist", "28.65 ± 0.57° (mesh)"), ("extension", "2.00 ± 0.25 mm (mesh)")]
)
def test_errors_of_the_mesh_stand_beside_motions_in_their_units(motion, told):
    objective = loads(tiny().replace('motion = "extension"', f'motion = "{motion}"')).task[0].objective
    (sentence,) = of_the_mesh(objective, STATE, fine())
    assert told in sentence


def test_a_target_stands_beside_a_value_with_its_error():
    assert Amount(59.871, "°", "", 60.0).with_error(Amount(61.05, "°", "")) == "59.87 ± 1.2° (mesh; target 60°)"
    assert Amount(1.5, "N", "").with_error(Amount(1.4, "N", "")) == "1.5 ± 0.1 N (mesh)"
    held = Amount(-4.0, "°", "")
    assert held.with_error(held) == str(held)


def test_a_step_without_an_estimate_says_nothing():
    step = SweepStep("extend", {"A": 0.01}, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), reaction={"axial": 3.0})
    assert of_step(step) == ""
    known = replace(step, fine_translation=(0.0, 0.0, 2.1), fine_rotation=(0.0, 0.0, 0.0), fine_reaction={"axial": 3.5})
    assert "extension 2.00 ± 0.1 mm" in of_step(known) and "axial 3 ± 0.5 N" in of_step(known)
