"""Tasks that have the pressures of another one."""

import textwrap

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis import design_slopes
from pneumorph.analysis.gradient import analyse_body
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.problem import loads, with_fewer_chambers

FREE = '{ start = "30 kPa", min = "0 kPa", max = "60 kPa" }'
TASKS = f"""
[[task]]
name = "press"
HAS
hold = {{ shift_x = "0 mm" }}
objective = {{ kind = "blocked", motion = "shift_x" }}
[[task]]
name = "bend"
pressure = {{ A = {FREE}, B = "10 kPa" }}
objective = {{ motion = "bending_y" }}
"""


def text(has='pressures_of = "bend"'):
    mirror = 'symmetry = { mirror = ["xz"] }'
    return problem_text(TASKS.replace("HAS", has), radius=11, chambers=TWO_BESIDE, body=mirror)


PROBLEM = loads(text())


def test_pressures_of_two_tasks_are_the_same_variables():
    space = space_of(PROBLEM)
    assert space.n == space.n_shape + 1
    phi = space.start.copy()
    phi[-1] *= 1.5
    assert space.pressures(phi) == {name: {"A": pytest.approx(0.045), "B": 0.01} for name in ("press", "bend")}
    # The transpose of that map.
    slopes = {"press": {"A": 3.0}, "bend": {"A": 4.0, "B": 5.0}}
    pulled = space.pullback(np.zeros((space.reference.n_points, 3)), slopes)
    step = 0.01
    phi[-1] += step
    assert 7.0 * (space.pressures(phi)["bend"]["A"] - 0.045) == pytest.approx(pulled[-1] * step)


def test_the_slope_by_a_pressure_of_two_tasks_is_that_of_the_sum():
    at = analyse_body(PROBLEM, body_of(PROBLEM))
    # All pressures are variables there, fixed ones too.
    [(number, scale)] = [(k, each.scale) for k, each in enumerate(at.space.free_pressures) if each.chamber == "A"]
    slope = scale * design_slopes(at.problem, at.space, at.disc, at.analysis).total[at.space.n_shape + number]
    values = []
    for pressure in ("29.9 kPa", "30.1 kPa"):
        raised = PROBLEM.with_changes({"task[1].pressure.A.start": pressure})
        assert raised.task[0].pressure["A"].start == raised.task[1].pressure["A"].start
        values.append(analyse_body(raised, body_of(raised)).analysis.value)
    assert (values[1] - values[0]) / 0.2e-3 == pytest.approx(slope, rel=1e-3)


def test_a_file_is_written_as_it_was_read():
    assert loads(PROBLEM.to_toml()) == PROBLEM
    assert PROBLEM.to_toml().count("[task.pressure]") == 1
    fewer = with_fewer_chambers(PROBLEM, ["B"], {})
    assert all(list(task.pressure) == ["A"] for task in fewer.task)


@pytest.mark.parametrize(
    ("has", "words"),
    [
        ('pressures_of = "bent"', "task[0].pressures_of: names no task with pressures of its own; those are bend"),
        ('pressures_of = "press"', "task[0].pressures_of: names no task"),
        ('pressures_of = "bend"\npressure = { A = "1 kPa" }', "task[0].pressure: is that of task bend by pressures_of"),
        ("", "task[0].pressure: is missing"),
    ],
)
def test_what_it_cannot_be_is_said(has, words):
    with pytest.raises(ProblemError) as refused:
        loads(textwrap.dedent(text(has)))
    assert words in str(refused.value)
