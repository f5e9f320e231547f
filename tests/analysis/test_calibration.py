"""Parameters found from curves that were computed with them."""

from dataclasses import replace

import numpy as np
import pytest
from texts import EXTEND, TWO_BESIDE, problem_text

from pneumorph.analysis.along import Curve
from pneumorph.analysis.calibration import PARAMETERS, UNITS, _Fit, calibrate, fitted
from pneumorph.errors import Hopeless, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.calibration import as_measured
from pneumorph.problem import loads

TASK = """
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "bend"
pressure = { A = "12 kPa", B = "0 kPa" }
objective = { motion = "bending_y" }
"""
PRESSURES = np.outer(np.linspace(0.0, 0.06, 7), [1.0, 0.0])


def of(*values):
    """Parameters in the units of the code."""
    return dict(zip(PARAMETERS, values, strict=True))


@pytest.fixture(scope="module")
def body():
    text = problem_text(TASK, chambers=TWO_BESIDE, radius=10, body='symmetry = { mirror = ["xz"] }')
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    return problem, starting_body(problem.tubes)


@pytest.fixture(scope="module")
def curve(body):
    """What a body that is 15 % stiffer, has 0.2 mm more rubber and 1 kPa more pressure would show."""
    problem, start = body
    fit = _Fit.of(problem, start, problem.task[0], Curve(PRESSURES, "bending_y", np.zeros(len(PRESSURES))))
    return fit.moved(fit.begun(), of(0.15, 0.2, 0.001)).values


def test_what_a_curve_was_computed_with_is_found(body, curve):
    problem, start = body
    few, curve = PRESSURES[::2], curve[::2]
    found = calibrate(problem, start, problem.task[0], Curve(few, "bending_y", curve), ("modulus", "wall", "pressure"))
    np.testing.assert_allclose(found.values, [15.0, 0.2, 1.0], rtol=1e-3)
    np.testing.assert_allclose(found.after, curve, atol=1e-7 * np.abs(curve).max())
    assert np.abs(found.before - curve).max() > 0.05 * np.abs(curve).max()
    assert found.factor == pytest.approx(1.15, rel=1e-4) and not found.short


def fitting(body, quantity, pressures):
    """The fit of a curve of some quantity, which is zero; of a force, with the tip held."""
    problem, start = body
    curve = Curve(pressures, quantity, np.zeros(len(pressures)))
    return _Fit.of(problem, start, as_measured(problem, problem.task[0], quantity), curve)


def measuring(begun, values):
    """The same states, of a fit of a curve with these values."""
    return replace(begun, fit=replace(begun.fit, curve=replace(begun.fit.curve, values=values)))


MEASURED = ("bending_y", "push_bending_y", "push_extension", "volume_A", "filled_A")


@pytest.mark.parametrize("quantity", MEASURED)
def test_derivatives_by_parameters_are_exact(body, quantity):
    """Away from the body as it is designed, along each of them alone; the remainder falls with order 2."""
    fit, start = fitting(body, quantity, PRESSURES[2::4]), np.array([0.2, 0.1, 0.001])
    there = fit.moved(fit.begun(), of(*start))
    slopes = there.slopes(tuple(PARAMETERS))
    for number, size in enumerate((0.1, 0.1, 0.003)):
        remainders = []
        for step in (size, 0.5 * size):
            moved = fit.moved(there, of(*(start + step * np.eye(3)[number])))
            remainders.append(np.linalg.norm(moved.values - there.values - step * slopes[:, number]))
        assert np.log2(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.15), number


@pytest.mark.parametrize("quantity", ["push_bending_y", "volume_A", "filled_A"])
def test_what_noisy_curves_of_forces_and_volumes_were_computed_with_is_found_within_two_deviations(body, quantity):
    names, truth = ("modulus", "pressure"), np.array([15.0, 1.0])
    fit = fitting(body, quantity, PRESSURES[::2])
    begun = fit.begun()
    exact = fit.moved(begun, of(0.15, 0.0, 0.001))
    noise = 0.01 * np.ptp(exact.values)
    measured = exact.values + noise * np.random.default_rng(3).standard_normal(len(exact.values))
    slopes = exact.slopes(names) * [UNITS[PARAMETERS[name]] for name in names]
    deviations = noise * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    noisy = measuring(begun, measured)
    found = fitted(noisy.fit, names, noisy)
    assert np.all(np.abs(found.values - truth) < 2.0 * deviations)
    assert np.all(np.abs(found.values - truth) > 1e-3 * deviations)  # the noise is seen
    plain = measuring(begun, exact.values)
    np.testing.assert_allclose(fitted(plain.fit, names, plain).values, truth, rtol=2e-3)


def test_a_force_across_a_mirror_plane_is_zero(body):
    """Of half a body whose tip cannot leave the plane, where the half alone is pushed with some force."""
    problem = loads(problem_text(EXTEND, body='symmetry = { mirror = ["xz"] }')).with_changes({"mesh.size": "8 mm"})
    curve = Curve(PRESSURES[:, :1], "push_shift_y", np.zeros(len(PRESSURES)))
    fit = _Fit.of(problem, starting_body(problem.tubes), as_measured(problem, problem.task[0], curve.quantity), curve)
    assert fit.points[0].model.copies == 2 and not fit.begun().values.any()


def test_a_gauge_that_is_off_says_nothing_of_chambers_without_pressure(body, curve):
    """Both chambers are alike, so a pressure that were added in both would hardly bend the body."""
    problem, start = body
    fit = _Fit.of(problem, start, problem.task[0], Curve(PRESSURES, "bending_y", curve))
    begun = fit.begun()
    by_pressure = begun.slopes(("pressure",))[:, 0]
    np.testing.assert_allclose(np.gradient(begun.values, 0.01)[1:-1], by_pressure[1:-1], rtol=0.02)


def test_intervals_have_the_modulus_in_95_of_100_noisy_curves(body, curve):
    """With noise of 2 %; near the truth the fit is linear, so that its intervals are those of least squares."""
    problem, start = body
    random, hits = np.random.default_rng(0), 0
    fit = _Fit.of(problem, start, problem.task[0], Curve(PRESSURES, "bending_y", curve))
    there = fit.moved(fit.begun(), of(0.15, 0.2, 0.001))
    noise = 0.02 * np.abs(curve).max()
    measured = curve + noise * random.standard_normal((100, len(curve)))
    slopes = there.slopes(("modulus",)) * UNITS["%"]
    for each in measured:
        step = np.linalg.lstsq(slopes, each - curve, rcond=None)[0]
        rest = each - curve - slopes @ step
        half = 2.45 * np.sqrt(rest @ rest / (len(curve) - 1) / float(np.sum(slopes**2)))
        hits += abs(step[0]) <= half
    assert hits >= 90


def test_a_point_without_pressure_narrows_no_interval():
    """It is met by any rubber, so it says nothing of how far the other points are off."""
    problem = loads(problem_text(EXTEND)).with_changes({"mesh.size": "8 mm"})
    start, pressures = starting_body(problem.tubes), 0.01 * np.arange(1.0, 5.0)[:, None]

    def halves(zeros: int) -> np.ndarray:
        at = np.concatenate([np.zeros((zeros, 1)), pressures])
        designed = _Fit.of(problem, start, problem.task[0], Curve(at, "extension", np.zeros(len(at)))).begun().values
        noisy = 0.9 * designed + 0.01 * designed.max() * np.where(at[:, 0] > 0.0, np.cos(300.0 * at[:, 0]), 0.0)
        return calibrate(problem, start, problem.task[0], Curve(at, "extension", noisy), ("modulus",)).half

    np.testing.assert_allclose(halves(3), halves(0), rtol=1e-6)


def test_a_flat_curve_determines_nothing(body):
    problem, start = body
    few = Curve(PRESSURES[:1], "bending_y", np.zeros(1))
    with pytest.raises(Hopeless, match="modulus"):
        calibrate(problem, start, problem.task[0], few, ("modulus", "wall"))


def test_a_search_that_ends_early_says_by_how_much(body, curve, monkeypatch):
    """Three parameters take more than two steps."""
    problem, start = body
    names, measured = ("modulus", "wall", "pressure"), Curve(PRESSURES[::2], "bending_y", curve[::2])
    monkeypatch.setattr("pneumorph.analysis.calibration.MOST_STEPS", 2)
    found = calibrate(problem, start, problem.task[0], measured, names)
    assert found.short and set(found.short) <= set(names)
    by, value = found.short["modulus"], found.values[0]
    assert abs(value - 15.0) < abs(value - by - 15.0), "the last step came nearer"


@pytest.mark.parametrize("by", [-1.0, 0.0, 1000.0])
def test_a_curve_that_no_such_casting_has_is_told_of(body, curve, by):
    """Motions of the wrong sign, none, or in another unit: no moduli of a rubber, and no figures beyond belief."""
    problem, start = body
    wrong = Curve(PRESSURES[::3], "bending_y", by * curve[::3])
    with pytest.raises(Hopeless, match="signs and units"):
        calibrate(problem, start, problem.task[0], wrong, ("modulus",))


BESIDE = {
    "a sheet and fibres": """
[[membrane]]
name = "paper"
stiffness = "0.8 N/mm"
angles = ["-50 deg", "50 deg"]
[[fibres]]
name = "thread"
stiffness = "1.5 N/mm"
winding = "75 deg"
""",
    "an obstacle": """
[[obstacle]]
name = "wall"
kind = "plane"
point = ["10.3 mm", "0 mm", "0 mm"]
normal = [-1, 0, 0]
""",
}


@pytest.mark.parametrize("beside", BESIDE)
def test_parameters_are_found_beside_what_else_bears_loads(beside):
    problem = loads(problem_text(TASK + BESIDE[beside], chambers=TWO_BESIDE, radius=10))
    problem = problem.with_changes({"mesh.size": "8 mm"})
    start, few = starting_body(problem.tubes), PRESSURES[::2]
    fit = _Fit.of(problem, start, problem.task[0], Curve(few, "bending_y", np.zeros(len(few))))
    shown = fit.moved(fit.begun(), of(0.15, 0.0, 0.001)).values
    found = calibrate(problem, start, problem.task[0], Curve(few, "bending_y", shown), ("modulus", "pressure"))
    np.testing.assert_allclose(found.values, [15.0, 1.0], rtol=1e-3)


def test_free_obstacles_are_refused(body):
    ball = """
[[obstacle]]
name = "ball"
kind = "sphere"
center = ["0 mm", "0 mm", "40 mm"]
radius = "5 mm"
free = { mass = "1 g", spring = { z = "1 N/mm" } }
"""
    problem, start = loads(problem_text(TASK + ball, chambers=TWO_BESIDE, radius=10)), body[1]
    with pytest.raises(ProblemError, match="obstacle ball: is free"):
        calibrate(problem, start, problem.task[0], Curve(PRESSURES, "bending_y", PRESSURES[:, 0]), ("modulus",))
