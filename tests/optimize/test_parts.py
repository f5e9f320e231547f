"""The parts of the sub-problem: smoothing, scale of the proxy, DFP, multipliers of the limits."""

from pathlib import Path

import numpy as np
import pytest
from certifying import certified
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from texts import problem_text

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.limits import of_shape, report
from pneumorph.limits.of_shape import build_limit_functions, tube_limits
from pneumorph.limits.table import ROWS
from pneumorph.optimize import design
from pneumorph.optimize.dfp import PaperStepper, minimise_dfp, proxy_scale
from pneumorph.optimize.events import BroughtWithin
from pneumorph.optimize.least_motion import least_motion
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.model import Proxy, no_curvature, unpack_curvature
from pneumorph.optimize.optimality import optimality
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.optimize.states import no_states
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.within import Within, within
from pneumorph.problem import load, loads

CROWDED = Path(__file__).parent / "data" / "crowded.npz"

REST = """
[[task]]
name = "extend"
pressure = { A = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { kind = "maximize", motion = "extension" }
[limits]
envelope = { radius = "12 mm" }
"""
FILE = problem_text(REST, 30, body='control_density = "0.4 /mm"')


@pytest.fixture(scope="module")
def stage():
    problem = loads(FILE)
    body = starting_body(problem.tubes)
    space = build_design_space(problem, body)
    return problem, body, space, build_smoothing(space)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_smoothing_keeps_the_box_and_has_its_transpose(stage, seed):
    _, _, space, smooth = stage
    rng = np.random.default_rng(seed)
    z, g = rng.uniform(-1, 1, space.n), rng.standard_normal(space.n)
    assert np.abs(smooth.apply(z)).max() <= np.abs(z).max() + 1e-12
    assert smooth.apply(z) @ g == pytest.approx(z @ smooth.transpose(g))


def test_the_moduli_of_a_smoothing_are_above_it():
    problem = loads(FILE.replace("control_density", 'symmetry = { half_turn = "x", rotation = 3 }\ncontrol_density'))
    space = build_design_space(problem, starting_body(problem.tubes))
    smooth = build_smoothing(space)
    assert space.L.min() < 0
    rng = np.random.default_rng(0)
    for z in rng.standard_normal((5, space.n)):
        assert (np.abs(smooth.apply(z)) <= smooth.moduli.apply(np.abs(z)) + 1e-12).all()
        assert (np.abs(smooth.transpose(z)) <= smooth.moduli.transpose(np.abs(z)) + 1e-12).all()


SYMMETRIES = {
    "mirrors": 'mirror = ["xz", "yz"]',
    "one mirror": 'mirror = ["xz"]',
    "rotation": "rotation = 3",
    "half-turn": 'half_turn = "x"',
    "both": 'half_turn = "x", rotation = 3',
}


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_smoothing_a_part_of_a_symmetric_net_smooths_all_of_it(symmetry):
    text = FILE.replace("control_density", f"symmetry = {{ {SYMMETRIES[symmetry]} }}\ncontrol_density")
    space = build_design_space(problem := loads(text), starting_body(problem.tubes))
    smooth = build_smoothing(space)
    rng = np.random.default_rng(1)
    z = rng.standard_normal(space.n)
    assert smooth.apply(z)[: space.n_shape] == pytest.approx(smoothed(space, smooth, z), abs=1e-12)
    # Lᵀ A L is symmetric, and the transpose is made of the same parts.
    g = rng.standard_normal(space.n)
    assert smooth.apply(z) @ g == pytest.approx(z @ smooth.transpose(g), rel=1e-10, abs=1e-10)
    taken = sum(moved.shape[0] for moved, _ in smooth._parts)
    assert taken < 0.7 * space.L.shape[0] or symmetry == "half-turn"


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


def test_curvature_is_what_the_steps_have_seen_and_never_more():
    rng = np.random.default_rng(3)
    root = rng.standard_normal((8, 8))
    hessian = root @ root.T
    seen = no_curvature(8)
    for _ in range(4):
        phi = rng.standard_normal(8)
        seen = seen.with_design(phi, hessian @ phi)
    W = seen.factors()
    for step in seen.steps:
        assert step @ W.T @ W @ step == pytest.approx(step @ hessian @ step)
    assert np.linalg.eigvalsh(hessian - W.T @ W).min() > -1e-8
    assert unpack_curvature(seen.pack()).factors() == pytest.approx(W)


def test_negative_curvature_is_left_out():
    seen = no_curvature(3).with_design(np.zeros(3), np.zeros(3)).with_design(np.ones(3), -np.ones(3))
    assert seen.factors().shape == (0, 3)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 100))
def test_dfp_solves_a_quadratic(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((6, 6))
    A, b = root @ root.T + np.eye(6), rng.standard_normal(6)
    x = minimise_dfp(lambda x: (0.5 * x @ A @ x - b @ x, A @ x - b), np.zeros(6), 200)
    assert np.abs(x - np.linalg.solve(A, b)).max() < 1e-4


def test_smoothing_averages_nets_along_and_around(stage):
    _, _, space, smooth = stage
    z = np.random.default_rng(1).standard_normal(space.n)
    assert smooth.apply(z)[: space.n_shape] == pytest.approx(smoothed(space, smooth, z), abs=1e-12)


def smoothed(space, smooth, z):
    """The averages of a step of whole nets, as they are defined."""
    points = (space.L @ z[: space.n_shape]).reshape(-1, 3)
    moved, body = np.empty_like(points), space.reference
    for where, surface, average in zip(body.slices, body.surfaces, smooth.averages, strict=True):
        net = points[where].reshape(surface.net.shape)
        moved[where] = np.einsum("ij,jkc,kl->ilc", average.along, net, average.around).reshape(-1, 3)
    return (space.L.T @ moved.ravel()) / smooth.entries


@pytest.mark.parametrize("paper", [False, True])
def test_a_step_gains_and_stays_in_the_trust_region(stage, paper):
    problem, body, space, smooth = stage
    stepper = build_sequential_quadratic(space, smooth, tube_limits(body, problem.limits))
    if paper:
        every = build_limit_functions(body, problem.limits, reach=1.0)
        stepper = PaperStepper(space, every, 0.2)
    outward = body.control_points() * np.array([1.0, 1.0, 0.0])
    slope = -space.pullback(outward, {"extend": {"A": 1.0}})
    step = stepper.step(space.start, linear(slope), 0.2, no_states(space.n))
    # The paper's trust region is a penalty that may be passed by some ε_t = 0.05 mm.
    assert np.abs(step.change).max() <= (0.3 if paper else 0.2 + 1e-9)
    assert slope @ step.change < 0
    assert space.lower[-1] <= (space.start + step.change)[-1] <= space.upper[-1]
    learnt = stepper.after(step)
    again = stepper.unpack(learnt.pack())
    assert {k: np.sum(v) for k, v in again.pack().items()} == {k: np.sum(v) for k, v in learnt.pack().items()}
    if not paper:
        # Runs of earlier versions have multipliers by another name.
        earlier = stepper.unpack({"prices": learnt.multipliers})
        np.testing.assert_array_equal(earlier.multipliers, learnt.multipliers)


def linear(slope):
    return Proxy(slope, np.zeros((0, len(slope))))


def test_a_step_stops_where_the_objective_bends(stage):
    problem, body, space, smooth = stage
    stepper = build_sequential_quadratic(space, smooth, tube_limits(body, problem.limits))
    slope = np.random.default_rng(0).standard_normal(space.n)
    far = stepper.step(space.start, linear(slope), 0.2, no_states(space.n)).change
    # The gradient turns round at the end of the step: the objective's minimum lies half way along it.
    memory = no_curvature(space.n).with_pair(far, -2 * slope)
    again = stepper.step(space.start, Proxy(slope, memory.factors()), 0.2, no_states(space.n)).change
    assert 0 < -slope @ again < 0.7 * -slope @ far


def test_the_least_motion_meets_what_was_broken_and_no_more(stage):
    _, _, space, smooth = stage
    rng = np.random.default_rng(2)
    jacobian = sparse.csr_array(sparse.random_array((8, space.n), density=0.05, rng=rng))
    excess = np.array([0.3, 0.1, 0.2, -0.5, -0.4, 0.05, -0.2, 0.1])
    motion = least_motion(smooth, jacobian, excess, np.zeros(space.n), 0.0)
    left = excess + jacobian @ motion.smooth
    assert left.max() < 1e-3
    assert np.abs(left[[0, 2]]).max() < 1e-3
    assert motion.smooth == pytest.approx(smooth.apply(motion.raw))
    rough = least_motion(smooth, jacobian, excess, np.zeros(space.n), 0.02)
    assert left.max() < (excess + jacobian @ rough.smooth).max() < 0.03
    short = least_motion(smooth, jacobian, excess, np.zeros(space.n), 0.0, 0.5 * np.abs(motion.raw).max())
    assert np.abs(short.raw).max() == pytest.approx(0.5 * np.abs(motion.raw).max())
    assert left.max() < (excess + jacobian @ short.smooth).max() < excess.max()


def test_a_design_beyond_its_limits_is_brought_within(stage):
    problem, body, space, smooth = stage
    limits = tube_limits(body, problem.limits)
    points = body.control_points()
    bulge = (points * [1.0, 1.0, 0.0]) * np.exp(-(((points[:, 2] - 15.0) / 4.0) ** 2))[:, None]
    phi = space.start + np.concatenate([(space.L.T @ (0.6 * bulge).ravel()) / smooth.entries, [0.0]])
    broken = {reading.limit for reading in certified(space.body(phi), problem.limits).violated()}
    assert {"wall", "envelope"} & broken
    found = within(space, smooth, limits, phi)
    assert isinstance(found, Within)
    assert found.report.satisfied()
    assert certified(space.body(found.phi), problem.limits).satisfied()
    moved = np.abs(found.phi - phi).max()
    assert moved < 3.0
    again = within(space, smooth, limits, phi, 1.01 * moved)
    assert isinstance(again, Within) and np.abs(again.phi - phi).max() <= 1.01 * moved
    assert not isinstance(within(space, smooth, limits, phi, 0.3 * moved), Within)


@pytest.mark.parametrize(
    ("old", "new", "limit"),
    [
        ('center = ["0 mm", "0 mm"]', 'center = ["3 mm", "0 mm"]', "wall"),
        ('radius = "12 mm"', 'radius = "7.5 mm"', "envelope"),
        ('radius = "4 mm"', 'radius = "1.2 mm"', "curvature"),
    ],
)
def test_a_start_beyond_its_limits_is_brought_within_first(old, new, limit):
    first = next(design(loads(FILE.replace(old, new))))
    assert isinstance(first, BroughtWithin)
    assert len(first.violated) == 1
    assert first.violated[0].startswith(f"{limit} is")
    assert 0.1 < first.moved_mm < 2.0


def test_limits_that_cannot_be_met_together_are_told(stage):
    problem, body, space, smooth = stage
    tight = problem.limits.model_copy(update={"wall": 6.5, "curvature": 0.035})
    found = within(space, smooth, tube_limits(body, tight), space.start)
    assert not isinstance(found, Within)
    assert found.violated()


def test_a_hopeless_design_is_given_up_at_once(stage, monkeypatch):
    problem, body, space, smooth = stage
    tight = problem.limits.model_copy(update={"curvature": 1e-5})
    certificates = []
    monkeypatch.setattr(
        of_shape, "certify", lambda *given: certificates.append(report.certify(*given)) or certificates[-1]
    )
    found = within(space, smooth, tube_limits(body, tight), space.start)
    assert not isinstance(found, Within)
    assert len(certificates) == 1


def test_optimality_is_one_without_limits_near_and_zero_where_they_resist(stage):
    problem, body, space, smooth = stage
    limits = tube_limits(body, problem.limits)
    inward = space.pullback(body.control_points() * [1.0, 1.0, 0.0])
    assert optimality(space, smooth, limits, space.start, inward, no_states(space.n)) == 1.0
    # Walls exactly at their limit: an objective that wants them thinner everywhere has nothing to gain.
    thick = tube_limits(body, problem.limits.model_copy(update={"wall": 4.0, "envelope": None}))
    active = linear_limits(space, thick, space.start, 0.01, -0.01)
    price = np.where(active.rows.kind == ROWS.index("wall"), 1.0, 0.0)
    resisted = -active.jacobian.T @ price
    assert optimality(space, smooth, thick, space.start, resisted, no_states(space.n)) < 0.02
    assert optimality(space, smooth, thick, space.start, -resisted, no_states(space.n)) > 0.5


def test_bringing_steps_within_the_limits_leaves_most_of_their_gain(stage):
    """Where limits are active everywhere, as after a few steps towards a wave of the walls."""
    problem, body, space, smooth = stage
    limits = tube_limits(body, problem.limits.model_copy(update={"curvature": 0.1}))
    points = body.control_points()
    wave = np.cos(2 * np.pi * points[:, 2] / 15)[:, None] * points * np.array([1.0, 1.0, 0.0])
    slope, phi = -space.pullback(wave), space.start
    stepper, asked, gained = build_sequential_quadratic(space, smooth, limits), [], []
    for _ in range(8):
        step = stepper.step(phi, Proxy(slope, np.zeros((0, space.n))), 0.8, no_states(space.n))
        found = within(space, smooth, limits, phi + step.change)
        assert isinstance(found, Within)
        asked.append(-slope @ step.change)
        gained.append(-slope @ (found.phi - phi))
        phi, stepper = found.phi, stepper.after(step)
    # The first steps keep all of it; the last ones, which gain a tenth as much, keep between 0.4 and 0.9.
    assert sum(gained) > 0.93 * sum(asked)
    assert min(gained) > 0.0


def test_a_crowded_design_is_brought_within_all_its_limits():
    """Two chambers with poles, and walls, folds and stretch near their bounds nearly everywhere."""
    problem = load(CROWDED.with_suffix(".toml"))
    body = starting_body(problem.tubes)
    space = build_design_space(problem, body)
    phi = np.load(CROWDED)["phi"]
    found = within(space, build_smoothing(space), tube_limits(body, problem.limits), phi)
    assert isinstance(found, Within)
    assert np.abs(found.phi - phi).max() < 1.5
