"""Limits on motions of the tip and on sensitivities: their values, and exact derivatives by shape and pressure."""

from dataclasses import replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from designing import analysed
from tiny import tiny

from pneumorph.analysis import analyse
from pneumorph.analysis.limited import SIDES, all_round
from pneumorph.limits.kinds.states import of_tasks
from pneumorph.mechanics import TOLERANCE, Tangent, solve
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.mechanics.elements.plate import rotation, rotation_vector
from pneumorph.objective import COMPONENTS, LIMITED, Features
from pneumorph.optimize.states import KINDS, Limited, linear_states
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import rate, rate_slopes, taylor_test

PRESSURE = '{ A = { start = "60 kPa", min = "0 kPa", max = "100 kPa" } }'


def asked(limits, objective="bending_y", **changes) -> Problem:
    """A tube whose chamber is off its axis, so that the tip tilts, shifts and, by a force, twists."""
    table = loads(tiny(pressure=PRESSURE)).model_dump(mode="json", exclude_none=True)
    table["body"]["chamber"][0]["center"] = ["1 mm", "0.5 mm"]
    table["end_effector"] = {"moment": ["0 N*mm", "5 N*mm", "20 N*mm"]}
    table["task"][0]["objective"]["motion"] = objective
    table["limits"] |= {"margin": 1, "strain": "off"} | limits
    return Problem.model_validate(table).with_changes(changes)


DIRECTIONS = {
    "shape": lambda space: np.where(
        np.arange(space.n) < space.n_shape, np.random.default_rng(1).uniform(-0.2, 0.2, space.n), 0.0
    ),
    "pressure": lambda space: np.where(np.arange(space.n) < space.n_shape, 0.0, 0.3),
}


CASES = {
    "motions": asked(
        {
            "motion": {
                "tilt": "1 deg",
                "shift": "1 mm",
                "extension": "1 mm",
                "bending_y": "1 deg",
                "twist": "1 deg",
            }
        }
    ),
    "least motions": asked({"at_least": {"shift_x": "1 mm", "bending_y": "-1 deg"}}),
    "free tip": asked({"motion": {"tilt": "1 deg", "shift_x": "1 mm"}}, end_effector={"kind": "free"}),
    "sensitivity": asked({"sensitivity": "1 deg/kPa"}),
    "of a length, mixed": asked({"sensitivity": "1 mm/kPa"}, "extension", **{"mesh.element": "mixed"}),
    "stiffness": asked({"stiffness": {"shift_x": "1 N/mm", "bending_y": "100 N*mm/rad", "twist": "100 N*mm/rad"}}),
    "free tip, sensitivity": asked({"sensitivity": "1 deg/kPa"}, end_effector={"kind": "free"}),
}


def excess(problem, disc, found):
    """By limit how far its value is beyond its bound, relative to it."""
    values = {}
    for kind in KINDS:
        for limit, bound, tasks in of_tasks(kind.limit, problem):
            (value,) = kind.values(disc, found, Limited(problem, tasks, bound)).values()
            values[limit] = limit.excess(value, bound)
    return values


@pytest.mark.parametrize("problem", CASES.values(), ids=list(CASES))
def test_derivatives_by_shape_and_pressure(problem):
    """Of the row of every limit that is nearest to its bound: its value is that of the limit, and so is its slope."""
    space, disc, found = analysed(problem)
    states = linear_states(problem, space, disc, found)
    starts = {name: each.state for name, each in found.equilibria.items()}
    values = excess(problem, disc, found)
    assert set(values) == set(states.limits)

    @cache
    def beside(way, step):
        there = space.start + step * DIRECTIONS[way](space)
        return excess(problem, disc, analyse(problem, space, disc, there, starts, tolerance=TOLERANCE))

    for limit, value in values.items():
        row = max((k for k, own in enumerate(states.limits) if own == limit), key=lambda k: states.value[k])
        assert states.value[row] == pytest.approx(value, rel=1e-6)
        for way, direction in DIRECTIONS.items():
            along = float(states.jacobian[row] @ direction(space))
            test = taylor_test(
                lambda s, way=way, limit=limit: beside(way, float(s[0]))[limit],
                *(np.zeros(1), np.array([along]), np.ones(1)),
                step=0.2,
                start=value,
            )
            assert abs(test.rate - 2.0) < 0.02, (limit.name, way, test)


def test_the_rate_is_the_slope_of_the_path_and_its_derivative_does_not_depend_on_the_step(monkeypatch):
    problem = asked({})
    _, disc, analysis = analysed(problem)
    at, state = analysis.configurations["extend"], analysis.equilibria["extend"].state
    motion, tangent = COMPONENTS["bending_y"], Tangent(disc.model)

    def moved(pressure):
        there = replace(at, loads=at.loads._replace(pressure=at.loads.pressure + pressure))
        return motion.at(disc.model, at.X, solve(there, tangent, state).state)

    found = rate_slopes(at, tangent, state, motion, EXACT)["A"]
    assert found.value == pytest.approx((moved(1e-4) - moved(-1e-4)) / 2e-4, rel=1e-5)
    assert found.pressure["A"] == pytest.approx((moved(5e-4) - 2 * moved(0.0) + moved(-5e-4)) / 25e-8, rel=1e-3)
    monkeypatch.setattr(rate, "BESIDE", 0.5 * rate.BESIDE)
    half = rate_slopes(at, tangent, state, motion, EXACT)["A"]
    np.testing.assert_allclose(half.X, found.X, atol=1e-8 * np.abs(found.X).max())


@pytest.mark.parametrize("angle", [0.0, 1e-4, 1e-2, 0.5, 2.0])
def test_a_tilt_is_the_angle_of_the_normal_with_the_axis(angle):
    """Whatever the twist; and its two components are smooth without a tilt."""
    turn = rotation_vector(np.asarray(rotation(jnp.array([0.0, angle, 0.0])) @ rotation(jnp.array([0.0, 0.0, 0.7]))))
    still = Features(jnp.array([3.0, 4.0, 1.0]), jnp.array(turn), {}, jnp.zeros((0, 3)), jnp.zeros((0, 3, 3)))
    measure = LIMITED["tilt"].residuals
    np.testing.assert_allclose(measure(still), [np.degrees(angle), 0.0], atol=1e-9)
    assert np.isfinite(jax.jacobian(lambda turn: measure(still._replace(rotation=turn)))(still.rotation)).all()
    assert np.linalg.norm(LIMITED["shift"].residuals(still)) == pytest.approx(5.0)


def test_a_length_within_its_bound_in_all_directions():
    value, slope = all_round(np.array([0.3, -0.4]), np.eye(2))
    assert value.max() == pytest.approx(0.5) and slope.shape == (SIDES + 1, 2)
    # Turned by any angle it is predicted to within 2 %.
    for angle in np.linspace(0, 2 * np.pi, 50):
        aimed = np.array([np.cos(angle), np.sin(angle)])
        assert 0.98 < (value + slope @ (aimed - [0.3, -0.4])).max() <= 1.0 + 1e-12
    np.testing.assert_array_equal(all_round(np.array([-2.0]), np.array([[1.0, 3.0]]))[0], [-2.0, 2.0])
    assert not all_round(np.zeros(2), np.eye(2))[0].any()
