"""Starts that move the way that their tasks ask, and what is said of those that do not."""

from pathlib import Path

import pytest
from texts import problem_text

import pneumorph as pm
from pneumorph.analysis import analyse_body, collect_task_results
from pneumorph.geometry.starting import body_of
from pneumorph.optimize.prospects import backwards
from pneumorph.problem import load, loads

ROOT = Path(__file__).parents[2]
TWISTING = (ROOT / "src/pneumorph/problem/starts/twist.toml",)


def said(problem):
    at = analyse_body(problem, body_of(problem))
    [result] = collect_task_results(at.disc, at.analysis).values()
    return result.rotation[2], list(backwards(problem, problem.task[0], result))


@pytest.mark.parametrize("path", TWISTING, ids=lambda path: path.stem)
def test_bodies_that_are_to_twist_begin_in_the_sense_that_is_asked(path):
    problem = load(path).with_changes({"mesh.size": "6 mm"})
    ripple = problem.tubes.ripple
    assert ripple is not None
    angle, sentences = said(problem)
    assert angle > 0.0 and not sentences
    other, words = said(problem.with_changes({"body.ripple.lobes": -ripple.lobes}))
    assert other == pytest.approx(-angle, rel=0.1)
    assert words == [
        "twist goes the other way at first, and designs have to turn it round; "
        "try body.ripple.lobes with the other sign"
    ]
    asked = {"body.ripple.lobes": -ripple.lobes, "task[0].objective.motion": "-twist"}
    assert said(problem.with_changes(asked))[1] == []


def test_a_run_that_ends_without_pressure_says_why(tmp_path):
    """It begins the other way, so that its pressure falls before its shape turns it round."""
    task = """
[[task]]
name = "bend"
pressure = { A = { start = "1 kPa", min = "0 kPa", max = "20 kPa" } }
objective = { kind = "motion", bending_y = "ANGLE deg" }
[mesh]
size = "8 mm"
"""
    reasons = {}
    for angle in ("10", "-10"):
        problem = loads(problem_text(task.replace("ANGLE", angle), chambers=(("A", 4, "1 mm", "0 mm"),)))
        run = pm.design(problem.with_changes({"optimizer.iterations": 1}), out=tmp_path / angle)
        reasons[run.best.pressures["bend"]["A"] > 0.0] = run.result.reason
    assert "the pressures of task bend have ended at 0 kPa" in reasons[False]
    assert "0 kPa" not in reasons[True]
