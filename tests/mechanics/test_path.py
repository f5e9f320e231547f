"""Path following: spheres against closed forms through their limit points, and a tube that balloons."""

import numpy as np
import pytest

from pneumorph.mechanics import (
    Equilibrium,
    NoEquilibrium,
    Path,
    Tangent,
    build_loads,
    build_model,
    configure,
    diagnose,
    follow,
    limit_ahead,
    limit_near,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.verify.incompressible import sphere_pressure
from pneumorph.verify.solids import octant, tube

SHEAR = 0.49


@pytest.mark.parametrize(("outer", "limit", "stretch"), [(20.0, 0.816424, 1.82815), (12.0, 0.225138, 1.47016)])
def test_an_incompressible_sphere_through_its_limit_point(outer, limit, stretch):
    mesh = octant(10, outer, (2, 4, 4))
    built = build_model(
        mesh,
        neo_hookean_rubber(SHEAR, 1e5 * SHEAR, 1.1e-9),
        plate=False,
        supports=np.abs(mesh.points) < 1e-9,
        mixed=True,
    )
    at = configure(built, mesh.points, build_loads(built, {"A": 0.5 * SHEAR}))
    rest = np.pi / 6 * 10**3
    path = follow(at, Tangent(built), volume=15 * rest)
    assert isinstance(path, Path)
    radii = np.array([10 * np.cbrt(point.equilibrium.volumes["A"] / rest) for point in path.points])
    found = np.array([0.5 * point.load for point in path.points])
    assert np.abs(found - sphere_pressure(radii, 10, outer)).max() < 5e-4 * limit
    (top,) = path.limits
    assert 0.5 * top.load == pytest.approx(limit, rel=5e-4)
    assert np.cbrt(top.equilibrium.volumes["A"] / rest) == pytest.approx(stretch, rel=5e-3)
    # Stable at constant pressure before the limit point, unstable in one motion after it.
    pivots = [point.equilibrium.negative_pivots for point in path.points]
    assert pivots == [0 if radius < 10 * stretch else 1 for radius in radii]
    assert 0 < pivots.count(1) < len(pivots)
    assert found[-1] < 0.9 * limit
    assert path.reason == "the volume that was asked for is reached"


@pytest.fixture(scope="module")
def balloon():
    """A thin tube with clamped ends, and the path of its inflation to six times its volume."""
    mesh = tube(11, 13, 40, (1, 12, 4))
    built = build_model(mesh, neo_hookean_rubber(SHEAR, 4.80, 1.1e-9))
    at = configure(built, mesh.points, build_loads(built, {"A": 0.3}))
    path = follow(at, Tangent(built), volume=6 * 40 * np.pi * 11**2)
    assert isinstance(path, Path)
    return built, at, path


def test_both_branches_of_a_ballooning_tube(balloon):
    _, _, path = balloon
    volumes = np.array([point.equilibrium.volumes["A"] for point in path.points])
    pressures = np.array([point.pressures["A"] for point in path.points])
    assert np.all(np.diff(volumes) > 0)
    (limit,) = path.limits
    top = limit.pressures["A"]
    before = volumes < limit.equilibrium.volumes["A"]
    assert np.all(np.diff(pressures[before]) > 0)
    assert np.all(np.diff(pressures[~before]) < 0)
    assert pressures.max() <= top * (1 + 1e-6)
    assert pressures[-1] < 0.95 * top
    assert all(point.equilibrium.stable == early for point, early in zip(path.points, before, strict=True))
    assert all(np.isfinite(point.equilibrium.u).all() for point in path.points)


def test_the_limit_point_ahead_is_estimated_from_below_by_two_back_solves(balloon):
    built, at, path = balloon
    (top,) = path.limits
    solver, estimates = Tangent(built), []
    for point in (each for each in path.points if 0.4 * top.load < each.load < top.load and each.equilibrium.stable):
        here = configure(built, at.X, build_loads(built, point.pressures))
        solver.factorise(here, point.equilibrium.state)
        factorised, solved = solver.factorisations, solver.solves
        true, estimate = top.load / point.load, limit_ahead(here, solver, point.equilibrium.state)
        assert (solver.factorisations, solver.solves) == (factorised, solved + 2)
        estimates.append((true - 1.0, estimate - 1.0))
    assert len(estimates) >= 5
    ratios = [estimate / true for true, estimate in estimates]
    assert all(0.4 < ratio <= 1.0 for ratio in ratios)
    assert ratios[-1] > 0.8


def test_a_path_from_a_state_finds_the_same_limit_point(balloon):
    built, at, path = balloon
    (top,) = path.limits
    near = next(point for point in path.points if point.load > 0.7 * top.load)
    here = configure(built, at.X, build_loads(built, near.pressures))
    found = follow(here, Tangent(built), first_limit=True, since=near.equilibrium)
    assert isinstance(found, Path)
    assert found.points[0].load == 1.0 and found.points[0].equilibrium is near.equilibrium
    assert found.limits[0].pressures["A"] == pytest.approx(top.pressures["A"], rel=1e-5)


def test_a_path_takes_long_steps(balloon):
    built, at, path = balloon
    (top,) = path.limits
    near = next(point for point in path.points if point.load > 0.5 * top.load)
    here = configure(built, at.X, build_loads(built, near.pressures))
    solver = Tangent(built)
    found = follow(here, solver, first_limit=True, since=near.equilibrium)
    assert isinstance(found, Path)
    assert len(found.points) <= 12 and solver.factorisations <= 20
    # The pressure at a limit point is known far better than its state.
    assert found.limits[0].pressures["A"] == pytest.approx(top.pressures["A"], rel=1e-8)


@pytest.mark.parametrize("mixed", [False, True])
def test_the_limit_point_of_a_body_nearby_is_found_from_that_of_another(mixed):
    mesh, wider = tube(11, 13, 40, (1, 12, 4)), tube(11.05, 13, 40, (1, 12, 4))
    built = build_model(mesh, neo_hookean_rubber(SHEAR, 4.80, 1.1e-9), mixed=mixed)
    tops, costs = [], []
    for points in (mesh.points, wider.points):
        at, solver = configure(built, points, build_loads(built, {"A": 0.3})), Tangent(built)
        path = follow(at, solver, first_limit=True)
        assert isinstance(path, Path)
        tops.append(path.limits[0])
        costs.append(solver.factorisations)
    solver = Tangent(built)
    place = limit_near(at, solver, tops[0].equilibrium.state, tops[0].load)
    assert place is not None
    assert abs(tops[1].load / tops[0].load - 1.0) > 0.02
    assert place.point.load == pytest.approx(tops[1].load, rel=1e-8)
    assert place.point.equilibrium.negative_pivots <= 1 and place.slope_rate < 0.0
    moved = np.abs(place.point.equilibrium.u - tops[1].equilibrium.u).max()
    assert moved < 1e-3 * np.abs(place.point.equilibrium.u).max()
    assert solver.factorisations < costs[1] / 2


def test_stored_energy_is_the_work_of_the_pressure_along_both_branches(balloon):
    built, at, path = balloon
    free = at.loads._replace(pressure=0 * at.loads.pressure)
    volumes = np.array([point.equilibrium.volumes["A"] for point in path.points])
    pressures = np.array([point.pressures["A"] for point in path.points])
    state = path.points[-1].equilibrium.state
    energy = float(kernels.total(built.potential, at.X, state, free))
    assert energy == pytest.approx(np.trapezoid(pressures, volumes), rel=0.01)


def test_below_the_limit_there_is_a_stable_state_and_above_a_sentence(balloon):
    built, at, path = balloon
    (limit,) = path.limits
    near = at.loads._replace(pressure=0.97 * limit.load * at.loads.pressure)
    below = solve(configure(built, np.asarray(at.X)[: built.nodes], near), Tangent(built))
    assert isinstance(below, Equilibrium)
    assert below.stable
    solver = Tangent(built)
    above = diagnose(at, solver, NoEquilibrium("none", 0.0, None))
    assert isinstance(above, NoEquilibrium)
    sentence = (
        f"300 kPa has no stable state near: pressure reaches its limit at {1e3 * limit.pressures['A']:.4g} kPa (volume"
    )
    assert above.reason.startswith(sentence)
    assert above.fraction == pytest.approx(limit.load, rel=1e-4)
    assert above.limit["A"] == pytest.approx(limit.pressures["A"], rel=1e-4)
    # Where a stable state was only missed, it is found after all.
    rescued = diagnose(
        configure(built, np.asarray(at.X)[: built.nodes], near), solver, NoEquilibrium("missed", 0.0, None)
    )
    assert isinstance(rescued, Equilibrium)
    assert rescued.volumes["A"] == pytest.approx(below.volumes["A"], rel=1e-6)


def test_a_path_is_bounded(balloon):
    built, at, _ = balloon
    short = follow(at, Tangent(built), most=3)
    assert isinstance(short, Path)
    assert len(short.points) == 3
    assert short.reason == "3 points were asked for at most"
    nothing = follow(configure(built, np.asarray(at.X)[: built.nodes], build_loads(built, {})), Tangent(built))
    assert isinstance(nothing, NoEquilibrium)
    assert "no chamber has a pressure" in nothing.reason
