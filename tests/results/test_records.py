"""Records and the JSON that is made of them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from records import entry, one_element, task_result
from tiny import tiny

from pneumorph.problem import loads
from pneumorph.results import HistoryEntry, Motion, RunResult, SweepStep, TaskResult, from_json, to_json, unpack_fields
from pneumorph.run import open_run

WRITTEN_BY_0_1_0 = (
    '{"iteration": 1, "objective": -0.317, "optimality": 0.83, "tasks": {"extend": {"pressure_MPa": {"A": 0.06}, '
    '"objective": -0.317, "errors": {}, "translation_mm": [1.2e-17, -0.0, 0.317], "rotation_rad": [0.0, 3e-18, 0.0], '
    '"section_position_mm": [], "section_rotation_rad": [], "volume_mm3": {"A": 1650.4}, "max_stretch": 1.13, '
    '"beyond_validity": false, "stable": true}}, "limits": {"wall_mm": 2.5, "fold_mm": 1.2, "curvature": 0.03, '
    '"skew": 0.01, "stretch": 0.004, "envelope_mm": null}, "held": true, "elements": 408, "dofs": 2106, '
    '"factorisations": 3, "seconds": {"geometry": 0.1, "equilibrium": 0.9, "gradient": 0.07, "subproblem": 0.6, '
    '"total": 1.7}, "equivalents": null, "step_mm": 0.2, "ratio": 0.98, "remeshed": false, "evaluations": 31}\n'
)
KEYS = [
    "iteration", "objective", "optimality", "tasks", "limits", "held", "elements", "dofs", "factorisations", "seconds",
    "equivalents", "step_mm", "ratio", "remeshed", "evaluations",
]  # fmt: skip


def test_a_history_of_0_1_0_reads(tmp_path):
    (tmp_path / "problem.toml").write_text(tiny())
    (tmp_path / "history.jsonl").write_text(WRITTEN_BY_0_1_0)
    (found,) = open_run(tmp_path).history()
    assert (found.iteration, found.step, found.ratio, found.equivalents) == (1, 0.2, 0.98, None)
    extend = found.tasks["extend"]
    assert extend.translation == (1.2e-17, 0.0, 0.317)
    assert extend.pressures == {"A": 0.06} and extend.volumes == {"A": 1650.4}
    assert to_json(found) == json.loads(WRITTEN_BY_0_1_0), "it is written as it was read"
    assert set(to_json(found)) == set(KEYS)


def test_the_first_runs_have_no_optimality():
    content = {key: value for key, value in to_json(entry(0)).items() if key != "optimality"}
    assert from_json(HistoryEntry, content).optimality is None
    with pytest.raises(KeyError, match="objective"):
        from_json(HistoryEntry, {key: value for key, value in content.items() if key != "objective"})


def test_what_is_not_finite_is_null():
    written = to_json(entry(2, limits={"wall_mm": math.inf}, equivalents=math.nan, objective=np.float64(1.5)))
    assert written["limits"] == {"wall_mm": None} and written["equivalents"] is None
    assert json.loads(json.dumps(written, allow_nan=False))["objective"] == 1.5


def test_entries_come_back():
    turned = task_result(section_positions=((0.0, 0.0, 1.0), (0.0, 1.0, 2.0)), errors={"position_mm": 0.5})
    written = entry(3, tasks={"extend": turned}, step=0.1, evaluations=7)
    assert from_json(HistoryEntry, json.loads(json.dumps(to_json(written)))) == written


def test_results_come_back():
    last = entry(4)
    written = RunResult(
        title="t", completed=True, reason="r", iterations=4, best=4, objective=-0.1, optimality=0.5,
        motions={"extend": Motion(0.1, "mm")}, tasks=last.tasks, limits=last.limits, held=True, seconds=last.seconds,
        peak_memory=312.5, versions={"pneumorph": "0.1.0", "jax": None},
    )  # fmt: skip
    content = json.loads(json.dumps(to_json(written)))
    assert content["peak_memory_MB"] == 312.5 and content["motions"] == {"extend": {"value": 0.1, "unit": "mm"}}
    assert from_json(RunResult, content) == written


def test_a_step_without_equilibrium_is_null():
    missing = SweepStep("t", {"A": 0.1}, converged=False, reason="it balloons")
    written = to_json(missing)
    assert {key for key, value in written.items() if value is None} == {
        "translation_mm", "rotation_rad", "reaction", "volume_mm3", "max_stretch", "beyond_validity", "stable",
        "errors", "contact_N", "contact_normal_N", "contact_area_mm2", "self_contact_N",
    }  # fmt: skip
    back = from_json(SweepStep, json.loads(json.dumps(written)))
    assert (back.task, back.converged, back.reason) == ("t", False, "it balloons")
    # What was filled in is known of it.
    filled = SweepStep("t", {}, converged=False, reason="it balloons", filled={"A": 300.0})
    assert from_json(SweepStep, json.loads(json.dumps(to_json(filled)))).filled == {"A": 300.0}
    assert math.isnan(back.max_stretch) and np.isnan(back.translation).all() and back.volumes == {}


def test_a_step_comes_back():
    step = SweepStep("t", {"A": 0.1}, (0.0, 0.0, 1.0), (0.0, 0.1, 0.0), {"axial": 2.0}, {"A": 900.0}, 1.2, stable=True)
    on_wall = {"contact": {"wall": (0.0, 1.0, 2.0)}, "contact_normal": {"wall": 2.5}, "contact_area": {"wall": 9.0}}
    step = replace(step, **on_wall, moves={"wall": (0.0, 0.0, -1.0)}, pull={"wall": 1.5})
    of_task = replace(entry(1).tasks["extend"], **on_wall)
    assert from_json(TaskResult, json.loads(json.dumps(to_json(of_task)))) == of_task
    written = json.loads(json.dumps(to_json(step)))
    assert "reason" not in written and written["converged"] is True
    assert from_json(SweepStep, written) == step


def test_fields_come_back():
    written = replace(one_element(), sag=np.ones((10, 3)))
    back = unpack_fields(written.pack())
    np.testing.assert_array_equal(back.mesh.points, written.mesh.points)
    np.testing.assert_array_equal(back.stretch["extend"], written.stretch["extend"])
    np.testing.assert_array_equal(back.sag, written.sag)
    assert loads(tiny()).task[0].name in back.u
