"""Limits on the states of tasks: kept by accepted designs, and restored where the start violates them."""

from itertools import pairwise

import numpy as np
import pytest
from designing import BRIEFLY
from tiny import tiny

from pneumorph.errors import Hopeless, ProblemError
from pneumorph.limits.table import BY_NAME
from pneumorph.optimize import design
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import BegunBeyond, BegunLower, DesignAccepted, Finished
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.start import start
from pneumorph.optimize.states import AIM, LEFT, StateLimits
from pneumorph.problem import Problem, loads


def problem(valid: float, iterations: int, method: str = "sqp") -> Problem:
    table = loads(tiny(iterations=str(iterations))).model_dump(mode="json", exclude_none=True)
    table["material"]["valid_stretch"] = valid
    table["limits"]["strain"] = 1.0
    table["optimizer"]["method"] = method
    return Problem.model_validate(table)


def entries(asked: Problem, settings=BRIEFLY):
    events = list(design(asked, settings=settings))
    (end,) = [event for event in events if isinstance(event, Finished)]
    return [event.entry for event in events if isinstance(event, DesignAccepted)], end


def test_designs_keep_the_limit_and_still_gain():
    """Without the limit the fifth design is stretched to 1.193."""
    found, end = entries(problem(1.15, 5))
    assert [entry.held for entry in found] == [True] * len(found)
    for entry in found:
        strain, stretch = entry.limits["strain"], entry.tasks["extend"].max_stretch
        assert strain is not None
        assert stretch / 1.15 <= strain <= 1.0 + 1e-9
    assert all(after.objective < before.objective for before, after in pairwise(found))
    assert found[-1].limits["strain"] > 0.97
    assert end.held


def test_a_start_beyond_the_limit_is_brought_within_it():
    found, end = entries(problem(1.08, 5))
    strains = [entry.limits["strain"] for entry in found]
    assert strains[0] > 1.01 and not found[0].held
    first = next(k for k, entry in enumerate(found) if entry.held)
    assert strains[: first + 1] == sorted(strains[: first + 1], reverse=True)
    assert all(entry.held for entry in found[first:])
    assert end.held


def test_a_soft_body_keeps_away_from_ballooning():
    """Without the limit it takes five designs to where no equilibrium is found any more, at 84 % of stretch."""
    table = loads(tiny(iterations="2")).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa"}
    table["material"]["density"] = "1 g/cm^3"
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    table["limits"]["margin"] = 1.5
    found, end = entries(Problem.model_validate(table), None)
    margins = [entry.limits["margin"] for entry in found]
    assert margins[0] < 1.4 and not found[0].held
    assert all(margin >= 1.5 * (1.0 - 1e-9) for margin in margins[1:])
    assert found[-1].objective < found[1].objective
    assert end.held
    assert end.margins == {"extend": pytest.approx(margins[-1], rel=1e-6)}


def test_a_tilt_is_kept_small():
    """Without the limit the second design is tilted by 0.63°."""
    table = loads(tiny(iterations="3")).model_dump(mode="json", exclude_none=True)
    table["body"]["chamber"][0]["center"] = ["0.5 mm", "0 mm"]
    table["task"][0]["limits"] = {"motion": {"tilt": "0.3 deg", "shift": "5 mm"}}
    found, end = entries(Problem.model_validate(table))
    tilts = [entry.limits["tilt_deg"] for entry in found]
    assert all(entry.held for entry in found) and end.held
    assert 0.29 < max(tilts) <= 0.3 * (1.0 + 1e-9)
    assert all(after.objective < before.objective for before, after in pairwise(found))
    last = found[-1].tasks["extend"]
    assert tilts[-1] == pytest.approx(np.degrees(np.hypot(*last.rotation[:2])), rel=1e-6)
    assert found[-1].limits["shift_mm"] == pytest.approx(np.hypot(*last.translation[:2]), rel=1e-9)


def test_a_start_that_balloons_begins_at_a_lower_pressure():
    table = loads(tiny(iterations="1")).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa"}
    table["material"]["density"] = "1 g/cm^3"
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    table["task"][0]["pressure"]["A"] = {"start": "160 kPa", "min": "0 kPa", "max": "200 kPa"}
    # A quarter of it is solved.
    table["body"]["symmetry"] = {"mirror": ["xz", "yz"]}
    events = list(design(Problem.model_validate(table), settings=BRIEFLY))
    (lower,) = [event for event in events if isinstance(event, BegunLower)]
    start, after = [event.entry for event in events if isinstance(event, DesignAccepted)]
    began = start.tasks["extend"].pressures["A"]
    assert lower.pressures["extend"]["A"] == pytest.approx(began)
    assert 0.0 < began < 0.16
    # The range is given, but the margin decides.
    assert after.limits["margin"] > min(start.limits["margin"], 1.15) * (1.0 - 1e-9)


def test_the_steps_of_the_paper_keep_it_too():
    found, _ = entries(problem(1.105, 1, "dfp"))
    assert all(entry.held for entry in found) and len(found) > 1


def test_a_range_must_be_stated():
    with pytest.raises(ProblemError, match=r"limits\.strain.*valid_stretch"):
        loads(tiny()).with_changes({"limits.strain": 1.0})


def test_what_is_expected_of_the_next_step():
    two = (BY_NAME["strain"], BY_NAME["margin"])
    states = StateLimits(np.array([-0.1, -0.002]), np.array([[1.0, 0.0], [0.0, 1.0]]), two, (1.0, 1.5))
    assert states.values() == pytest.approx({"strain": 0.9, "margin": 1.503})
    step = np.array([0.2, 0.0])
    assert not states.violated and states.worst() == -0.002
    assert states.worst(step) == pytest.approx(0.1)
    # The step led to 0.15 instead of 0.1: half of the curvature times 0.04 mm².
    curvature = states.curvature(0.15, step)
    bent = states.bent(curvature, 0.2)
    assert bent.excess == pytest.approx([-0.1 + AIM + 0.05, LEFT + 0.05])
    assert states.bent(curvature, 0.1).excess == pytest.approx([-0.1 + AIM + 0.0125, LEFT + 0.0125])


def test_a_limit_out_of_reach_is_refused_with_its_key():
    """Rest is at 1/1.1 of the range: from 1.07 to 0.913 the last of it takes walls of any thickness."""
    asked = problem(1.1, 5).with_changes({"limits.strain": 0.9095})
    with pytest.raises(Hopeless, match=r"^limits\.strain: is [\d.]+ at the start, in task extend") as caught:
        list(design(asked))
    assert "raise it, lower task[0].pressure.A" in str(caught.value)


def test_a_limit_within_reach_says_how_far_it_is():
    setup = build_setup(problem(1.08, 5))
    found = start(setup, Clock())
    told = next(event for event in found if isinstance(event, BegunBeyond)).violated
    assert len(told) == 1 and told[0].startswith("limits.strain: is 1.")
    assert 0.05 < float(told[0].partition("move by about ")[2].partition(" mm")[0]) < 5.0
