"""The gradient of shape matching and of several tasks by shape and pressures, under weight."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from texts import problem_text

from pneumorph.analysis import analyse, collect_task_results, design_gradient, design_slopes, discretise, predict_states
from pneumorph.errors import ComputationError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import NoEquilibrium
from pneumorph.objective import Objective
from pneumorph.problem import loads
from pneumorph.sensitivity import taylor_test

REST = """
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "curve"
weight = 0.5
pressure = { A = { start = "40 kPa", min = "0 kPa", max = "60 kPa" }, B = "10 kPa" }
[task.objective]
kind = "match_curve"
sections = 3
position_weight = 0.01
control_points = [
    ["0 mm", "0 mm", "0 mm"],
    ["0 mm", "0 mm", "8 mm"],
    ["4 mm", "2 mm", "15 mm"],
    ["9 mm", "3 mm", "22 mm"],
]
[[task]]
name = "reach"
weight = 3.0
pressure.A = { start = "5 kPa", min = "0 kPa", max = "20 kPa" }
pressure.B = { start = "50 kPa", min = "0 kPa", max = "90 kPa" }
objective = { kind = "reach", position = ["4 mm", "0 mm", "26 mm"], rotation = ["0 deg", "20 deg", "9 deg"] }
[mesh]
size = "6 mm"
"""
CHAMBERS = (("A", 2, "3.8 mm", "1 mm"), ("B", 2, "-4 mm", "0 mm"))
FILE = problem_text(REST, chambers=CHAMBERS, body='control_density = "0.3 /mm"')


@pytest.fixture(scope="module")
def case():
    problem = loads(FILE)
    space = build_design_space(problem, starting_body(problem.tubes))
    disc = discretise(problem, space.reference)
    phi = space.start + 0.1 * np.random.default_rng(0).uniform(-1, 1, space.n)
    return problem, space, disc, phi, solved(problem, space, disc, phi)


def solved(problem, space, disc, phi, near=None):
    starts = near and {name: found.state for name, found in near.equilibria.items()}
    found = analyse(problem, space, disc, phi, starts, tolerance=1e-10)
    assert not isinstance(found, NoEquilibrium), found
    return found


def test_the_gradient_by_shape_and_by_pressures(case):
    problem, space, disc, phi, at = case
    spent = disc.factorisations
    slope = design_gradient(problem, space, disc, at)
    assert disc.factorisations == spent
    assert len(space.free_pressures) == 3
    # Both a step of the shape and one of the pressures matter to both tasks.
    shape, pressures = np.zeros(space.n), np.zeros(space.n)
    shape[: space.n_shape] = np.random.default_rng(1).uniform(-1, 1, space.n_shape)
    pressures[space.n_shape :] = [0.5, -1.0, 0.7]
    for direction in (shape, pressures):
        test = taylor_test(lambda x: solved(problem, space, disc, x, at).value, phi, slope, direction, 0.1, 3)
        assert test.passed, test
    assert np.abs(slope[space.n_shape :]).min() > 1e-4


def test_the_gauss_newton_part_of_sums_of_squares(case):
    problem, space, disc, _, at = case
    slopes = design_slopes(problem, space, disc, at)
    assert np.abs(slopes.rest).max() == 0.0
    np.testing.assert_allclose(slopes.total, design_gradient(problem, space, disc, at), rtol=1e-7, atol=1e-12)
    # Three sections with angles and places; place and angles of the plate.
    assert slopes.factors.shape == (3 * 6 + 6, space.n)


def test_a_prediction_after_a_trial_is_of_the_design_it_starts_from(case):
    problem, space, disc, phi, at = case
    step = np.zeros(space.n)
    step[: space.n_shape] = 0.05 * np.sin(np.arange(space.n_shape))
    near = predict_states(space, disc, at, phi + step)
    # A trial far away leaves its own factorisation behind.
    solved(problem, space, disc, phi - 5 * step, at)
    again = predict_states(space, disc, at, phi + step)
    for name, guess in near.items():
        # The first one may be by the last factorisation on the way to the state, which is as near as its residual.
        np.testing.assert_allclose(again[name].state.u, guess.state.u, rtol=0.0, atol=1e-5)


def test_tasks_add_with_their_weights(case):
    problem, space, disc, _, at = case
    whole = design_gradient(problem, space, disc, at)
    parts = []
    for number, task in enumerate(problem.task):
        weights = [1e-12, 1e-12]
        weights[number] = 1.0
        alone = [each.model_copy(update={"weight": weight}) for each, weight in zip(problem.task, weights, strict=True)]
        parts.append(design_gradient(problem.model_copy(update={"task": tuple(alone)}), space, disc, at))
        own = [free.task == task.name for free in space.free_pressures]
        assert np.abs(parts[-1][space.n_shape :][np.logical_not(own)]).max() < 1e-9
    np.testing.assert_allclose(whole, 0.5 * parts[0] + 3.0 * parts[1], atol=1e-9 * np.abs(whole).max())
    assert at.value == pytest.approx(0.5 * at.values["curve"] + 3.0 * at.values["reach"])


def test_an_objective_without_value_or_derivative_is_an_error(case):
    problem, space, disc, phi, at = case

    def judged_by(value):
        return replace(disc, objectives=disc.objectives | {"reach": Objective(value)})

    with pytest.raises(ComputationError, match="the objective of task reach is nan here; fix its function"):
        solved(problem, space, judged_by(lambda f: jnp.log(-1.0 - f.volume["A"])), phi, at)
    root = judged_by(lambda f: jnp.linalg.norm(0.0 * f.translation))
    with pytest.raises(ComputationError, match="the objective of task reach has no derivative here"):
        design_gradient(problem, space, root, at)


def test_answers_tell_what_the_objective_is_made_of(case):
    _, _, disc, _, at = case
    found = collect_task_results(disc, at)
    curve, reach = found["curve"], found["reach"]
    assert curve.objective == pytest.approx(
        2 * 3 * curve.errors["orientation_rad"] ** 2 + 0.01 * 3 * curve.errors["position_mm"] ** 2
    )
    assert reach.objective == pytest.approx(
        2 * reach.errors["orientation_rad"] ** 2 + 0.01 * reach.errors["position_mm"] ** 2
    )
    away = np.array(reach.translation) - [4.0, 0, 26.0 - 24.0]
    assert reach.errors["position_mm"] == pytest.approx(np.linalg.norm(away))
    assert np.shape(curve.section_positions) == np.shape(curve.section_rotations) == (3, 3)
    assert curve.section_positions[2][2] == pytest.approx(20.0, abs=2.0)
    # The arm bends about y, more and more towards the tip.
    assert np.all(np.diff(np.abs(np.array(curve.section_rotations)[:, 1])) > 0)
