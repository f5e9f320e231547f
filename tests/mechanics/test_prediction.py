"""States that are extrapolated along a path."""

from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    State,
    Tangent,
    along_path,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    predict_change,
    solve,
)
from pneumorph.mechanics.solve import prediction
from pneumorph.verify.solids import tube

ROD = tube(1, 2, 60, (1, 8, 12))
BUILT = build_model(ROD, neo_hookean_rubber(0.49, 4.80, 1.1e-9))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 3), st.floats(0.1, 2.0))
def test_states_on_a_polynomial_are_extrapolated_exactly(seed, count, to):
    rng = np.random.default_rng(seed)
    factors = rng.standard_normal((count + 2, 9))

    def at(t):
        x = t ** np.arange(count + 2) @ factors
        return State(x[:3].reshape(1, 3), x[3:])

    shares = -np.cumsum(rng.uniform(0.3, 1.5, count))[::-1]
    here, slope = at(0.0), factors[1]
    ahead = State(here.u + slope[:3].reshape(1, 3), here.plate + slope[3:])
    found = prediction._polynomial(here, ahead, [(at(share), share) for share in shares], to)
    size = np.abs(factors).sum()
    assert found.u == pytest.approx(at(to).u, abs=1e-9 * size)
    assert found.plate == pytest.approx(at(to).plate, abs=1e-9 * size)


def test_the_state_with_the_smallest_residual_is_taken(monkeypatch):
    """After a jump, which states before say nothing of; where no residual is a number, any is as good."""
    places = {-3.0: 9.0, -2.0: 8.0, -1.0: -1.0, 0.0: 0.0, 1.0: 1.0}
    at = {share: State(np.full((1, 3), value), np.zeros(6)) for share, value in places.items()}
    earlier, goal = [(at[share], share) for share in (-3.0, -2.0, -1.0)], 1.0
    monkeypatch.setattr(prediction, "relative_residual", lambda _, state: np.abs(state.u - goal).max())

    def found(mixed, earlier=earlier, to=1.0):
        there = cast(Any, SimpleNamespace(model=SimpleNamespace(mixed=mixed)))
        state = along_path(there, at[0.0], at[1.0], earlier, to)
        return None if state is None else state.u[0, 0]

    assert found(mixed=False) == pytest.approx(1.0)
    assert found(mixed=True) is None, "first order is as good"
    assert found(mixed=False, to=2.1) is None, "too far ahead"
    assert found(mixed=False, earlier=[]) is None
    bent = [(at[-2.0], -1.0)]
    assert found(mixed=False, earlier=bent) == pytest.approx(10.0)
    assert found(mixed=True, earlier=bent) is None
    goal = 10.0
    assert found(mixed=True, earlier=bent) == pytest.approx(10.0)
    goal = np.nan
    assert found(mixed=False) is not None


@cache
def bent(moment):
    """A slender rod that a moment bends."""
    at = configure(BUILT, ROD.points, build_loads(BUILT, {}, wrench=moment * np.eye(6)[3]))
    solver = Tangent(BUILT)
    found = solve(at, solver, tolerance=1e-11)
    assert isinstance(found, Equilibrium)
    return at, solver, found.state


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_error_falls_with_the_degree(count):
    """With half the way it is an eighth with one state before, a 16th with two, and a 32nd with three."""
    middle, errors = 0.06, []
    for way in (0.012, 0.006):
        at, solver, here = bent(middle)
        there, _, exact = bent(middle + way)
        # Factorised there, the slope is exact.
        solver.move_to(at, here)
        ahead = predict_change(at, solver, here, there)
        earlier = [(bent(middle - k * way)[2], -float(k)) for k in range(count, 0, -1)]
        found = prediction._polynomial(here, ahead, earlier, 1.0)
        errors.append(np.linalg.norm(np.asarray(found.u) - np.asarray(exact.u)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(count + 2.0, abs=0.5)


def test_loads_that_go_on_take_fewer_factorisations(monkeypatch):
    """Eight steps in which a rod bends by 24° each, from up to three states before the last one, and from one."""

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
