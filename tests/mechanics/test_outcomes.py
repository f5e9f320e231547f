"""What the solver says when there is no equilibrium, and that both factorisations agree."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from tiny import TINY

from pneumorph.analysis import Analysis, analyse, discretise
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    rest,
    solve,
)
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.assembly.linear import SuperLU
from pneumorph.mechanics.solve.balance import applied_force, residual_rounding
from pneumorph.problem import loads
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


def test_a_ballooning_tube_is_told_in_a_sentence():
    mesh = tube(11, 13, 20, (1, 8, 1))
    built = build_model(mesh, RUBBER)
    found = solve(configure(built, mesh.points, build_loads(built, {"A": 0.3})), Tangent(built))
    assert isinstance(found, NoEquilibrium)
    assert "no equilibrium found near " in found.reason
    assert "kPa" in found.reason
    assert 0 < found.fraction < 1
    assert isinstance(found.last, Equilibrium)
    assert np.isfinite(found.last.u).all()


def test_the_search_ends_after_the_factorisations_allowed():
    mesh = tube(11, 13, 40, (1, 12, 6))
    built = build_model(mesh, RUBBER)
    solver = Tangent(built)
    found = solve(configure(built, mesh.points, build_loads(built, {"A": 0.3})), solver, most=12)
    assert isinstance(found, NoEquilibrium)
    assert found.reason == "no equilibrium found in 12 factorisations"
    assert solver.factorisations == 12
    assert isinstance(solve(configure(built, mesh.points, build_loads(built, {"A": 0.01})), solver), Equilibrium)


def test_steps_that_take_many_factorisations_are_shortened(monkeypatch):
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.2}))
    search = importlib.import_module("pneumorph.mechanics.solve.search")
    whole, steps, soon = solve(at, Tangent(built)), [], search._found_soon

    def counted(*arguments):
        steps.append(soon(*arguments))
        return steps[-1]

    monkeypatch.setattr(search, "FEW", 1)
    monkeypatch.setattr(search, "_found_soon", counted)
    found = solve(at, Tangent(built))
    assert "none was found in 1 factorisations" in steps
    assert isinstance(steps[-1], tuple)
    assert np.abs(found.u - whole.u).max() < 1e-6


def test_a_state_that_is_no_minimum_is_sought_again(monkeypatch):
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.03}))
    search = importlib.import_module("pneumorph.mechanics.solve.search")
    minimise, read_off, checked = search.minimise, search.read_off, []

    def noted(*arguments):
        checked.append(arguments[-1])
        return minimise(*arguments)

    def unstable_at_first(*arguments):
        answer = read_off(*arguments)
        return answer if checked[-1] else replace(answer, negative_pivots=1)

    monkeypatch.setattr(search, "minimise", noted)
    monkeypatch.setattr(search, "read_off", unstable_at_first)
    assert solve(at, Tangent(built), rest(built)).stable
    assert checked == [False, True]


def test_an_answer_that_is_no_minimum_is_kept_where_seeking_it_again_is_too_costly(monkeypatch):
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.03}))
    search = importlib.import_module("pneumorph.mechanics.solve.search")
    minimise, read_off = search.minimise, search.read_off

    def costly(at, tangent, *others):
        if others[-1]:
            for _ in range(50):
                tangent.factorise(at, rest(built))
        return minimise(at, tangent, *others)

    monkeypatch.setattr(search, "minimise", costly)
    monkeypatch.setattr(search, "read_off", lambda *arguments: replace(read_off(*arguments), negative_pivots=1))
    tangent = Tangent(built)
    found = solve(at, tangent, rest(built), most=5)
    assert isinstance(found, Equilibrium) and not found.stable
    assert tangent.factorisations <= 11


def test_a_start_turned_inside_out_is_answered_from_rest():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.03}))
    wild = built.state(np.where(built.fixed, 0.0, 30 * np.random.default_rng(0).standard_normal(built.size)))
    found, plain = solve(at, Tangent(built), wild), solve(at, Tangent(built))
    assert np.abs(found.u - plain.u).max() < 1e-7


def test_a_tolerance_below_rounding_errors_is_not_waited_for():
    """A small weight on a nearly incompressible rubber, whose bulk modulus makes the errors large."""
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, neo_hookean_rubber(0.1, 2000.0, 1.1e-9))
    at = configure(built, mesh.points, build_loads(built, {}, acceleration=np.array([100.0, 0.0, 0.0])))
    found = solve(at, Tangent(built), tolerance=1e-15)
    assert isinstance(found, Equilibrium)
    assert 1e-15 < found.residual < 1e-6
    assert found.factorisations <= 3
    assert np.abs(found.u - solve(at, Tangent(built), tolerance=1e-6).u).max() < 1e-6


@pytest.mark.parametrize("bulk, low, high", [(2.0, 0.0, 1e-9), (2000.0, 1e-9, 1e-5)])
def test_rounding_errors_of_the_residual_grow_with_the_bulk_modulus(bulk, low, high):
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, neo_hookean_rubber(0.1, bulk, 1.1e-9))
    at = configure(built, mesh.points, build_loads(built, {}, acceleration=np.array([9810.0, 0.0, 0.0])))
    found = solve(at, Tangent(built))
    vector = built.vector(found.state)
    error = residual_rounding(at, vector) / applied_force(at, found.state)
    assert low < error < high
    # It bounds what is left of the residual where steps do not get on any more.
    assert solve(at, Tangent(built), tolerance=1e-15).residual < error


def test_a_large_force_on_a_stiff_spring_does_not_pass_for_rounding_errors():
    """A spring of 1000 N/mm draws the tip by 10 mm: a millionth of its force is as large as those in the body."""
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    spring = 1e3 * np.eye(6)[2]
    at = configure(built, mesh.points, build_loads(built, {}, spring=spring, wrench=spring * 10.0))
    vector = built.vector(solve(at, Tangent(built)).state)
    assert residual_rounding(at, vector) < 1e-11 * applied_force(at, built.state(vector))


def test_warm_starts_are_cheap():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built, solver = build_model(mesh, RUBBER), None
    solver = Tangent(built)
    first = solve(configure(built, mesh.points, build_loads(built, {"A": 0.05})), solver)
    again = solve(configure(built, mesh.points, build_loads(built, {"A": 0.05})), solver, first.state)
    assert again.factorisations == 1
    near = solve(configure(built, mesh.points, build_loads(built, {"A": 0.051})), solver, first.state)
    assert near.factorisations <= 3


def test_a_step_that_fails_goes_on_from_the_equilibrium_before():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    low, high = (configure(built, mesh.points, build_loads(built, {"A": p})) for p in (0.03, 0.05))
    solver = Tangent(built)
    before = solve(low, solver)
    wild = built.state(np.where(built.fixed, 0.0, 30 * np.random.default_rng(0).standard_normal(built.size)))
    found = solve(high, solver, wild, since=(low, before.state))
    assert np.abs(found.u - solve(high, Tangent(built)).u).max() < 1e-7
    # From where it was, two thirds of the way, it takes no more than the few steps from rest and the one that failed.
    assert found.factorisations <= solve(high, Tangent(built), wild).factorisations + 1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("mixed", [False, True])
def test_a_start_so_far_away_that_its_energy_is_not_finite_is_told_without_a_warning(mixed):
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER, mixed=mixed)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.05}))
    for far in (1e60, 1e120, 1e200):
        random = np.random.default_rng(0).standard_normal(built.size)
        wild = built.state(np.where(built.fixed, 0.0, far * random))
        found = solve(at, Tangent(built), wild)
        assert isinstance(found, Equilibrium) and found.stable


def test_the_answer_is_factorised_once():
    """A load so small that the tangent at rest leads there: one factorisation at rest, one at the answer."""
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    for more in ({}, {"acceleration": np.array([0.0, 10.0, 0.0])}):
        found = solve(configure(built, mesh.points, build_loads(built, {"A": 1e-5}, **more)), Tangent(built))
        assert found.factorisations == 2 + len(more)


def test_superlu_serves_where_there_is_no_mkl():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    at = configure(built, mesh.points, build_loads(built, {"A": 0.05}))
    data = tangent(built, at.X, rest(built), at.loads, at.blocked)
    plain = SuperLU(built.sparsity.indptr, built.sparsity.indices)
    plain.refactorise(data)
    best = Tangent(built)
    best.factorise(at, rest(built))
    rhs = np.random.default_rng(0).standard_normal(built.size)
    assert np.abs(plain.solve(rhs) - best.precondition(rhs)).max() < 1e-8 * np.abs(plain.solve(rhs)).max()
    assert plain.negative_pivots == best.negative_pivots
    raised = data.copy()
    raised[built.diagonal[100]] -= 1e3
    plain.refactorise(raised)
    assert plain.negative_pivots == best.negative_pivots + 1


def test_a_tangent_of_the_free_plate_serves_the_blocked_one():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    solver, inflated = Tangent(built), build_loads(built, {"A": 0.05})
    blocked = configure(built, mesh.points, inflated, np.arange(6) == 2)
    solve(configure(built, mesh.points, inflated), solver)
    found, fresh = solve(blocked, solver), solve(blocked, Tangent(built))
    assert found.plate[2] == 0.0
    assert found.reaction[2] == pytest.approx(fresh.reaction[2], rel=1e-6)


@pytest.mark.slow
def test_what_buckles_without_its_pressure_may_stand_with_it():
    text = TINY.replace('"24 mm"', '"60 mm"').replace('"21 mm"', '"57 mm"')
    text = text.replace('radius = "8 mm"', 'radius = "6 mm"').replace('radius = "4 mm"', 'radius = "4.5 mm"')
    text = text.replace('spring = { axial = "0 N/mm" }', 'force = ["0.1 N", "0 N", "-0.7 N"]')
    # The load is in the plane of symmetry: half of the body is solved.
    text = text.replace("[[body.chamber]]", 'symmetry = { mirror = ["xz"] }\n[[body.chamber]]')
    asked = loads(text.replace("60 kPa", "90 kPa"))
    body = starting_body(asked.tubes)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    assert isinstance(analyse(asked, space, disc, space.start), Analysis)
