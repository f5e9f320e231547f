"""Force on an obstacle and area of contact as objectives: exact gradients by shape and pressure, and their values."""

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse_body, collect_task_results, run_gradient_check
from pneumorph.errors import ProblemError
from pneumorph.geometry import starting_body
from pneumorph.output.format import motion_of
from pneumorph.problem import loads

WALL = """
[[obstacle]]
name = "wall"
kind = "plane"
point = ["0 mm", "0 mm", "24.35 mm"]
normal = [0, 0, -1]
[[obstacle]]
name = "rod"
kind = "cylinder"
center = ["13.2 mm", "0 mm", "12 mm"]
axis = [0, 1, 0]
radius = "5 mm"
length = "30 mm"
"""
PRESSURE = '{ A = { start = "80 kPa", min = "0 kPa", max = "100 kPa" } }'
OBJECTIVES = {
    "component": '{ kind = "press", obstacle = "rod", direction = [1, 0, 0.2] }',
    "normal force": '{ kind = "press", obstacle = "rod" }',
    "target": '{ kind = "press", obstacle = "wall", direction = [0, 0, 2], force = "1 N" }',
    "area": '{ kind = "contact_area", obstacle = "rod" }',
    "target area": '{ kind = "contact_area", obstacle = "rod", area = "5 mm^2" }',
}


@pytest.fixture(scope="module", params=OBJECTIVES.values(), ids=list(OBJECTIVES))
def case(request: pytest.FixtureRequest):
    problem = loads(tiny(pressure=PRESSURE, objective=request.param) + WALL)
    return problem, analyse_body(problem, starting_body(problem.body))


def test_the_gradient_is_exact(case):
    check = run_gradient_check(case[1])
    assert check.passed and len(check.tests) == 3, str(check)
    assert all(check.tests[name].passed for name in check.tests), str(check)


def test_the_gradient_where_a_task_moves_the_obstacle():
    """The rod is pressed onto the body, whose own place at rest it takes."""
    text = tiny(
        pressure='{ A = "20 kPa" }\nmove = { rod = ["-0.5 mm", "0 mm", "0.2 mm"] }', objective=OBJECTIVES["area"]
    )
    problem = loads(text + WALL)
    assert loads(problem.to_toml()) == problem
    at = analyse_body(problem, starting_body(problem.body))
    found = collect_task_results(at.disc, at.analysis)["extend"]
    assert found.contact["rod"][0] > 0.05 and found.objective == -found.contact_area["rod"] < -1.0
    assert run_gradient_check(at).passed


def test_what_is_reported_is_what_the_objective_is(case):
    problem, at = case
    found = collect_task_results(at.disc, at.analysis)["extend"]
    done, asked = motion_of(problem.task[0], found), problem.task[0].objective
    wanted = getattr(asked, "force", None) or getattr(asked, "area", None)
    expected = -done.value if wanted is None else (done.value - wanted) ** 2
    assert found.objective == pytest.approx(expected, rel=1e-12)
    assert done.unit == ("mm²" if asked.kind == "contact_area" else "N") and done.value > 1e-3
    assert ("target" in done.word) == (wanted is not None)
    # A rod at one side is pressed by forces that nearly have one direction.
    force = np.linalg.norm(found.contact["rod"])
    assert 0.99 * found.contact_normal["rod"] < force <= found.contact_normal["rod"]


def test_forces_that_oppose_each_other_add_up_as_normal_forces():
    two = WALL + WALL.replace('"rod"', '"rod2"').replace("13.2 mm", "-13.2 mm").replace('"wall"', '"wall2"')
    code = (
        'def objective(f):\n    return f.contact["rod"].normal + f.contact["rod2"].force[0] + f.contact["wall"].area\n'
    )
    problem = loads(tiny(objective=f"{{ kind = 'custom', code = '''{code}''' }}") + two)
    at = analyse_body(problem, starting_body(problem.body))
    found = collect_task_results(at.disc, at.analysis)["extend"]
    assert found.objective == pytest.approx(
        found.contact_normal["rod"] + found.contact["rod2"][0] + found.contact_area["wall"], rel=1e-12
    )
    assert found.contact["rod"][0] == pytest.approx(-found.contact["rod2"][0], rel=0.05)


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
        loads(tiny(objective=objective) + WALL)


def test_an_obstacle_is_needed():
    with pytest.raises(ProblemError, match=r'move.ball: there is no obstacle "ball"; the obstacles are wall, rod'):
        loads(tiny(pressure='{ A = "0 kPa" }\nmove = { ball = ["0 mm", "0 mm", "1 mm"] }') + WALL)
    with pytest.raises(ProblemError, match=r"add a table \[\[obstacle\]\]"):
        loads(tiny(objective=OBJECTIVES["area"]))
