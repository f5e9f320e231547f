"""Robust designs: perturbed castings are found anew, go along to new meshes, and are stored with the run."""

import numpy as np
import pytest
from designing import BRIEFLY, accepted
from texts import problem_text

from pneumorph.optimize import design
from pneumorph.optimize.settings import LoopSettings
from pneumorph.problem import loads
from pneumorph.results import HistoryEntry, from_json, to_json

REST = """
[[task]]
name = "extend"
pressure = { A = "60 kPa" }
objective = { kind = "motion", extension = "1.5 mm" }
[robust]
wall = "0.05 mm"
[limits]
envelope = { radius = "12 mm" }
[mesh]
size = "5 mm"
[optimizer]
iterations = ITERATIONS
"""
BODY = 'control_density = "0.4 /mm"\nripple = { amplitude = "0.4 mm", period = "10 mm" }'
FILE = problem_text(REST, 40, chambers=(("A", 5, "0 mm", "0 mm"),), body=BODY)


def problem(iterations):
    return loads(FILE.replace("ITERATIONS", str(iterations)))


@pytest.fixture(scope="module")
def three():
    """Three designs, with castings found anew after the second."""
    return accepted(design(problem(3), settings=LoopSettings(castings=2)))


def test_designs_become_more_certain(three):
    """The objective is the mean error squared and the spread squared of the castings that are told."""
    for event in three:
        one, other = (each.translation[2] for each in event.entry.castings.values())
        mean, spread = (one + other) / 2, (one - other) / 2
        assert event.entry.objective == pytest.approx(0.01 * ((mean - 1.5) ** 2 + spread**2), rel=1e-4)
    assert three[-1].entry.objective < three[0].entry.objective


def test_a_stopped_run_goes_on_with_its_castings(three):
    (again,) = accepted(design(problem(2), three[1].state, BRIEFLY))[-1:]
    assert again.entry.objective == pytest.approx(three[2].entry.objective, rel=1e-6)
    for name, result in three[2].entry.castings.items():
        np.testing.assert_allclose(again.entry.castings[name].translation, result.translation, atol=1e-6)


def test_castings_are_stored_with_the_history(three):
    entry = three[1].entry
    assert from_json(HistoryEntry, to_json(entry)).castings == entry.castings
    assert set(entry.castings) == {"extend, casting 1", "extend, casting 2"}
