"""What limits on states decide of a step: their multipliers, and that steps meet them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny import tiny

from pneumorph.limits.table import BY_NAME
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.pushing import pushed
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.states import StateLimits
from pneumorph.problem import loads

PRESSURE = '{ A = { start = "40 kPa", min = "0 kPa", max = "60 kPa" } }'


def test_the_multiplier_is_that_of_the_variable_that_is_left():
    """min −6 z₀ − z₁ under 3 z₀ + z₁ ≤ 1 in |z| ≤ 1: z₁ is at its bound, −1, z₀ at 2/3, with a multiplier of 2."""
    ones = np.ones(2)
    found = pushed(
        np.array([-6.0, -1.0]), 1e-6, np.array([[3.0, 1.0]]), np.array([-1.0]), -ones, ones, 1e6, np.zeros((0, 2))
    )
    assert found.z == pytest.approx([2 / 3, -1.0], abs=1e-4)
    assert found.multiplier == pytest.approx([2.0], abs=1e-4)


def test_without_rows_each_variable_is_where_it_would_be_alone():
    slope = np.array([-3.0, 0.5, 0.0])
    found = pushed(slope, 1.0, np.zeros((0, 3)), np.zeros(0), -np.ones(3), np.ones(3), 500.0, np.zeros((0, 3)))
    assert found.z == pytest.approx([1.0, -0.5, 0.0]) and len(found.multiplier) == 0


def test_a_row_that_nothing_in_the_box_meets_gives_way():
    """z₀ ≥ 3 in |z| ≤ 1: 2 are left, and the multiplier is 10 for each."""
    found = pushed(
        np.zeros(1), 1.0, np.array([[-1.0]]), np.array([3.0]), -np.ones(1), np.ones(1), 10.0, np.zeros((0, 1))
    )
    assert found.z == pytest.approx([1.0])
    assert found.multiplier == pytest.approx([20.0])


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_solutions_meet_the_conditions_of_optimality(seed):
    rng = np.random.default_rng(seed)
    n, k = 40, 4
    slope, rows = rng.standard_normal(n), rng.standard_normal((k, n)) * 10.0 ** rng.uniform(-2, 2, (k, 1))
    excess = -rng.uniform(0.0, 0.2, k) * np.abs(rows).sum(axis=1)
    squares = rng.standard_normal((3, n))
    found = pushed(slope, 0.5, rows, excess, -np.ones(n), np.ones(n), 1e6, squares)
    assert found.bent == pytest.approx(squares @ found.z, abs=1e-6)
    along = slope + 0.5 * found.z + found.multiplier @ rows + found.bent @ squares
    assert np.abs(np.clip(found.z - along, -1.0, 1.0) - found.z).max() < 1e-9
    size = np.abs(rows).mean(axis=1)
    left = (excess + rows @ found.z) / size
    assert left.max() < 1e-2 and found.multiplier.min() >= 0.0
    assert np.abs(found.multiplier * size * left).max() < 1e-2


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_curvatures_of_any_size_are_met_exactly(seed):
    """Those of many sections differ by factors of millions, and some are nearly combinations of others."""
    rng = np.random.default_rng(seed)
    n, q = 400, 30
    squares = rng.standard_normal((q, 8)) @ rng.standard_normal((8, n)) + 1e-3 * rng.standard_normal((q, n))
    turned = np.linalg.eigh(squares @ squares.T)[1].T @ squares
    slope, rows = rng.standard_normal(n), rng.standard_normal((4, n))
    excess = -rng.uniform(0.0, 0.2, 4) * np.abs(rows).sum(axis=1)
    found = pushed(slope, 0.5, rows, excess, -np.ones(n), np.ones(n), 500.0, turned)
    size = np.abs(turned).mean(axis=1)
    assert found.bent / size == pytest.approx(turned @ found.z / size, abs=1e-6 * n)
    along = slope + 0.5 * found.z + found.multiplier @ rows + found.bent @ turned
    assert np.abs(np.clip(found.z - along / 0.5, -1.0, 1.0) - found.z).max() < 1e-6


@pytest.mark.parametrize("radius", [0.4, 0.1, 0.02])
def test_a_step_meets_a_limit_that_balances_an_objective_of_one_variable(radius):
    """Least pressure with a motion that pressure and shape both change: only a multiplier hundreds of times that of
    limits on the shape balances it. Shapes gain the motion for which pressures can fall."""
    asked = loads(tiny(pressure=PRESSURE))
    setup = build_setup(asked)
    space = setup.space
    rng = np.random.default_rng(0)
    row = np.append(-setup.smooth.transpose(rng.uniform(0.0, 0.005, space.n))[: space.n_shape], -3.0)
    states = StateLimits(np.array([-0.001]), row[None], (BY_NAME["margin"],), (1.0,))
    proxy = Proxy(np.append(np.zeros(space.n_shape), 30.0), np.zeros((0, space.n)))
    step = setup.stepper.step(space.start, proxy, radius, states).change
    assert states.worst(step) <= 0.0
    # Pressure falls by most of what the shape makes up for.
    alone = row[:-1] @ step[:-1]
    assert alone < 0.0 and step[-1] < 0.5 * alone / 3.0


@pytest.mark.parametrize("seed", range(3))
def test_a_step_near_a_target_goes_to_it_and_not_beyond(seed):
    """Residuals of sections, each moved by all variables below it: within a hundredth of the region they are zero, and
    their rows are much alike. Steps that did not know the curvature from the beginning lost thousands of times what
    there is to gain."""
    setup = build_setup(loads(tiny()))
    space, smooth, sections = setup.space, setup.smooth, 10
    rng = np.random.default_rng(seed)
    below = np.tril(np.ones((sections, sections)))[:, np.arange(space.n) * sections // space.n]
    rows = below * (1.0 + 0.3 * rng.standard_normal(space.n))
    factors = np.array([smooth.transpose(row) for row in rows])
    raw = np.array([smooth.transpose(row) for row in factors])
    residuals = -raw @ (0.003 * rng.standard_normal(space.n))
    proxy = Proxy(residuals @ factors, factors)
    states = StateLimits(np.zeros(0), np.zeros((0, space.n)), (), ())
    step = setup.stepper.step(space.start, proxy, 0.6, states).change
    assert -proxy.change(step)[0] > 0.99 * 0.5 * residuals @ residuals
