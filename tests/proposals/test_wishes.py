"""Proposals compared by several wishes."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from records import entry, task_result
from searches import FEW, TARGET, Runner
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.problem import Problem, loads
from pneumorph.proposals import Target, load_target, propose, search
from pneumorph.proposals.driven import driven
from pneumorph.proposals.proposal import Proposal
from pneumorph.proposals.results import draw_front, words_of_wishes, write_table
from pneumorph.proposals.wishes import amount, best_of, minimised


def test_what_no_other_beats_is_found_and_which_wish_it_wins():
    found = [
        {"mass": 10.0, "-force": 1.0},
        {"mass": 20.0, "-force": 3.0},
        {"mass": 21.0, "-force": 3.0},
        {"mass": 15.0, "-force": 2.0},
        {"mass": 12.0, "-force": np.nan},
    ]
    unbeaten, wins = best_of(("mass", "-force"), found)
    assert unbeaten.tolist() == [True, True, False, True, False]
    assert wins == [["mass"], ["-force"], ["-force"], [], []]


def test_amounts_are_of_the_body_and_of_the_worst_task():
    again = {"name": "again", "objective": {"motion": "extension"}}
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    problem = Problem.model_validate(table | {"task": [*table["task"], table["task"][0] | again]})
    results = {
        "extend": task_result(pressures={"A": 0.03}, volumes={"A": 900.0}, max_stretch=1.2),
        "again": task_result(pressures={"A": -0.05}, volumes={"A": 1200.0}, max_stretch=1.1),
    }
    design = problem, body_of(problem), entry(1, tasks=results)
    assert amount("pressure", *design) == pytest.approx(50.0)
    assert amount("air", *design) == pytest.approx(1.2)
    assert amount("stretch", *design) == pytest.approx(1.2)
    # A tube of 24 mm with a chamber of 18 mm, polygons are a little smaller than circles.
    grams = 1e6 * problem.material.density * np.pi * (64.0 * 24.0 - 16.0 * 18.0)
    assert 0.97 * grams < amount("mass", *design) < 1.001 * grams


def test_a_target_names_its_wishes_once(tmp_path):
    path = tmp_path / "target.toml"
    path.write_text(
        'material = { name = "Hei-Cast 8400" }\nspace = { length = "20 mm", radius = "9 mm" }\n'
        'pressure = { max = "60 kPa" }\nminimize = ["mass", "mass"]\n'
        '[[task]]\nname = "bend"\nobjective = { motion = "bending_y" }\n'
    )
    with pytest.raises(ProblemError, match=r"minimize: .*twice"):
        load_target(path)
    path.write_text(path.read_text().replace('"mass", "mass"', '"mass", "weight"'))
    with pytest.raises(ProblemError, match="minimize"):
        load_target(path)


def test_words_say_what_a_proposal_wins():
    candidate = SimpleNamespace(name="one")
    won = Proposal(candidate, None, None, True, "", {"mass": 12.34, "-force": 1.5}, ("-force",), True)
    assert words_of_wishes(won) == "mass (g) 12.3, blocked force (N) 1.5; best in force"
    assert "another one" in words_of_wishes(Proposal(candidate, None, None, True, "", {"mass": 1.0}))


@pytest.mark.slow
def test_a_search_with_wishes_ranks_what_none_beats_first(tmp_path, monkeypatch):
    """On meshes hardly finer than those of candidates, and without the pictures of the last designs."""
    monkeypatch.setattr(search, "FINER", 0.9)
    target = Target.model_validate(TARGET.model_dump(mode="json") | {"minimize": ["mass", "pressure", "-force"]})
    few = replace(FEW, candidates=2, stages=(1,))
    found = propose(target, tmp_path, few, Runner(tmp_path, looking=False), 1)
    compared = [each for each in found if each.amounts]
    assert len(compared) >= 2 and compared[0].unbeaten
    fronts = [each.unbeaten for each in compared]
    assert fronts == sorted(fronts, reverse=True)
    won = {wish for each in compared for wish in each.wins}
    assert {"mass", "pressure", "-force"} <= won
    assert draw_front("two wishes", compared, tmp_path).exists()
    rows = list(csv.DictReader(write_table(found, tmp_path).open()))
    assert float(rows[0]["mass (g)"]) > 0.0
    # The best of each wish was designed on for it, and bends as far as before.
    for wish in ("mass", "pressure", "-force"):
        word = wish.removeprefix("-")
        [less] = [each for each in compared if each.candidate.name.endswith(f"-{word}")]
        [before] = [each for each in compared if less.candidate.name == f"{each.candidate.name}-{word}"]
        assert minimised(wish, less.amounts[wish]) < minimised(wish, before.amounts[wish])
        one, other = (each.entry.tasks["bend"].rotation[1] for each in (less, before))
        assert one >= 0.999 * other
        assert less.entry.held


def test_the_problem_of_a_wish_holds_what_was_reached():
    def held(objective, done):
        problem = loads(tiny()).with_changes({"task[0].objective": objective})
        return driven(problem, {"extend": task_result(translation=(0.0, 0.0, done))}, "mass")

    further, short = (
        held({"kind": "motion", "extension": "2 mm"}, 2.01),
        held({"kind": "motion", "extension": "2 mm"}, 1.9),
    )
    assert [each.task[0].limits.at_least.extension for each in (further, short)] == pytest.approx([2.0, 1.9], rel=2e-4)
    assert [each.task[0].limits.motion.extension for each in (further, short)] == pytest.approx([2.06, 2.06])
    most = held({"motion": "extension"}, 3.0)
    assert most.task[0].objective.of == "mass" and most.task[0].limits.motion is None
    assert most.task[0].limits.at_least.extension == pytest.approx(3.0, rel=2e-4)
    shorter = held({"kind": "motion", "extension": "-2 mm"}, -2.5)
    assert shorter.task[0].limits.at_least.extension == pytest.approx(-2.0, rel=2e-4)
    assert shorter.task[0].limits.motion.extension == pytest.approx(2.5, rel=2e-4)
    # A motion in the other direction is not held, nor is a curve.
    assert held({"motion": "-extension"}, 1.0) is None
    assert held({"kind": "motion", "extension": "2 mm", "twist": "1 deg"}, 2.0) is None
    assert held({"kind": "reach", "position": ["0 mm", "0 mm", "26 mm"]}, 2.0) is None


def test_of_several_motions_each_is_held():
    problem = loads(tiny()).with_changes(
        {"task[0].objective": {"kind": "motion", "extension": "2 mm", "shift_x": "1 mm", "bending_y": "0 deg"}}
    )
    result = task_result(translation=(1.005, 0.0, 1.9), rotation=(0.0, 0.0, 0.0))
    [task] = driven(problem, {"extend": result}, "mass").task
    assert dict(task.limits.at_least)["extension"] == pytest.approx(1.9, rel=2e-4)
    assert dict(task.limits.at_least)["shift_x"] == pytest.approx(1.0, rel=2e-4)
    # One that is to be zero may be as large as what counts as none.
    assert dict(task.limits.motion)["bending_y"] == pytest.approx(0.001, rel=1e-6)
    assert [dict(task.limits.motion)[name] for name in ("shift_x", "extension")] == pytest.approx([1.03, 2.06])


def test_for_the_force_the_tip_is_held_at_the_same_pressures():
    free = {"start": "20 kPa", "min": "0 kPa", "max": "60 kPa"}
    problem = loads(tiny()).with_changes({"task[0].pressure": {"A": free}, "task[0].force": ["0 N", "0 N", "-0.1 N"]})
    result = task_result(translation=(0.0, 0.0, -1.5))
    shorter = problem.with_changes({"task[0].objective": {"motion": "-extension"}})
    own, press = driven(shorter, {"extend": result}, "-force").task
    assert own.limits.at_least.extension == pytest.approx(-1.5, rel=2e-4) and own.weight < 1e-3 < press.weight
    assert press.pressures_of == "extend" and press.pressure == own.pressure and press.force == own.force
    assert press.objective.motion == "-extension" and press.hold.values == {"axial": 0.0}
    # Where the tip does not move it presses nowhere.
    assert driven(shorter, {"extend": task_result(translation=(0.0, 0.0, -0.01))}, "-force") is None
