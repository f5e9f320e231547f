import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.geometry import tied_coordinates
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.problem import Problem


@pytest.fixture
def space(spec):
    fixed, free = "60 kPa", {"start": "30 kPa", "min": "10 kPa", "max": "50 kPa"}
    objective = {"kind": "maximize", "motion": "extension"}
    body = spec(ripple=(0.2, 10.0), radius=20.0, aside=("15 mm", "0 mm"))
    problem = Problem.model_validate(
        {
            "material": {"shear_modulus": "0.5 MPa", "bulk_modulus": "5 MPa", "density": "1 g/cm^3"},
            "body": body,
            "task": [
                {"name": "one", "pressure": {"A": fixed, "B": free}, "objective": objective},
                {"name": "two", "pressure": {"A": free, "B": fixed}, "objective": objective},
            ],
        }
    )
    return build_design_space(problem, starting_body(body))


def test_start_is_the_reference_body(space):
    np.testing.assert_allclose(space.control_points(space.start), space.reference.control_points(), atol=1e-12)
    assert space.pressures(space.start) == {
        "one": {"A": pytest.approx(0.06), "B": pytest.approx(0.03)},
        "two": {"A": pytest.approx(0.03), "B": pytest.approx(0.06)},
    }


def test_number_of_variables(space):
    exterior, flat, pole = (surface.net for surface in space.reference.surfaces)
    lumped = 2 * exterior.shape[1] + 2 * (flat.shape[1] - 1) + (6 * (pole.shape[1] - 1) + 2 * pole.shape[1])
    assert space.n_shape == exterior.size + flat.size + pole.size - lumped
    assert space.n == space.n_shape + 2


def test_ends_stay_planar_for_any_variables(space):
    body = space.body(np.random.default_rng(3).normal(size=space.n))
    for row, z in ((0, 0.0), (-1, 80.0)):
        np.testing.assert_allclose(body.exterior.net[row, :, 2], z, atol=1e-12)
        assert np.ptp(body.chambers[0].net[row, :, 2]) == 0.0
        assert np.ptp(body.chambers[0].net[row, :, 0]) > 0.1
        assert np.ptp(body.chambers[1].net[row], axis=0).max() == 0.0
    for pole, ring in ((0, 1), (-1, -2)):
        np.testing.assert_array_equal(body.chambers[1].net[ring, :, 2], body.chambers[1].net[pole, 0, 2])


def test_pullback_is_the_transpose(space):
    rng = np.random.default_rng(4)
    direction = rng.normal(size=space.n)
    dP = rng.normal(size=(space.reference.n_points, 3))
    dp = {"one": {"A": 7.0, "B": 2.0}, "two": {"A": -3.0}}
    step = 1e-3
    moved = space.control_points(space.start + step * direction) - space.control_points(space.start)
    pressed, rest = space.pressures(space.start + step * direction), space.pressures(space.start)
    change = np.sum(dP * moved) + sum(
        value * (pressed[task][name] - rest[task][name]) for task in dp for name, value in dp[task].items()
    )
    np.testing.assert_allclose(space.pullback(dP, dp) @ direction, change / step, rtol=1e-8)
    np.testing.assert_array_equal(space.pullback(dP)[space.n_shape :], 0.0)


def test_a_step_moves_a_pressure_by_a_tenth_of_its_range(space):
    step = np.zeros(space.n)
    step[-2:] = 0.2
    assert space.pressures(space.start + step)["one"]["B"] == pytest.approx(0.03 + 0.004)
    np.testing.assert_allclose(space.upper[-2:] - space.lower[-2:], 2.0)
    assert np.all(np.isinf(space.lower[:-2]))


def test_what_is_nearer_to_a_bound_than_rounding_is_on_it(space):
    phi = space.start.copy()
    phi[-2:] = space.lower[-2] + 1e-15, space.upper[-1] - 1e-15
    held = space.within_bounds(phi)
    assert held[-2] == space.lower[-2] and held[-1] == space.upper[-1]
    np.testing.assert_array_equal(held[:-2], phi[:-2])
    phi[-2:] = space.lower[-2] - 1.0, space.upper[-1] - 1e-9
    held = space.within_bounds(phi)
    assert held[-2] == space.lower[-2] and held[-1] == phi[-1]


@given(st.lists(st.integers(-1, 4), min_size=1, max_size=20))
def test_tied_coordinates_are_fixed_or_move_as_one(numbers):
    found, variable = np.unique(numbers, return_inverse=True)
    variable = variable - int(found[0] < 0)
    coordinates = np.where(variable < 0, np.arange(len(numbers)), 10.0 * variable)
    shape = tied_coordinates(coordinates, variable)
    np.testing.assert_array_equal(shape.L @ shape.start + shape.offset, coordinates)
    moved = shape.L @ (shape.start + 1.0) + shape.offset - coordinates
    np.testing.assert_array_equal(moved, np.where(variable < 0, 0.0, 1.0))
    assert len(shape.lower) == len(shape.upper) == variable.max() + 1
