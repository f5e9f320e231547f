"""Flow of air through tubes against closed forms."""

from math import pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.analysis.airflow import GAS, STANDARD_DENSITY, VISCOSITY, Tube, friction_factor, read_tube
from pneumorph.errors import ProblemError

PRESSURES = st.floats(1e-4, 2.0)


def test_slow_flow_is_that_of_hagen_and_poiseuille():
    tube = Tube(0.1, 5000.0)
    exact = pi * 0.05**4 * (0.12**2 - 0.1**2) / (16 * VISCOSITY * GAS * 5000.0)
    assert tube.flow(0.12, 0.1) == pytest.approx(exact, rel=1e-3)
    assert tube.reynolds(exact) < 10.0


@pytest.mark.parametrize("number", [5e3, 2e4, 1e5])
def test_turbulent_friction_is_that_of_blasius(number):
    assert friction_factor(number) == pytest.approx(0.316 / number**0.25, rel=0.07)


def test_laminar_friction():
    assert friction_factor(0.5) == 128.0
    assert friction_factor(1000.0) == pytest.approx(0.064, rel=1e-3)


def test_a_short_wide_tube_loses_at_its_ends_alone():
    # Bernoulli: half a dynamic pressure is lost at the entrance and one at the exit.
    tube, there = Tube(10.0, 0.01), 0.1
    drop = 1e-5
    density = (there + drop) / GAS
    assert tube.flow(there + drop, there) == pytest.approx(tube.area * sqrt(2 * drop * density / 1.5), rel=2e-3)


def test_air_is_no_faster_than_sound_at_the_exit():
    tube = Tube(4.0, 100.0)
    most = tube.flow(1.0, 0.01)
    assert tube.flow(1.0, 0.1) == pytest.approx(most, rel=1e-9)
    assert tube.flow(1.0, 0.9) < 0.7 * most


@given(PRESSURES, PRESSURES, PRESSURES)
def test_flow_goes_from_the_higher_pressure_and_grows_with_it(one, other, third):
    tube = Tube(1.0, 500.0)
    assert tube.flow(one, other) == -tube.flow(other, one)
    low, middle, high = sorted((one, other, third))
    assert tube.flow(high, low) >= (1 - 1e-9) * max(tube.flow(middle, low), tube.flow(high, middle))


def test_a_tube_in_words():
    assert read_tube("2 mm x 1 m") == Tube(2.0, 1000.0)
    assert Tube(2.0, 1000.0).flow(0.2, 0.1) / STANDARD_DENSITY * 60e-6 == pytest.approx(23.0, rel=0.02)
    for text in ("2 mm", "2 mm x 1", "2 kPa x 1 m", "0 mm x 1 m"):
        with pytest.raises(ProblemError, match="tube"):
            read_tube(text)
