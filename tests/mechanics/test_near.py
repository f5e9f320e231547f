"""Answers near a factorised state: quasi-Newton steps, and solutions and stability without another factorisation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    State,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mechanics.solve import descent
from pneumorph.mechanics.solve.balance import ratios_at
from pneumorph.mechanics.solve.secants import MEMORY, Secants
from pneumorph.verify.solids import tube

MESH = tube(11, 13, 40, (1, 12, 6))
RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_quasi_newton_directions_satisfy_the_last_secant_and_find_the_minimum_of_a_quadratic(seed):
    rng = np.random.default_rng(seed)
    factors = rng.standard_normal((8, 8))
    A, b = factors @ factors.T + np.eye(8), rng.standard_normal(8)
    x, secants = rng.standard_normal(8), Secants()
    for _ in range(MEMORY + 1):
        residual = A @ x - b
        direction = secants.direction(lambda rhs: rhs / np.diag(A), residual)
        assert direction @ residual < 0
        # The exact minimum along the line, as on an energy.
        step = -(direction @ residual) / (direction @ A @ direction) * direction
        x = x + step
        secants = secants.after(step, residual, A @ x - b)
        if secants.sizes[-1] < 1e-9:
            break
        assert secants.direction(lambda rhs: rhs / np.diag(A), secants.changes[-1]) == pytest.approx(-secants.steps[-1])
    assert np.linalg.norm(A @ x - b) < 1e-6


def test_steps_across_negative_curvature_are_not_remembered():
    once = Secants().after(np.array([1.0, 0.0]), np.array([1.0, 1.0]), np.array([2.0, 1.0]))
    twice = once.after(np.array([0.0, 1.0]), np.array([2.0, 1.0]), np.array([2.0, 0.0]))
    assert len(twice.steps) == len(once.steps) == 1 and len(twice.sizes) == 3


def test_the_steps_that_are_still_needed_are_extrapolated():
    halving = Secants(sizes=(1.0, 1 / 2, 1 / 4, 1 / 8))
    assert halving.expected(1 / 64) == pytest.approx(3.0)
    assert Secants(sizes=(1.0, 0.5)).expected(1e-9) == 0.0
    assert Secants(sizes=(1.0, 1.0, 1.0, 2.0)).expected(1e-9) == np.inf


def inflated(pressure, X=MESH.points):
    built = build_model(MESH, RUBBER)
    at, solver = configure(built, X, build_loads(built, {"A": pressure})), Tangent(built)
    found = solve(at, solver)
    assert isinstance(found, Equilibrium)
    return at, solver, found


def beside(at, solver, found, change):
    """The solver with the tangent of a state beside the equilibrium."""
    vector = at.model.vector(found.state)
    noise = np.where(at.constrained, 0.0, np.random.default_rng(1).standard_normal(at.model.size))
    soft = solver.solve_at(at, found.state, noise)
    solver.factorise(at, at.model.state(vector + change * soft / np.abs(soft).max()))
    assert not solver.is_of(at, found.state)


@pytest.mark.parametrize("change, near", [(0.02, True), (3.0, False)])
def test_a_solution_near_a_factorised_state_needs_no_factorisation(change, near):
    at, solver, found = inflated(0.03)
    rhs = np.where(at.constrained, 0.0, np.random.default_rng(0).standard_normal(at.model.size))
    exact = Tangent(at.model).solve_at(at, found.state, rhs)
    beside(at, solver, found, change)
    before = solver.factorisations
    answer = solver.solve_at(at, found.state, rhs)
    assert np.abs(answer - exact).max() < 1e-8 * np.abs(exact).max()
    assert (solver.factorisations == before) == near


@pytest.mark.parametrize("change, near", [(0.02, True), (3.0, False)])
def test_stability_near_a_factorised_state_is_told_without_a_factorisation(change, near):
    at, solver, found = inflated(0.03)
    beside(at, solver, found, change)
    before = solver.factorisations
    assert solver.pivots_at(at, found.state) == 0
    assert (solver.factorisations == before) == near


def test_a_factorisation_with_the_stress_of_other_volume_ratios_serves_beside_the_equilibrium():
    at, solver, found = inflated(0.03)
    rhs = np.where(at.constrained, 0.0, np.random.default_rng(0).standard_normal(at.model.size))
    exact = Tangent(at.model).solve_at(at, found.state, rhs)
    ratios = ratios_at(at, at.model.vector(found.state))
    solver.factorise(at, found.state, ratios + 1e-4 * np.random.default_rng(1).standard_normal(ratios.shape))
    assert not solver.is_of(at, found.state)
    before = solver.factorisations
    assert solver.pivots_at(at, found.state) == 0
    answer = solver.solve_at(at, found.state, rhs)
    assert np.abs(answer - exact).max() < 1e-8 * np.abs(exact).max()
    assert solver.factorisations == before


def test_a_factorisation_with_a_raised_diagonal_says_nothing_of_stability():
    at, solver, found = inflated(0.03)
    solver.factorise(at, found.state, damping=np.full(at.model.size, 1e-9))
    assert solver.negative_pivots == 0 and solver.origin is not None and solver.origin.raised
    before = solver.factorisations
    assert solver.pivots_at(at, found.state) == 0
    assert solver.factorisations == before + 1


def test_a_state_that_was_found_is_not_given_up_for_what_its_search_has_cost(monkeypatch):
    monkeypatch.setattr(Tangent, "_is_near", lambda self, at, state: False)
    at, _, found = inflated(0.03)
    start = at.model.state(0.97 * at.model.vector(found.state))
    cost = solve(at, Tangent(at.model), start).factorisations
    assert cost >= 2, "the last one is for its stability"
    again = solve(at, Tangent(at.model), start, most=cost - 1)
    assert isinstance(again, Equilibrium) and again.factorisations == cost
    assert isinstance(solve(at, Tangent(at.model), start, most=0), NoEquilibrium)


def test_a_search_that_converges_is_not_given_up_either(monkeypatch):
    """Factorisations that leave a fifth of the residual or less do not count."""
    mesh = tube(1, 2, 60, (1, 8, 12))
    built = build_model(mesh, RUBBER)

    def bent(moment, **given):
        at = configure(built, mesh.points, build_loads(built, {}, wrench=moment * np.eye(6)[3]))
        return solve(at, Tangent(built), **given)

    start = bent(0.03)
    assert isinstance(start, Equilibrium)
    found = bent(0.06, start=start.state, most=5)
    assert isinstance(found, Equilibrium) and found.factorisations > 5
    monkeypatch.setattr(descent, "QUICK", 0.0)
    assert isinstance(bent(0.06, start=start.state, most=5), NoEquilibrium)


def test_an_unstable_state_beside_a_stable_one_is_found_out():
    """A slender rod that is pressed beyond its buckling load: the straight state, beside the same rod at rest."""
    mesh = tube(1, 2, 60, (1, 8, 12))
    built = build_model(mesh, RUBBER)
    force = np.array([0, 0, -0.05, 0, 0, 0])
    loads = [build_loads(built, {}, wrench=share * force) for share in (0.0, 1.0)]
    at = configure(built, mesh.points, loads[1])
    solver, straight = Tangent(built), State(mesh.points * np.array([0, 0, -0.01]), np.array([0, 0, -0.6, 0, 0, 0]))
    rest = at.model.state(np.zeros(built.size))
    solver.factorise(at, rest)
    assert solver.negative_pivots == 0
    exact = Tangent(built)
    exact.factorise(at, straight)
    assert exact.negative_pivots > 0
    assert solver.pivots_at(at, straight) == exact.negative_pivots
