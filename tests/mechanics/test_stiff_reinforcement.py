"""Sheets and fibres up to 10⁴ N/mm on silicone: at rest, and on the way to a large motion."""

import numpy as np
import pytest

from pneumorph.analysis.analyse import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import NoEquilibrium, Tangent, configure, loads_of, mirrors_of, model_of, solve
from pneumorph.mechanics.assembly import metrics as held
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.hessian import tangent as values
from pneumorph.mechanics.solve.path import follow
from pneumorph.problem import Problem
from pneumorph.problem.reinforcement import buckling_of, wrinkling_of


def bender(stiffness, element="mixed", size=6.0):
    chamber = {"name": "A", "radius": "6 mm", "center": ["1 mm", "0 mm"], "span": ["4 mm", "32 mm"]}
    return Problem.model_validate(
        {
            "material": {"name": "Elastosil M4601"},
            "body": {
                "length": "36 mm",
                "radius": "9 mm",
                "control_density": "0.35 /mm",
                "symmetry": {"mirror": ["xz"]},
                "chamber": [chamber],
            },
            "membrane": [{"name": "cloth", "stiffness": f"{stiffness} N/mm", "angles": ["120 deg", "240 deg"]}],
            "fibres": [{"name": "thread", "stiffness": f"{stiffness} N/mm", "winding": "86 deg"}],
            "task": [{"name": "t", "pressure": {"A": "10 kPa"}, "objective": {"motion": "-bending_y"}}],
            "mesh": {"size": f"{size} mm", "element": element},
        }
    )


def meshed(problem):
    mesh = mesh_of(problem, starting_body(problem.tubes), mirrors_of(problem), problem.mesh.size).mesh
    return mesh, model_of(problem, mesh)


def at_pressure(problem, mesh, model, pressure):
    return configure(model, mesh.points, loads_of(problem, model, {"A": pressure}))


@pytest.mark.parametrize("stiffness", [100.0, 1e4])
def test_a_body_at_rest_is_in_equilibrium(stiffness):
    problem = bender(stiffness)
    mesh, model = meshed(problem)
    found = solve(at_pressure(problem, mesh, model, 0.0), Tangent(model))
    assert not isinstance(found, NoEquilibrium)
    assert np.abs(found.u).max() < 1e-5
    assert found.stable


@pytest.mark.parametrize("element", ["mixed", "quadratic"])
def test_a_stiff_cloth_and_thread_bend_silicone(element):
    problem = bender(1e4, element)
    mesh, model = meshed(problem)
    tangent, since, angles = Tangent(model), None, []
    for pressure in (0.0, 0.03, 0.06):
        at = at_pressure(problem, mesh, model, pressure)
        found = solve(at, tangent, since=since)
        assert not isinstance(found, NoEquilibrium), found
        assert found.stable
        since = at, found.state
        angles.append(float(np.degrees(found.plate[4])))
    assert angles[0] > angles[1] + 1.0 > angles[2] + 2.0
    assert tangent.factorisations < 60


def moving(model, size=1e-2):
    noise = np.where(model.fixed, 0.0, size * np.random.default_rng(0).standard_normal(model.size))
    noise[-6:] *= 0.1
    return noise


def test_with_metrics_of_its_own_the_tangent_of_a_state_is_the_same():
    problem = bender(100.0)
    mesh, model = meshed(problem)
    at = at_pressure(problem, mesh, model, 0.01)
    state = model.state(moving(model))
    own = held.metrics_at(model, at.X, state)
    one, other = (values(model, at.X, state, at.loads, at.blocked, None, each) for each in (None, own))
    assert np.abs(other - one).max() < 1e-9 * np.abs(one).max()
    assert np.abs(held.pulled(model, at.X, state, at.loads, own)).max() < 1e-12


def test_the_residual_with_metrics_eliminated_changes_as_the_tangent_says():
    """R(u, m) along a step of both is to first order K du, with K the tangent at other metrics than the state's."""
    problem = bender(100.0)
    mesh, model = meshed(problem)
    at = at_pressure(problem, mesh, model, 0.01)
    vector, step = moving(model), moving(model, 1.0)[::-1] * (~model.fixed)
    state = model.state(vector)
    given = [each * (1 + 1e-3) for each in held.metrics_at(model, at.X, state)]
    potential = held.taut(model, given)
    product = model.vector(products.tangent_product(potential, at.X, state, at.loads, model.state(step)))

    def residual(fraction):
        there = model.state(vector + fraction * step)
        along = held.metrics_along_state(model, at.X, state, model.state(fraction * step))
        metrics = [m + by for m, by in zip(given, along, strict=True)]
        own = model.vector(kernels.value_and_residual(model.potential, at.X, there, at.loads)[1])
        return own + held.pulled(model, at.X, there, at.loads, metrics)

    errors = []
    for fraction in (1e-3, 5e-4, 2.5e-4):
        change = (residual(fraction) - residual(0.0)) / fraction
        free = ~model.fixed
        errors.append(np.linalg.norm((change - product)[free]))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(1.0, abs=0.15)


def test_what_turns_does_not_stretch_to_first_order():
    problem = bender(100.0)
    mesh, model = meshed(problem)
    rest = model.state(np.zeros(model.size))
    dx = np.cross([0.0, 0.1, 0.0], mesh.points)
    before = held.metrics_at(model, mesh.points, rest)
    after = held.metrics_after(model, mesh.points, rest, dx)
    for one, other in zip(before, after, strict=True):
        assert np.abs(other - one).max() < 1e-12 * np.abs(one).max()
    assert np.all(displacement(model.tip, mesh.points, rest) == 0.0)


def test_stiff_sheets_wrinkle_before_the_mesh_does():
    shear, size = 0.22, 4.0
    for stiffness in (10.0, 100.0, 1e4):
        problem = bender(stiffness)
        (sheet,), (fibres,) = problem.membrane, problem.fibres
        for strain in (wrinkling_of(sheet, shear, size), buckling_of(fibres, shear, size)):
            assert 0 < strain <= 0.01
            assert stiffness * strain <= shear * size / np.pi * (1 + 1e-12)
    assert wrinkling_of(sheet.model_copy(update={"wrinkling": 0.3}), shear, size) == 0.3
    assert buckling_of(fibres.model_copy(update={"buckling": 0.2}), shear, size) == 0.2


def test_a_path_has_metrics_of_its_own_too():
    """It reaches the pressure in 22 factorisations."""
    problem = bender(500.0)
    mesh, model = meshed(problem)
    tangent = Tangent(model)
    found = follow(at_pressure(problem, mesh, model, 0.04), tangent, load=1.0, most=20)
    last = found.points[-1]
    assert last.load >= 1.0
    assert last.equilibrium.stable
    assert tangent.factorisations <= 25
