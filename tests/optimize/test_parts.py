"""The parts of the sub-problem: smoothing, scale of the proxy, DFP, prices of the limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.constraint import limits_of
from pneumorph.geometry.body import starting_body
from pneumorph.geometry.design_space import design_space
from pneumorph.optimize.augmented import augmented_lagrangian
from pneumorph.optimize.curvature import no_curvature, unpack_curvature
from pneumorph.optimize.dfp import FIRST_ITERATIONS, PaperStepper, minimise_dfp
from pneumorph.optimize.smoothing import smoothing
from pneumorph.optimize.step import Step, proxy_scale
from pneumorph.problem import loads
from pneumorph.sensitivity import taylor_test

FILE = """
[material]
name = "Hei-Cast 8400"
[body]
length = "30 mm"
radius = "8 mm"
control_density = "0.4 /mm"
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["0 mm", "0 mm"]
span = ["3 mm", "27 mm"]
[[task]]
name = "extend"
pressure = { A = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { kind = "maximize", motion = "extension" }
[limits]
envelope = { radius = "12 mm" }
"""


@pytest.fixture(scope="module")
def stage():
    problem = loads(FILE)
    body = starting_body(problem.body)
    space = design_space(problem, body)
    return problem, body, space, smoothing(space)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_smoothing_keeps_the_box_and_has_its_transpose(stage, seed):
    _, _, space, smooth = stage
    rng = np.random.default_rng(seed)
    z, g = rng.uniform(-1, 1, space.n), rng.standard_normal(space.n)
    assert np.abs(smooth.apply(z)).max() <= np.abs(z).max() + 1e-12
    assert smooth.apply(z) @ g == pytest.approx(z @ smooth.transpose(g))


def test_smoothing_damps_waves_of_one_span_and_spares_long_ones(stage):
    _, body, space, smooth = stage
    net = body.exterior.net.shape
    for count, low, high in ((1, 0.9, 1.0), (net[1] // 2, 0.0, 0.5)):
        wave = np.zeros((len(body.control_points()), 3))
        around = np.cos(2 * np.pi * count * np.arange(net[1]) / net[1])
        wave[body.slices[0], 0] = np.broadcast_to(around, net[:2]).ravel()
        z = np.concatenate([space.L.T @ wave.ravel(), [0.0]])
        kept = np.linalg.norm(smooth.apply(z)) / np.linalg.norm(z)
        assert low <= kept <= high


def test_the_proxy_has_no_units():
    slope = np.array([3.0, -1.0, 0.5])
    for factor in (1e-6, 1.0, 1e6):
        assert np.allclose(proxy_scale(factor * slope, 0.2) * factor * slope, proxy_scale(slope, 0.2) * slope)
    assert proxy_scale(slope, 0.2) * np.abs(slope).sum() * 0.2 == pytest.approx(1.0)


def test_ratio_is_one_where_the_objective_is_as_the_proxy_says():
    step = Step(np.array([1.0, -2.0]), scale=0.5, expected=-4.0, gain=3.0, evaluations=1, learnt=None)
    assert step.ratio(10.0, 6.0) == pytest.approx(1.0)
    assert step.ratio(10.0, 10.0) == pytest.approx(1 - 0.5 * 4 / 3)


def test_curvature_is_what_the_steps_have_seen_and_never_more():
    rng = np.random.default_rng(3)
    root = rng.standard_normal((8, 8))
    hessian = root @ root.T
    seen = no_curvature(8)
    for _ in range(4):
        phi = rng.standard_normal(8)
        seen = seen.seen(phi, hessian @ phi)
    W = seen.factors()
    for step in seen.steps:
        assert step @ W.T @ W @ step == pytest.approx(step @ hessian @ step)
    assert np.linalg.eigvalsh(hessian - W.T @ W).min() > -1e-8
    assert unpack_curvature(seen.pack()).factors() == pytest.approx(W)


def test_negative_curvature_is_left_out():
    seen = no_curvature(3).seen(np.zeros(3), np.zeros(3)).seen(np.ones(3), -np.ones(3))
    assert seen.factors().shape == (0, 3)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 100))
def test_dfp_solves_a_quadratic(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((6, 6))
    A, b = root @ root.T + np.eye(6), rng.standard_normal(6)
    x = minimise_dfp(lambda x: (0.5 * x @ A @ x - b @ x, A @ x - b), np.zeros(6), 200)
    assert np.abs(x - np.linalg.solve(A, b)).max() < 1e-4


@pytest.mark.parametrize("paper", [False, True])
def test_a_step_gains_and_stays_in_the_trust_region(stage, paper):
    problem, body, space, smooth = stage
    limits = limits_of(body, problem.limits, reach=1.0)
    stepper = augmented_lagrangian(space, smooth, limits, 0.2)
    if paper:
        stepper = PaperStepper(space, limits, 0.2, FIRST_ITERATIONS, np.zeros(0))
    outward = body.control_points() * np.array([1.0, 1.0, 0.0])
    slope = -space.pullback(outward, {"extend": {"A": 1.0}})
    step = stepper.step(space.start, slope, 0.2)
    assert step.gain > 0
    # The paper's trust region is a penalty that may be passed by some ε_t = 0.05 mm.
    assert np.abs(step.change).max() <= (0.3 if paper else 0.2 + 1e-9)
    assert slope @ step.change < 0
    assert space.lower[-1] <= (space.start + step.change)[-1] <= space.upper[-1]
    learnt = stepper.after(step)
    again = stepper.unpack(learnt.pack())
    assert {k: np.sum(v) for k, v in again.pack().items()} == {k: np.sum(v) for k, v in learnt.pack().items()}


def test_prices_have_right_gradients(stage):
    from pneumorph.optimize.augmented import STIFFNESS, _price

    problem, body, space, _ = stage
    limits = limits_of(body, problem.limits, reach=1.0)
    rng = np.random.default_rng(0)
    points = body.control_points() + 0.15 * rng.standard_normal((space.L.shape[0] // 3, 3))
    pairs = limits.pairs(points)
    prices = augmented_lagrangian(space, smoothing(space), limits, 0.2).multipliers
    prices = {name: rng.uniform(0, 5, len(value)) for name, value in prices.items()}
    margins = dict.fromkeys(prices, 0.02)
    value, slope = _price(limits, points, pairs, prices, STIFFNESS, margins)
    assert np.isfinite(float(value))
    direction = rng.standard_normal(points.size)
    test = taylor_test(
        lambda x: float(_price(limits, x.reshape(-1, 3), pairs, prices, STIFFNESS, margins)[0]),
        points.ravel(), np.asarray(slope).ravel(), direction, step=1e-4,
    )  # fmt: skip
    assert test.rate > 1.8


def test_a_step_taken_back_teaches_where_the_objective_bends(stage):
    problem, body, space, smooth = stage
    stepper = augmented_lagrangian(space, smooth, limits_of(body, problem.limits, reach=1.0), 0.2)
    slope = np.random.default_rng(0).standard_normal(space.n)
    step = stepper.step(space.start, slope, 0.2)
    # The gradient has turned round at the end of the step: the objective's minimum lies half way along it.
    taught = stepper.taught(step, slope, -slope)
    again = taught.step(space.start, slope, 0.2)
    assert 0 < -slope @ again.change < 0.7 * -slope @ step.change
    assert again.expected > slope @ again.change
