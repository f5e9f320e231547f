"""Predictions and gradients use the tangent at the state that they are of, whatever was factorised last."""

import numpy as np
import pytest

from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    predict,
    solve,
)
from pneumorph.mechanics.assembly.tangent import Origin
from pneumorph.objective import Objective, equidistant, match
from pneumorph.sensitivity import gradient, residual_jacobian
from pneumorph.verify.solids import tube

MESH = tube(11, 13, 40, (1, 12, 6))
RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
MOTION = 0.05 * np.column_stack([MESH.points[:, :2] / 13, np.zeros(len(MESH.points))])


@pytest.fixture(scope="module")
def design():
    """A tube at an equilibrium, with the linear solver as it leaves it."""
    built = build_model(MESH, RUBBER)
    at, solver = configure(built, MESH.points, build_loads(built, {"A": 0.03})), Tangent(built)
    found = solve(at, solver)
    assert isinstance(found, Equilibrium)
    return at, solver, found


def rejected_trial(at, solver, found):
    """A design whose chamber balloons, given up after some factorisations as in the design loop."""
    built = at.model
    trial = configure(built, MESH.points + MOTION, build_loads(built, {"A": 0.3}))
    assert isinstance(solve(trial, solver, found.state, most=8), NoEquilibrium)


def raised(at, solver, found):
    """A factorisation whose diagonal was raised, at a state in the midst of a descent."""
    rough = 0.5 * np.random.default_rng(0).standard_normal(at.model.size)
    assert solver.factorise_convex(at, at.model.state(np.where(at.constrained, 0.0, rough))) > 0
    assert not solver.origin.exact


def raised_here(at, solver, found):
    """The diagonal raised at the very state."""
    solver.factorise(at, found.state)
    solver.origin = Origin(at, found.state, exact=False)


@pytest.mark.parametrize("upset", [rejected_trial, raised, raised_here])
def test_nothing_that_was_factorised_since_gets_into_the_answer(design, upset):
    at, solver, found = design
    one = Objective(lambda f: f.translation[2] + f.translation[0] ** 2)
    several = match(equidistant(2, 40.0), np.outer([10.0, 30.0], [0, 0, 1.0]), np.broadcast_to(np.eye(3), (2, 3, 3)))

    def answers(tangent):
        state = predict(at, tangent, found.state, MOTION, at.loads._replace(pressure=at.loads.pressure + 0.002)).state
        return at.model.vector(state), gradient(at, tangent, found, one).X

    expected = answers(Tangent(at.model))
    for number in range(2):
        upset(at, solver, found)
        assert not solver.is_of(at, found.state)
        assert answers(solver)[number] == pytest.approx(expected[number], rel=1e-9, abs=1e-12)
    upset(at, solver, found)
    jacobian = residual_jacobian(at, solver, found, several)
    assert solver.is_of(at, found.state)
    count = solver.factorisations
    assert np.array_equal(residual_jacobian(at, solver, found, several).X, jacobian.X)
    assert solver.factorisations == count


def test_a_prediction_after_a_rejected_trial_is_as_near_as_one_before(design):
    at, solver, found = design
    rejected_trial(at, solver, found)
    there = configure(at.model, MESH.points + MOTION, build_loads(at.model, {"A": 0.031}))
    state = predict(at, solver, found.state, MOTION, at.loads._replace(pressure=at.loads.pressure + 0.001)).state
    exact = solve(there, Tangent(at.model), state)
    moved = np.abs(exact.u - found.u).max()
    assert np.abs(np.asarray(state.u)[: len(exact.u)] - exact.u)[at.model.independent].max() < 0.1 * moved
