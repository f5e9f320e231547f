"""Loads on the plate and the body's weight: springs, blocks, dead forces and gravity agree with one another."""

import numpy as np
import pytest
from texts import EXTEND, problem_text

from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    loads_of,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mechanics.elements.plate import COMPONENTS
from pneumorph.mechanics.solve.balance import evaluate
from pneumorph.problem import load
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
EVERYTHING = {"acceleration": np.array([9810.0, -4000.0, 2000.0]), "wrench": np.array([0.02, 0.01, 0.1, 0.2, 0.4, 0.5])}


@pytest.fixture(scope="module")
def built():
    mesh = tube(4, 8, 20, (1, 8, 4))
    return mesh, build_model(mesh, RUBBER)


def equilibrium(built, spring=None, blocked=None, wrench=EVERYTHING["wrench"]):
    mesh, body = built
    acting = build_loads(body, {"A": 0.05}, EVERYTHING["acceleration"], spring=spring, wrench=wrench)
    found = solve(configure(body, mesh.points, acting, blocked), Tangent(body))
    assert isinstance(found, Equilibrium)
    return found


@pytest.mark.parametrize("component", range(6), ids=COMPONENTS)
def test_a_stiff_spring_carries_what_a_block_carries(built, component):
    chosen = np.arange(6) == component
    blocked = equilibrium(built, blocked=chosen)
    assert blocked.plate[component] == 0.0
    assert np.all(blocked.reaction[~chosen] == 0)
    stiffness = 1e7
    sprung = equilibrium(built, spring=np.where(chosen, stiffness, 0.0))
    assert stiffness * sprung.plate[component] == pytest.approx(blocked.reaction[component], rel=1e-4, abs=1e-7)
    # A weak one takes just what its motion asks of it, in the balance of that component.
    free = equilibrium(built)
    weak = 0.02 * abs(blocked.reaction[component] / free.plate[component])
    given = equilibrium(built, spring=np.where(chosen, weak, 0.0))
    assert abs(given.plate[component]) < abs(free.plate[component])
    pushed = EVERYTHING["wrench"] - np.where(chosen, weak * given.plate[component], 0.0)
    assert equilibrium(built, wrench=pushed).plate == pytest.approx(given.plate, rel=1e-6, abs=1e-9)


def test_dead_loads_of_the_size_of_the_reactions_hold_the_plate(built):
    blocked = equilibrium(built, blocked=np.ones(6, bool))
    assert np.all(blocked.plate == 0)
    assert np.all(np.abs(blocked.reaction) > 1e-4)
    pushed = equilibrium(built, wrench=EVERYTHING["wrench"] - blocked.reaction)
    assert np.abs(pushed.plate).max() < 1e-6


def test_an_inflated_body_weighs_what_it_weighed_at_rest(built):
    mesh, _ = built
    body = build_model(mesh, RUBBER, plate=False)
    found = solve(configure(body, mesh.points, build_loads(body, {"A": 0.08})), Tangent(body))
    assert isinstance(found, Equilibrium)
    acceleration = np.array([1000.0, -2000.0, 9810.0])
    heavy, light = (
        evaluate(configure(body, mesh.points, build_loads(body, {"A": 0.08}, g)), found.state)[1][:-6].reshape(-1, 3)
        for g in (acceleration, np.zeros(3))
    )
    weight = RUBBER.density * acceleration * mesh.volume()
    assert (light - heavy).sum(axis=0) == pytest.approx(weight, rel=1e-6)


def test_a_hanging_bar_and_a_beam_under_their_small_weight():
    mesh = tube(4, 5, 100, (1, 12, 20))
    body = build_model(mesh, RUBBER)
    young = 9 * 4.80 * 0.49 / (3 * 4.80 + 0.49)
    area, second = np.pi * (5**2 - 4**2), np.pi / 4 * (5**4 - 4**4)
    g = 1.0
    for direction, axis, expected in (
        ([0, 0, 1.0], 2, RUBBER.density * g * 100**2 / (2 * young)),
        ([0, -1.0, 0], 1, -RUBBER.density * g * area * 100**4 / (8 * young * second)),
    ):
        acting = build_loads(body, {}, g * np.array(direction))
        found = solve(configure(body, mesh.points, acting), Tangent(body))
        assert isinstance(found, Equilibrium)
        assert found.plate[axis] == pytest.approx(expected, rel=0.04)


def test_all_six_springs_have_a_key(built, tmp_path):
    path = tmp_path / "sprung.toml"
    springs = """
[end_effector.spring]
shift_x = "1 N/mm"
shift_y = "2 N/mm"
axial = "3 N/mm"
bending_x = "4 N*mm/rad"
bending_y = "5 N*mm/rad"
torsion = "6 N*mm/rad"
"""
    path.write_text(problem_text(springs + EXTEND))
    assert np.asarray(loads_of(load(path), built[1], {"A": 0.06}).spring) == pytest.approx([1, 2, 3, 4, 5, 6])
