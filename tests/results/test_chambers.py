"""What chambers do in tasks: idle ones, and those with the same pressures."""

import pytest
from records import task_result
from texts import TWO_BESIDE, problem_text

import pneumorph as pm
from pneumorph.output.chambers import of_chambers
from pneumorph.problem import loads
from pneumorph.results import MotionRates
from pneumorph.results.chambers import chamber_uses

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

BEND = """
[[task]]
name = "one"
pressure = { A = "20 kPa", B = "0 kPa" }
objective = { motion = "bending_y" }
[[task]]
name = "two"
pressure = { A = "0 kPa", B = "20 kPa" }
objective = { motion = "-bending_y" }
[mesh]
size = "6 mm"
"""
PROBLEM = loads(problem_text(BEND, radius=11, chambers=TWO_BESIDE, body='control_density = "0.3 /mm"'))


def uses(one, two, rates=None):
    pressures = {"one": dict(zip("AB", one, strict=True)), "two": dict(zip("AB", two, strict=True))}
    tasks = {name: task_result(pressures=own, rotation=(0.0, 0.5, 0.0)) for name, own in pressures.items()}
    return chamber_uses(PROBLEM, tasks, rates or {})


def test_a_chamber_is_idle_whose_pressure_is_small_in_all_tasks():
    found = uses((0.06, 0.0005), (0.05, 0.0))
    assert found["B"].idle
    assert not found["A"].idle
    assert list(of_chambers(found)) == ["chamber B is idle: its pressure is at most 0.83 % of the largest"]
    assert not uses((0.06, 0.0005), (0.05, 0.02))["B"].idle


def test_chambers_with_the_same_pressures_in_all_tasks_need_one_supply():
    found = uses((0.06, 0.0596), (0.0, 0.0))
    assert found["B"].same_as == "A"
    assert not found["A"].same_as
    assert len(list(of_chambers(found))) == 1
    assert not uses((0.06, 0.0596), (0.0, 0.01))["B"].same_as


def test_a_chamber_is_idle_whose_pressure_moves_the_tip_in_no_task():
    turn = MotionRates({"A": (0.0, 0.0, 0.0, 0.0, 8.0, 0.0), "B": (0.0, 0.0, 0.0, 0.0, 0.02, 0.0)})
    assert uses((0.06, 0.06), (0.0, 0.02), {"one": turn, "two": turn})["B"].idle
    # In one task of two it does something.
    more = MotionRates({"A": turn.by_pressure["A"], "B": (0.0, 0.0, 0.0, 0.0, 2.0, 0.0)})
    assert not uses((0.06, 0.06), (0.0, 0.02), {"one": turn, "two": more})["B"].idle
    # Where nothing is known of a task, it may.
    assert not uses((0.06, 0.06), (0.0, 0.02), {"one": turn})["B"].idle


def test_the_share_of_the_motion_is_what_is_left_without_the_pressure():
    pressures = {"A": "20 kPa", "B": "0.4 kPa"}
    design = pm.starting_design(PROBLEM.with_changes({"task[0].pressure": pressures, "task[1].pressure": pressures}))
    with_it, without = (
        design.simulate(pressures | {"B": pressure}, task="one").steps[0].rotation[1]
        for pressure in ("0.4 kPa", "0 kPa")
    )
    assert design.chambers["B"].motion == pytest.approx(abs(with_it - without) / abs(with_it), rel=0.15)


def test_an_idle_chamber_without_pressure_is_said_to_have_none():
    assert list(of_chambers(uses((0.06, 0.0), (0.05, 0.0)))) == ["chamber B is idle: its pressure is 0 in every task"]
