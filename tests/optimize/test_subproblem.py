"""Steps that are longer than linearised limits tell."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import tiny

from pneumorph.optimize import subproblem
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.states import no_states
from pneumorph.problem import loads

SPAN = 'span = ["3 mm", "21 mm"]'


@pytest.fixture(scope="module")
def setup():
    """A tube whose chamber ends in poles, near which control points are close and an area element soon vanishes."""
    return build_setup(loads(tiny().replace(SPAN, f'{SPAN}\nends = "pole"')))


def after_a_long_step(setup, seed):
    """The worst excess of a limit after a step of 1 mm in a random direction, and what the step gains."""
    space = setup.space
    slope = np.random.default_rng(seed).standard_normal(space.n)
    stepper = subproblem.build_sequential_quadratic(space, setup.smooth, setup.limits)
    change = stepper.step(space.start, Proxy(slope, np.zeros((0, space.n))), 1.0, no_states(space.n)).change
    return max(reading.excess() for reading in setup.certify(space.start + change).readings), -slope @ change


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_motion_to_a_cusp_is_halved(setup, seed):
    excess, _ = after_a_long_step(setup, seed)
    assert excess < 0.05


def test_without_that_programs_do_not_lead_back(setup, monkeypatch):
    _, gain = after_a_long_step(setup, 1)
    monkeypatch.setattr(subproblem, "PROGRAM", replace(subproblem.PROGRAM, hopeless=np.inf))
    excess, less = after_a_long_step(setup, 1)
    assert excess > 100.0 and less < 0.9 * gain
