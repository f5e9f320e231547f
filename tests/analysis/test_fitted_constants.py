"""Constants of a rubber found from curves that were computed with them."""

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis.along import Curve
from pneumorph.analysis.calibration import UNITS, Calibration, _Fit, calibrate, covariance_after, fitted
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.calibration import CalibratedDesign, as_measured, with_found
from pneumorph.problem import loads
from pneumorph.problem.measured import Measured

RUBBER = 'model = "yeoh"\ncoefficients = ["0.02 MPa", "0.01 MPa"]\nbulk_modulus = "2 MPa"\ndensity = "1.1 g/cm^3"\n'
TASK = """
[[task]]
name = "bend"
pressure = { A = "12 kPa", B = "0 kPa" }
objective = { motion = "bending_y" }
"""
PRESSURES = np.outer(np.linspace(0.004, 0.024, 6), [1.0, 0.0])
CONSTANTS = ("c1", "c2")


@pytest.fixture(scope="module")
def body():
    problem = loads(problem_text(TASK, material=RUBBER, chambers=TWO_BESIDE, radius=10))
    problem = problem.with_changes({"mesh.size": "9 mm"})
    return problem, starting_body(problem.tubes)


def fitting(body, values=None, quantity="bending_y", names=CONSTANTS, pressures=PRESSURES):
    problem, start = body
    curve = Curve(pressures, quantity, np.zeros(len(pressures)) if values is None else values)
    return _Fit.of(problem, start, as_measured(problem, problem.task[0], quantity), curve, names)


@pytest.mark.parametrize("quantity", ["bending_y", "push_bending_y", "filled_A"])
def test_derivatives_by_constants_are_exact(body, quantity):
    """Away from the body as it is designed, with another factor of all moduli; the remainder falls with order 2."""
    fit = fitting(body, quantity=quantity, pressures=PRESSURES[1::2])
    start = {"modulus": 0.2, "wall": 0.1, "c1": 0.1, "c2": -0.2}
    there = fit.moved(fit.begun(), start)
    slopes = there.slopes((*CONSTANTS, "modulus", "bulk_modulus"))
    for number, (name, size) in enumerate((("c1", 0.1), ("c2", 0.3))):
        remainders = []
        for step in (size, 0.5 * size):
            moved = fit.moved(there, start | {name: start[name] + step})
            remainders.append(np.linalg.norm(moved.values - there.values - step * slopes[:, number]))
        assert np.log2(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.15), name
    # By all moduli together, relative to what they are.
    together = 1.1 * slopes[:, 0] + 0.8 * slopes[:, 1] + slopes[:, 3]
    np.testing.assert_allclose(together, 1.2 * slopes[:, 2], rtol=1e-6, atol=1e-9 * np.abs(slopes).max())


@pytest.fixture(scope="module")
def curve(body):
    """What a body of a rubber with other constants would show."""
    fit = fitting(body)
    return fit.moved(fit.begun(), {"c1": 0.15, "c2": -0.3})


def test_what_a_curve_was_computed_with_is_found(body, curve):
    problem, start = body
    found = calibrate(problem, start, problem.task[0], Curve(PRESSURES, "bending_y", curve.values), CONSTANTS)
    np.testing.assert_allclose(found.values, [15.0, -30.0], rtol=1e-3)
    assert found.constants["c2"] == pytest.approx(-0.3, rel=1e-3) and not found.undetermined
    written = loads(with_found(problem, found).to_toml()).material
    np.testing.assert_allclose(written.coefficients, [0.023, 0.007], rtol=1e-3)
    assert written.bulk_modulus == 2.0 and "c1 times 1.15, c2 times 0.7" in written.source


def test_noise_moves_constants_as_their_deviations_say(body, curve):
    noise = 0.005 * np.ptp(curve.values)
    slopes = curve.slopes(CONSTANTS) * UNITS["%"]
    deviations = noise * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    measured = curve.values + noise * np.random.default_rng(1).standard_normal(len(PRESSURES))
    fit = fitting(body, measured)
    found = fitted(fit, CONSTANTS, fit.begun())
    apart = np.abs(found.values - [15.0, -30.0])
    assert np.all(apart < 2.0 * deviations) and np.all(apart > 1e-3 * deviations)
    assert np.all(apart < found.half)


def test_where_little_is_stretched_what_stiffens_it_is_not_determined(body):
    """A hundredth of the pressure, with noise of 2 %: the second coefficient does nothing then."""
    few = 0.02 * PRESSURES
    fit = fitting(body, pressures=few)
    begun = fit.begun()
    noise = 0.02 * np.ptp(begun.values) * np.random.default_rng(2).standard_normal(len(few))
    fit = fitting(body, begun.values + noise, pressures=few)
    found = fitted(fit, CONSTANTS, fit.begun())
    assert found.undetermined == ["c2"]
    told = str(CalibratedDesign(body[0], Measured({"A": few[:, 0]}, "bending_y", begun.values + noise), found))
    assert "c1: " in told and "does not determine c2; leave it out" in told
    assert abs(found.values[0]) < 2.0 * found.half[0] < 50.0


def calibration(names, covariance, made_up):
    rest = np.zeros(3)
    return Calibration(names, np.zeros(len(names)), np.zeros(len(names)), covariance, made_up, rest, rest)


@pytest.mark.parametrize("names", [("modulus",), ("c1",), ("c2", "wall"), ("c1", "c2")])
def test_what_is_left_of_an_earlier_fit_s_errors_is_that_of_repeated_ones(body, names):
    """Drawn errors of the constants and of a curve that is linear in them, each fitted by least squares."""
    random, old = np.random.default_rng(5), np.array([[1e-4, -4e-4], [-4e-4, 9e-3]])
    by_constants = random.standard_normal((8, 2))
    columns = {"c1": 0.01 * by_constants[:, 0], "c2": 0.01 * by_constants[:, 1], "wall": random.standard_normal(8)}
    columns["modulus"] = columns["c1"] + columns["c2"]
    slopes, noise = np.column_stack([columns[name] for name in names]), 1e-3
    changes = {"c1": [0.01, 0.0], "c2": [0.0, 0.01], "modulus": [0.01, 0.01], "wall": [0.0, 0.0]}
    errors = random.multivariate_normal(np.zeros(2), old, 20000)
    curves = errors @ by_constants.T + noise * random.standard_normal((20000, 8))
    found = np.linalg.pinv(slopes) @ curves.T
    left = errors - found.T @ np.array([changes[name] for name in names])

    made_up = dict(zip(CONSTANTS, (np.linalg.pinv(slopes) @ by_constants).T, strict=True))
    fit = calibration(names, noise**2 * np.linalg.inv(slopes.T @ slopes), made_up)
    material = body[0].material.model_copy(update={"covariance": tuple(map(tuple, old))})
    covariance = covariance_after(body[0].model_copy(update={"material": material}), fit, "")
    np.testing.assert_allclose(covariance, left.T @ left / 20000, atol=0.04 * np.abs(covariance).max())
    if names == CONSTANTS:
        np.testing.assert_allclose(covariance, 1e-4 * fit.covariance, rtol=1e-6)
