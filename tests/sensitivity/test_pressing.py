"""Force on an obstacle and area of contact as objectives: exact gradients by shape and pressure, and their values."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse, analyse_body, collect_task_results
from pneumorph.cad import stl
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import TOLERANCE
from pneumorph.mechanics.contact.shapes import Cylinder
from pneumorph.objective import build_objectives
from pneumorph.optimize import design
from pneumorph.problem import loads
from pneumorph.sensitivity import TaylorTest, gradient

WALL = """
[[obstacle]]
name = "wall"
kind = "plane"
point = ["0 mm", "0 mm", "24.35 mm"]
normal = [0, 0, -1]
"""
ROD = """
[[obstacle]]
name = "{name}"
kind = "cylinder"
center = ["{x} mm", "0 mm", "12 mm"]
axis = [0, 1, 0]
radius = "5 mm"
length = "30 mm"
"""
TRIANGLES = stl.pack(
    stl.Surface(*vars(Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 5.0, 15.0).mesh(0.05)).values())
)
LEFT = f"""
[[obstacle]]
name = "left"
kind = "mesh"
triangles = "{TRIANGLES}"
position = ["-13.2 mm", "0 mm", "12 mm"]
"""
OBSTACLES = WALL + ROD.format(name="rod", x=13.2) + LEFT
# The rod is pressed onto the body, whose own place at rest it takes. Two obstacles are turned.
TURN = 'turn = { rod = ["4 deg", "0 deg", "5 deg"], left = ["0 deg", "9 deg", "-6 deg"] }'
PRESSURE = f'{{ A = "80 kPa" }}\nmove = {{ rod = ["-0.3 mm", "0 mm", "0.2 mm"] }}\n{TURN}'
CODE = 'def objective(f):\n    return f.contact["rod"].normal + f.contact["left"].force[0] + f.contact["wall"].area\n'
OBJECTIVES = {
    "component": '{ kind = "press", obstacle = "rod", direction = [1, 0, 0.2] }',
    "normal force": '{ kind = "press", obstacle = "rod" }',
    "target": '{ kind = "press", obstacle = "wall", direction = [0, 0, 2], force = "1 N" }',
    "area": '{ kind = "contact_area", obstacle = "rod" }',
    "target area": '{ kind = "contact_area", obstacle = "rod", area = "5 mm^2" }',
    "triangles": '{ kind = "press", obstacle = "left", direction = [-1, 0, 0.2] }',
    "normal force of triangles": '{ kind = "press", obstacle = "left" }',
    "area of triangles": '{ kind = "contact_area", obstacle = "left" }',
    "custom": f"{{ kind = 'custom', code = '''{CODE}''' }}",
}


def problem(name):
    return loads(tiny(pressure=PRESSURE, objective=OBJECTIVES[name]) + OBSTACLES)


@pytest.fixture(scope="module")
def at():
    asked = problem("component")
    return analyse_body(asked, starting_body(asked.tubes))


@pytest.fixture(scope="module")
def objectives():
    return {name: build_objectives(problem(name))["extend"] for name in OBJECTIVES}


@pytest.mark.parametrize("along", ["shape", "pressure"])
def test_the_gradients_are_exact(at, objectives, along):
    """All objectives on the same states: equilibria are what costs."""
    space, disc, found = at.space, at.disc, at.analysis
    here, there = found.configurations["extend"], found.equilibria["extend"]
    of_shape = np.arange(space.n) < space.n_shape
    random = np.random.default_rng(1).uniform(-1.0, 1.0, space.n)
    direction = np.where(of_shape, random, 0.0) if along == "shape" else np.where(of_shape, 0.0, 1.0)
    steps = 0.02 * 0.5 ** np.arange(4)
    states = []
    for step in steps:
        phi = space.start + step * direction
        states.append(analyse(at.problem, space, disc, phi, {"extend": there.state}, tolerance=TOLERANCE))
    for name, objective in objectives.items():
        exact = gradient(here, disc.tangents["extend"], there, objective)
        slope = space.pullback(disc.morph.pullback(exact.X), {"extend": exact.pressure}) @ direction
        values = [objective.at(disc.model, each.X, each.equilibria["extend"].state) for each in states]
        remainders = np.abs(np.array(values) - exact.value - steps * slope)
        test = TaylorTest(steps, remainders, np.log2(remainders[:-1] / remainders[1:]))
        assert test.passed and abs(slope) > 0.0, (name, test)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_what_is_reported_is_what_the_objective_is(at, objectives, name):
    disc, objective = replace(at.disc, objectives={"extend": objectives[name]}), objectives[name]
    value = objective.at(disc.model, at.analysis.X, at.analysis.equilibria["extend"].state)
    found = collect_task_results(disc, replace(at.analysis, values={"extend": value}))["extend"]
    # A rod at one side is pressed by forces that nearly have one direction.
    force = np.linalg.norm(found.contact["rod"])
    assert 0.99 * found.contact_normal["rod"] < force <= found.contact_normal["rod"]
    assert found.contact["rod"][0] > 0.05 and found.contact["left"][0] < -0.05 and found.contact_area["rod"] > 1.0
    if name == "custom":
        expected = found.contact_normal["rod"] + found.contact["left"][0] + found.contact_area["wall"]
        assert value == pytest.approx(expected, rel=1e-12)
        return
    done, asked = problem(name).task[0].objective.achieved(found), problem(name).task[0].objective
    wanted = getattr(asked, "force", None) or getattr(asked, "area", None)
    assert value == pytest.approx(-done.value if wanted is None else (done.value - wanted) ** 2, rel=1e-12)
    assert done.unit == ("mm²" if asked.kind == "contact_area" else "N") and done.value > 1e-3
    assert (done.target is not None) == (wanted is not None)


def test_they_are_written_as_they_are_read():
    for name in OBJECTIVES:
        assert loads(problem(name).to_toml()) == problem(name)
    task = problem("component").task[0]
    assert task.moves == {"rod": (-0.3, 0.0, 0.2)} and task.poses["left"][4] == pytest.approx(np.pi / 20)


@pytest.mark.parametrize(
    "objective, message",
    [
        ('{ kind = "press", obstacle = "ball" }', 'objective.obstacle: there is no obstacle "ball"; the obstacles are'),
        ('{ kind = "press" }', "objective.obstacle: is missing; add the name of an obstacle"),
        ('{ kind = "press", obstacle = "rod", direction = [0, 0, 0] }', "objective.direction: has length zero"),
        ('{ kind = "press", obstacle = "rod", force = "-1 N" }', "objective.force: is not above zero"),
        ('{ kind = "contact_area", obstacle = "rod", area = "0 mm^2" }', "objective.area: .* is not above zero"),
    ],
)
def test_refusals(objective, message):
    with pytest.raises(ProblemError, match=message):
        loads(tiny(objective=objective) + OBSTACLES)


def test_an_obstacle_is_needed():
    with pytest.raises(
        ProblemError, match=r'move.ball: there is no obstacle "ball"; the obstacles are wall, rod, left'
    ):
        loads(tiny(pressure='{ A = "0 kPa" }\nmove = { ball = ["0 mm", "0 mm", "1 mm"] }') + OBSTACLES)
    with pytest.raises(ProblemError, match=r"add a table \[\[obstacle\]\]"):
        loads(tiny(objective=OBJECTIVES["area"]))


def test_a_start_that_does_not_touch_is_refused():
    """It would be taken for an optimum, since all derivatives are zero."""
    text = tiny(pressure='{ A = "5 kPa" }', objective=OBJECTIVES["normal force"])
    with pytest.raises(ComputationError, match='task extend: the start does not touch obstacle "rod"; move it nearer'):
        list(design(loads(text + ROD.format(name="rod", x=16))))
