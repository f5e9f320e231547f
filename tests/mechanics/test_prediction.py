"""States on curves through others on a path."""

from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.mechanics import (
    Equilibrium,
    State,
    Tangent,
    along_curve,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    predict_change,
    solve,
)
from pneumorph.mechanics.solve import prediction
from pneumorph.mechanics.solve.equilibrium import NoEquilibrium
from pneumorph.verify.solids import tube

ROD = tube(1, 2, 60, (1, 8, 12))
BUILT = build_model(ROD, neo_hookean_rubber(0.49, 4.80, 1.1e-9))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 3), st.floats(0.1, 2.0))
def test_a_curve_through_states_of_a_polynomial_is_that_polynomial(seed, count, to):
    rng = np.random.default_rng(seed)
    factors = rng.standard_normal((count + 2, 9))

    def at(t):
        x = t ** np.arange(count + 2) @ factors
        return cast(State, State(x[:3].reshape(1, 3), x[3:]))

    shares = -np.cumsum(rng.uniform(0.3, 1.5, count))[::-1]
    here, slope = at(0.0), factors[1]
    ahead = cast(State, State(here.u + slope[:3].reshape(1, 3), here.plate + slope[3:]))
    found = prediction._on_curve(here, ahead, [(at(share), share) for share in shares], to)
    size = np.abs(factors).sum()
    assert found.u == pytest.approx(at(to).u, abs=1e-9 * size)
    assert found.plate == pytest.approx(at(to).plate, abs=1e-9 * size)


def test_the_curve_nearest_to_balance_is_taken(monkeypatch):
    """After a jump the states before it say nothing; where no residual is a number, any curve is as good."""
    states = {share: State(np.full((1, 3), value), np.zeros(6)) for share, value in ((-3.0, 9.0), (-2.0, 8.0))}
    states |= {share: State(np.full((1, 3), share), np.zeros(6)) for share in (-1.0, 0.0, 1.0)}
    earlier = [(states[share], share) for share in (-3.0, -2.0, -1.0)]
    there, scale = cast(Any, SimpleNamespace()), 1.0
    monkeypatch.setattr(prediction, "relative_residual", lambda _, state: scale * np.abs(state.u - 1.0).max())
    found = along_curve(there, states[0.0], states[1.0], earlier, 1.0)
    assert found is not None and found.u == pytest.approx(states[1.0].u)
    scale = np.nan
    assert along_curve(there, states[0.0], states[1.0], earlier, 1.0) is not None
    assert along_curve(there, states[0.0], states[1.0], earlier, 2.1) is None, "too far ahead"
    assert along_curve(there, states[0.0], states[1.0], [], 1.0) is None


@cache
def bent(moment):
    """A slender rod that a moment bends."""
    at = configure(BUILT, ROD.points, build_loads(BUILT, {}, wrench=moment * np.eye(6)[3]))
    solver = Tangent(BUILT)
    found = solve(at, solver, tolerance=1e-11)
    assert isinstance(found, Equilibrium)
    return at, solver, found.state


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_error_falls_with_the_degree_of_the_curve(count):
    """With half the way it is an eighth with one other state, a 16th with two, and a 32nd with three."""
    middle, errors = 0.06, []
    for way in (0.012, 0.006):
        at, solver, here = bent(middle)
        there, _, exact = bent(middle + way)
        ahead = predict_change_exactly(at, solver, here, there)
        earlier = [(bent(middle - k * way)[2], -float(k)) for k in range(count, 0, -1)]
        found = prediction._on_curve(here, ahead, earlier, 1.0)
        errors.append(np.linalg.norm(np.asarray(found.u) - np.asarray(exact.u)))
        best = along_curve(there, here, ahead, earlier, 1.0)
        assert best is not None
    assert np.log2(errors[0] / errors[1]) == pytest.approx(count + 2.0, abs=0.5)


def predict_change_exactly(at, solver, state, there):
    solver.move_to(at, state)
    return predict_change(at, solver, state, there)


def test_loads_that_go_on_take_fewer_factorisations(monkeypatch):
    """Eight steps in which a rod bends by 24° each, with curves through up to three states, and through one."""

    def taken():
        solver, earlier, since, here = Tangent(BUILT), [], None, 0.0
        for number in range(1, 9):
            at = configure(BUILT, ROD.points, build_loads(BUILT, {}, wrench=0.12 * number * np.eye(6)[3]))
            before = [(state, float(share - here)) for share, state in earlier]
            found = solve(at, solver, since=since, earlier=before)
            assert not isinstance(found, NoEquilibrium)
            if since is not None:
                earlier.append((here, since[1]))
            since, here = (at, found.state), float(number)
        return solver.factorisations, found.plate

    many, plate = taken()
    monkeypatch.setattr(prediction, "MOST_BEFORE", 1)
    one, same = taken()
    assert plate == pytest.approx(same, abs=1e-4)
    assert many < 0.85 * one
