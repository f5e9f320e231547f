"""The stiffness that parts of a body have left against motions to a side: that of the whole body, and of a column."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import (
    NoEquilibrium,
    Tangent,
    buckling_load,
    build_loads,
    build_model,
    configure,
    lateral_models,
    masses_of,
    mirrors_of,
    neo_hookean_rubber,
    rest,
    softest,
    softest_of_kinds,
    solve,
    stable_against_kinds,
    whole_of,
)
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem
from pneumorph.sensitivity import lateral_slope, taylor_test

RUBBERS = {False: neo_hookean_rubber(0.49, 4.80, 1.1e-9), True: neo_hookean_rubber(0.49, 4.9e3, 1.1e-9)}
CHAMBER = {"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "29 mm"]}


def column(mirror) -> Problem:
    """A tube that is pushed along its axis by its plate."""
    body = {"length": "32 mm", "radius": "6 mm", "control_density": "0.4 /mm", "chamber": [CHAMBER]}
    body["symmetry"] = {"mirror": list(mirror)}
    task = {"name": "one", "pressure": {"A": "20 kPa"}, "objective": {"kind": "maximize", "motion": "extension"}}
    return Problem.model_validate({"material": {"name": "Hei-Cast 8400"}, "body": body, "task": [task]})


def pushed(mirror, force, mixed=False, plate=True, pressure=0.02):
    """A mesh of part of a column that is no tube of revolution, and its state under a force on its plate."""
    asked = column(mirror)
    space = build_design_space(asked, starting_body(asked.tubes))
    phi = space.start + 0.05 * np.random.default_rng(0).normal(size=space.n)
    mesh = mesh_body(space.body(phi), 5.0, mirrors_of(asked)).mesh
    part = build_model(mesh, RUBBERS[mixed], plate, mixed=mixed, weight=False)
    loads = build_loads(part, {"A": pressure}, wrench=np.array([0.0, 0.0, -force, 0.0, 0.0, 0.0]) if plate else None)
    at, tangent = configure(part, mesh.points, loads), Tangent(part)
    found = solve(at, tangent, tolerance=1e-12)
    assert not isinstance(found, NoEquilibrium), found
    return mesh, at, tangent, found


CASES = [
    pytest.param(("xz",), 1.5, False, True, id="half"),
    pytest.param(("xz", "yz"), 1.5, False, True, id="quarter"),
    pytest.param(("xz", "yz"), 6.0, False, True, id="quarter, buckled"),
    pytest.param(("yz",), 1.5, True, True, id="half, mixed"),
    pytest.param(("xz", "yz"), 6.0, True, True, id="quarter, mixed, buckled"),
    pytest.param(("xz", "yz"), 0.0, False, False, id="quarter, free tip"),
]


@pytest.mark.parametrize(("mirror", "force", "mixed", "plate"), CASES)
def test_the_kinds_together_are_the_whole_body(mirror, force, mixed, plate):
    mesh, at, tangent, found = pushed(mirror, force, mixed, plate)
    whole = whole_of(at.model, mesh)
    there, state = whole.configuration(at), whole.state(found.state)
    known = softest(there, state, whole.tangent, masses_of(there))
    kinds = lateral_models(at.model, mesh)
    assert len(kinds) == 2 ** len(mirror) - 1
    pivots, stiffnesses = found.negative_pivots, []
    for kind in kinds:
        one = softest(replace(at, model=kind), found.state, tangent, masses_of(at))
        pivots += tangent.negative_pivots
        stiffnesses.append(one.stiffness)
        assert one.stable == (tangent.negative_pivots == 0)
        assert np.abs(one.motion.u).max() <= 1.0 + 1e-9
    assert pivots == whole.negative_pivots(at, found.state)
    pairs = [(kind, tangent) for kind in kinds]
    assert [one.stiffness for one in softest_of_kinds(at, found.state, pairs)] == pytest.approx(stiffnesses)
    flags = [stiffness > 0.0 for stiffness in stiffnesses]
    assert stable_against_kinds(at, found.state, pairs) == flags
    assert known.stable == (pivots == 0)
    if force:
        assert (min(stiffnesses) < 0.0) == (pivots > 0)
        assert min(stiffnesses) == pytest.approx(known.stiffness, rel=3e-2)


def test_a_column_softens_in_proportion_to_its_load():
    """By Euler and Southwell 1 − P/P_cr is left of the square of its lowest frequency."""
    ratios = {}
    for force in (0.2, 0.8, 1.4):
        mesh, at, tangent, found = pushed(("xz",), force, pressure=0.0)
        (kind,) = lateral_models(at.model, mesh)
        lateral, masses = replace(at, model=kind), masses_of(at)
        free = replace(lateral, loads=build_loads(kind, {}))
        still = softest(free, rest(kind), tangent, masses, 1e-6).stiffness
        ratios[force] = softest(lateral, found.state, tangent, masses, 1e-6).stiffness / still
    critical = [force / (1.0 - ratio) for force, ratio in ratios.items()]
    assert critical == pytest.approx([critical[0]] * 3, rel=0.1), ratios


def test_the_buckling_load_is_known_from_less_load():
    """What is pulled does not buckle, and where the column has buckled its load is all that it would bear."""

    def bearing(force):
        mesh, at, tangent, found = pushed(("xz", "yz"), force, pressure=0.0)
        solver = Tangent(at.model)
        motions = softest_of_kinds(at, found.state, [(kind, solver) for kind in lateral_models(at.model, mesh)])
        return all(each.stable for each in motions), buckling_load(at, found.state, tangent, motions)

    loads = {force: force * bearing(force)[1] for force in (0.2, 1.4, 2.4)}
    critical = loads[2.4]
    assert [*loads.values()] == pytest.approx([critical] * 3, rel=0.15), loads
    assert bearing(0.95 * critical)[0]
    assert bearing(1.05 * critical) == (False, 1.0)
    assert bearing(-0.5)[0] and bearing(-0.5)[1] > 100.0


@pytest.mark.parametrize("mixed", [False, True])
def test_derivatives_by_nodes_and_pressure(mixed):
    mesh, at, tangent, found = pushed(("xz", "yz"), 2.2, mixed)
    for kind in lateral_models(at.model, mesh)[:2]:
        masses = masses_of(at)
        one = softest(replace(at, model=kind), found.state, Tangent(at.model), masses, 1e-12)
        by_X, by_pressure, _ = lateral_slope(at, tangent, found.state, one, 1e-10)
        rng = np.random.default_rng(1)
        motion = 0.1 * rng.uniform(-1.0, 1.0, at.X.shape)
        for plane, normal in (("xz", 1), ("yz", 0)):
            motion[mesh.mirror_nodes(plane), normal] = 0.0

        def value(step, kind=kind, motion=motion, masses=masses):
            loads = at.loads._replace(pressure=at.loads.pressure + 0.02 * step[1])
            there = configure(at.model, at.X + step[0] * motion, loads)
            again = solve(there, tangent, found.state, tolerance=1e-12)
            assert not isinstance(again, NoEquilibrium), again
            return softest(replace(there, model=kind), again.state, Tangent(at.model), masses, 1e-12).stiffness

        slope = np.array([float((by_X * motion).sum()), 0.02 * by_pressure["A"]])
        for direction in np.eye(2):
            test = taylor_test(value, np.zeros(2), slope, direction, 0.1, count=3, start=one.stiffness)
            assert test.passed, (test, slope)
