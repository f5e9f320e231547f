"""Starts that move the way that their tasks ask, and what is said of those that do not."""

from pathlib import Path

import pytest

from pneumorph.analysis import analyse_body, collect_task_results
from pneumorph.geometry.starting import body_of
from pneumorph.optimize.prospects import backwards
from pneumorph.problem import load

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
