"""Tasks with loads of their own: each as if it were alone with these loads, exact gradients, sweeps of held motions."""

import csv

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse_body, collect, compute_inflation, compute_sag, run_gradient_check
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.design import starting_design
from pneumorph.problem import loads

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

OWN = {
    "force": '["0.1 N", "0 N", "-0.5 N"]',
    "moment": '["0 N*mm", "2 N*mm", "0 N*mm"]',
    "spring": '{ axial = "0.3 N/mm" }',
    "hold": '{ bending_x = "4 deg", shift_y = "0.4 mm" }',
}
GRAVITY = "gravity = { direction = [1, 0, 0] }"
SECOND = """
[[task]]
name = "push"
pressure = { A = "30 kPa" }
OWN
objective = { motion = "bending_y" }
"""


def analysed(text):
    problem = loads(text)
    return analyse_body(problem, starting_body(problem.tubes))


def lines(table):
    return "\n".join(f"{key} = {value}" for key, value in table.items())


@pytest.fixture(scope="module")
def both():
    return analysed(tiny() + SECOND.replace("OWN", f"{GRAVITY}\n{lines(OWN)}"))


def test_a_task_moves_as_in_a_problem_with_its_loads(both):
    text = tiny().replace('spring = { axial = "0 N/mm" }', lines(OWN)) + SECOND.replace("OWN", "")
    alone = analysed(text + "[gravity]\ndirection = [1, 0, 0]\n")
    one, other = (each.analysis.equilibria["push"] for each in (both, alone))
    assert one.plate == pytest.approx(other.plate, abs=1e-6)
    assert one.plate[[1, 3]] == pytest.approx([0.4, np.radians(4.0)], abs=1e-14)
    assert one.reaction == pytest.approx(other.reaction, rel=1e-4, abs=1e-7)
    assert abs(both.analysis.equilibria["extend"].plate[3]) < 1e-4
    assert compute_sag(both.problem, both.disc, both.analysis) is None, "the first task has no loads"


@pytest.mark.parametrize("held", [False, True], ids=["free", "held"])
def test_a_design_sags_as_from_rest_where_its_pressures_are_lowered(monkeypatch, held):
    own = OWN if held else {key: value for key, value in OWN.items() if key != "hold"}
    text = tiny().replace('spring = { axial = "0 N/mm" }', lines(own))
    at = analysed(text + "[gravity]\ndirection = [1, 0, 0]\n")
    from_rest = compute_sag(at.problem, at.disc, at.analysis)
    assert from_rest is not None and np.abs(from_rest).max() > 0.05
    # Nothing is sought from rest any more.
    monkeypatch.setattr(collect, "compute_sag", lambda *_: None)
    sag, inflation = compute_inflation(at.problem, at.disc, at.analysis)
    assert sag == pytest.approx(from_rest, abs=1e-4)
    assert inflation["extend"].parts == pytest.approx(collect.PARTS)


def test_the_gradient_with_loads_of_tasks(both):
    check = run_gradient_check(both)
    assert check.passed, check
    for test in check.tests.values():
        assert abs(test.rate - 2.0) < 0.02, test


def test_forces_along_a_held_motion():
    design = starting_design(loads(tiny()))
    swept = design.simulate({"A": "20 kPa"}, "extension=0:2:1 mm")
    extensions = [step.translation[2] for step in swept.steps]
    assert extensions == pytest.approx([0.0, 1.0, 2.0], abs=1e-12)
    forces = np.array([step.reaction["axial"] for step in swept.steps])
    free = design.simulate({"A": "20 kPa"}).steps[0].translation[2]
    # About a straight line through the free motion, where it exerts nothing.
    assert np.all(np.diff(forces) < 0)
    assert np.interp(free, extensions, forces) == pytest.approx(0.0, abs=0.02 * np.ptp(forces))
    rows = list(csv.DictReader(swept.to_csv().splitlines()))
    assert [float(row["held_axial_mm"]) for row in rows] == [0.0, 1.0, 2.0] and rows[0]["swept"] == "held axial"
    assert swept.plot().axes[0].get_xlabel() == "extension of the tip, mm"
