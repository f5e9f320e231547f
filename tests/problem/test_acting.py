"""Loads of tasks of their own, and motions that are held."""

from contextlib import nullcontext

import numpy as np
import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.mechanics import breaking_loads, mirrors_of
from pneumorph.problem import loads
from pneumorph.problem.acting import acting, acting_in, like_first, words_of_own

OWN = """
[[task]]
name = "lift"
pressure = { A = "60 kPa" }
force = ["0 N", "0 N", "-2 N"]
spring = { twist = "5 N*mm/rad" }
hold = { bending_y = "30 deg" }
gravity = "none"
objective = { motion = "extension" }
"""


def with_loads(own="", mirror=("xz", "yz"), motion="extension"):
    text = tiny(objective=f'{{ motion = "{motion}" }}\n{own}')
    return loads(text.replace("[[body.chamber]]", f"symmetry = {{ mirror = {list(mirror)} }}\n[[body.chamber]]"))


def test_a_task_has_the_loads_of_the_problem_but_for_its_own():
    problem = loads(tiny() + OWN + "[gravity]\ndirection = [0, 0, -2]\n")
    first, lift = acting_in(problem).values()
    assert first == acting(problem) and like_first(problem, "extend") and not like_first(problem, "lift")
    assert first.force == (0.0, 0.0, 0.0) and first.acceleration == pytest.approx((0.0, 0.0, -9806.65), rel=1e-3)
    assert lift.force == (0.0, 0.0, -2.0) and lift.moment == (0.0, 0.0, 0.0)
    assert lift.spring.torsion == 5.0 and lift.gravity is None
    assert lift.hold.values == {"bending_y": pytest.approx(np.radians(30.0))}
    assert words_of_own(problem.task[0]) == ""
    assert words_of_own(problem.task[1]) == (
        "torsion spring 5 N*mm/rad, force 0 N, 0 N, -2 N, bending_y held at 30 deg, gravity none"
    )


def test_files_are_written_with_them_and_read_again():
    problem = loads(tiny() + OWN)
    assert loads(problem.to_toml()) == problem
    listed = loads(tiny().replace("[end_effector]\n", '[end_effector]\nhold = ["extension", "bending_x"]\n'))
    assert listed.end_effector.hold.values == {"axial": 0.0, "bending_x": 0.0}
    assert loads(listed.to_toml()) == listed


@pytest.mark.parametrize(
    ("own", "key"),
    [
        ('hold = ["sideways"]', "task[0].hold"),
        ("hold = [[]]", "task[0].hold"),
        ('hold = { bending_y = "3 mm" }', "task[0].hold.bending_y"),
        ('hold = { axial = "3 mm", extension = "3 mm" }', "task[0].hold.extension"),
        ('force = ["1 N", "0 N"]', "task[0].force"),
        ("gravity = 3", "task[0].gravity: should be a table with keys such as acceleration, direction"),
        ("gravity = { direction = [0, 0, 0] }", "task[0].gravity.direction"),
    ],
)
def test_mistakes_name_their_key(own, key):
    with pytest.raises(ProblemError) as error:
        with_loads(own)
    assert str(error.value).removeprefix("problem: ").startswith(key), error.value


def test_a_free_tip_bears_no_loads_of_tasks():
    text = tiny().replace('[end_effector]\nspring = { axial = "0 N/mm" }', '[end_effector]\nkind = "free"')
    with pytest.raises(ProblemError, match=r"task\[0\]\.force: needs a plate"):
        loads(text.replace('name = "extend"', 'name = "extend"\nforce = ["0 N", "0 N", "1 N"]'))


@pytest.mark.parametrize(
    ("own", "planes", "told"),
    [
        ('force = ["1 N", "0 N", "0 N"]', ("xz",), {"yz": ["force of task extend"]}),
        ("gravity = { direction = [0, 1, 0] }", ("yz",), {"xz": ["gravity of task extend"]}),
        ('moment = ["0 N*mm", "1 N*mm", "0 N*mm"]', ("xz",), {"yz": ["moment of task extend"]}),
        ('hold = { bending_y = "30 deg" }', ("xz",), {"yz": ["hold of task extend"]}),
        ('hold = { twist = "30 deg" }', (), {plane: ["hold of task extend"] for plane in ("xz", "yz")}),
        ('hold = ["shift_x", "twist"]', ("xz", "yz"), {}),
        ('force = ["0 N", "0 N", "1 N"]', ("xz", "yz"), {}),
    ],
)
def test_parts_are_solved_where_no_task_breaks_their_symmetry(own, planes, told):
    problem = with_loads(own)
    assert mirrors_of(problem) == planes
    assert breaking_loads(problem) == told


def test_a_symmetric_body_twists_under_a_moment_alone():
    with pytest.raises(ProblemError, match="twist is ruled out"):
        with_loads(motion="twist")
    with_loads('moment = ["0 N*mm", "0 N*mm", "2 N*mm"]', motion="twist")


POINTS = '[[%s, "0 mm"], [%s, "9 mm"], [%s, "18 mm"], [%s, "26 mm"]]'
CURVE = f'{{ kind = "match_curve", sections = 4, control_points = {POINTS} }}'


@pytest.mark.parametrize(
    ("places", "own", "ruled_out"),
    [
        ([(0, 0), (0, 0), (3, 0), (6, 0)], "", 'shift_x is ruled out by body.symmetry, mirror "yz"'),
        ([(0, 0), (0, 0), (0, 3), (0, 3)], "", 'shift_y is ruled out by body.symmetry, mirror "xz"'),
        ([(0, 0), (0, 0), (0, 0), (0, 0)], "", ""),
        # The load breaks the symmetry of states, as the weight of a horizontal arm does.
        ([(0, 0), (0, 0), (3, 0), (6, 0)], 'force = ["0.1 N", "0 N", "0 N"]', ""),
    ],
)
def test_a_symmetric_body_follows_a_curve_under_a_load_alone(places, own, ruled_out):
    words = tuple(f'"{x} mm", "{y} mm"' for x, y in places)
    text = tiny(objective=CURVE % words + "\n" + own)
    text = text.replace("[[body.chamber]]", 'symmetry = { mirror = ["xz", "yz"] }\n[[body.chamber]]')
    with pytest.raises(ProblemError, match=ruled_out) if ruled_out else nullcontext():
        loads(text)
