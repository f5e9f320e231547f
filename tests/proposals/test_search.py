"""A search on bodies so small that each design takes a second."""

import csv
import dataclasses
from pathlib import Path
from types import SimpleNamespace

import pytest
from searches import FEW, TARGET, Runner

from pneumorph.optimize.settings import LoopSettings
from pneumorph.proposals import Plan, Proposal, Target, propose, search
from pneumorph.proposals.candidates import draw_candidates
from pneumorph.proposals.proposal import best_first
from pneumorph.proposals.results import reaches, sheet_rows, write_table
from pneumorph.proposals.stage import Clock, Search, cut_short, promised
from pneumorph.run import open_run
from pneumorph.study.members import MemberEnd, run_member


@pytest.fixture(autouse=True)
def hardly_finer(monkeypatch):
    """Meshes of proposals are a little finer than those of candidates."""
    monkeypatch.setattr(search, "FINER", 0.9)


@pytest.mark.slow
def test_the_best_go_on_and_a_search_is_taken_up_again(tmp_path):
    runner, said = Runner(tmp_path), []
    found = propose(TARGET, tmp_path, FEW, runner, 1, said.append)
    finals = [each for each in found if each.final]
    assert len(found) == 4 and len(finals) == 2 and found[:2] == finals
    assert finals[0].entry.objective <= finals[1].entry.objective
    assert len(said) == 2
    # Everything that did not go on says why.
    assert all(each.lost for each in found[2:]) and not any(each.lost for each in finals)
    # The best after the first comparison is at least as good as those that were left then.
    first = {each.candidate.name: open_run(each.run).history()[-1].objective for each in found[2:] if each.run}
    assert first
    for each in finals:
        assert each.run.name == f"{each.candidate.name}-fine"
        assert open_run(each.run).problem.mesh.size < each.candidate.posed.mesh.size
        assert reaches(each) is None
        assert "°" in each.achieved
    rows = list(csv.DictReader(write_table(found, tmp_path).open()))
    assert [row["candidate"] for row in rows] == [each.candidate.name for each in found]
    assert [row["went on"] for row in rows].count("to the end") == 2
    assert all("mould" in row["making"] for row in rows[:2]) and not any(row["making"] for row in rows[2:])
    sheet = list(sheet_rows(finals))
    assert [each[0] for each in sheet] == [each.run.name for each in finals]
    assert all("±" in result and margin for _, result, _, margin, *_ in sheet)

    again = Runner(tmp_path)
    repeated = propose(TARGET, tmp_path, FEW, again, 1)
    assert again.names == []
    assert [each.candidate.name for each in repeated] == [each.candidate.name for each in found]


def test_the_last_gain_goes_on():
    assert promised([-1.0, -2.0, -4.0], 4) == -12.0
    # One that became worse, or has its start alone, promises what it has.
    assert promised([-1.0, -4.0, -3.0], 4) == -3.0
    assert promised([-1.0], 4) == -1.0
    assert promised([9.0, 4.0], 4, least=0.0) == 0.0


def known_search(target, objectives):
    """A search whose candidates have these objectives, and the candidates."""
    going = list(draw_candidates(target, len(objectives), 1))
    known = {each.name: own for each, own in zip(going, objectives, strict=True)}

    class Known(Search):
        def entries(self, name, designs):
            return [SimpleNamespace(objective=own, iteration=k) for k, own in enumerate(known[name])][: designs + 1]

        def achieved(self, candidate, designs):
            return f"{self.value(candidate, designs):g}"

    return Known(target, Plan(), Path(), Runner(Path()), 1, Clock(1.0, 1), print), going


def test_candidates_are_compared_by_what_they_promise():
    search, going = known_search(TARGET, ([-0.1, -0.3, -0.35], [-0.0, -0.05, -0.2], [-0.0, -0.01, -0.02], []))
    assert [going.index(each) for each in search.ranked(going, 2, 6)] == [1, 0, 2, 3]
    # Where no more designs come, what they do counts.
    assert [going.index(each) for each in search.ranked(going, 2, 2)] == [0, 1, 2, 3]
    why = search.behind(going[0], going[1:2], 2, 6)
    assert why == f"after 2 designs -0.35, where {going[1].name} had -0.2 and gained more in its last one"
    assert "gained" not in search.behind(going[2], going[1:2], 2, 6)


def test_no_more_than_the_target_is_promised():
    goal = {"name": "bend", "objective": {"kind": "motion", "bending_y": "30 deg"}}
    target = Target.model_validate(TARGET.model_dump(mode="json", exclude_unset=True) | {"task": [goal]})
    search, going = known_search(target, ([0.3, 0.2, 0.1], [0.3, 0.2, 0.01], [0.3, 0.2, 0.19]))
    # Both of the first will be there; the nearer one is better.
    assert [going.index(each) for each in search.ranked(going, 2, 6)] == [1, 0, 2]


def test_without_time_nothing_is_begun_and_each_candidate_says_so(tmp_path):
    runner = Runner(tmp_path)
    found = propose(TARGET, tmp_path, Plan(candidates=3, minutes=0.0), runner, 1)
    assert runner.names == []
    assert all("no time" in each.lost for each in found)
    assert not any(each.final for each in found)


@pytest.mark.slow
def test_what_has_begun_ends_when_its_time_is_up_and_goes_on_later(tmp_path, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.time", lambda: now[0])
    names = []

    def slow(members, drawn):
        for each, settings in members:
            names.append(each.name)

            def later(name, entry):
                now[0] += 3600.0 * entry.iteration

            own = dataclasses.replace(settings, looked_at=False)
            yield run_member(each.name, each.problem, str(tmp_path / each.name), later, False, None, own)

    found = propose(TARGET, tmp_path, Plan(candidates=2, seed=1, minutes=30.0, stages=(2,), designs=2), slow, 1)
    # Time was up after the first design of the first, before the second had begun, with none left for the finer mesh.
    [first] = names
    run = open_run(tmp_path / first)
    assert cut_short(run) and run.history()[-1].iteration == 1
    assert {each.lost for each in found} == {"there was no time for 2 designs", "there was no time for the finer mesh"}
    monkeypatch.undo()
    again = Runner(tmp_path, looking=False)
    # The same plan, with more time: what was cut short goes on.
    propose(TARGET, tmp_path, Plan(candidates=2, seed=1, minutes=60.0, stages=(2,), designs=1), again, 1)
    names = {each.candidate.name for each in found}
    assert names < set(again.names)
    assert all(open_run(tmp_path / name).history()[-1].iteration > 1 for name in names)
    assert not any(cut_short(open_run(tmp_path / name)) for name in names)


def test_the_best_comes_first_also_where_it_did_not_come_to_the_finer_mesh():
    [candidate] = draw_candidates(TARGET, 1, 1)
    coarse, fine = (SimpleNamespace(objective=own) for own in (-0.85, -0.56))
    given = [Proposal(candidate, None, None, False), Proposal(candidate, None, fine, True)]
    given.append(Proposal(candidate, None, coarse, False))
    assert best_first(given) == given[::-1]


@pytest.mark.slow
def test_a_comparison_that_has_no_time_loses_nobody(tmp_path, monkeypatch):
    now, inner = [0.0], Runner(tmp_path, looking=False)
    monkeypatch.setattr("time.time", lambda: now[0])

    def slow(members, drawn):
        yield from inner(members, drawn)
        # After the time of the second comparison, before that of the finer mesh.
        now[0] = 0.7 * 60.0 * FEW.minutes

    found = propose(TARGET, tmp_path, dataclasses.replace(FEW, candidates=2), slow, 1)
    assert [each.final for each in found] == [True, True]
    assert not any("time" in each.lost for each in found)
    assert [open_run(tmp_path / each.candidate.name).latest() for each in found] == [1, 1]


def failed(name):
    """The end of a candidate without a state."""
    return MemberEnd(name, False, "no equilibrium was found")


def test_each_candidate_may_take_its_share_of_the_time_that_is_left(tmp_path):
    given = []

    def failing(members, drawn):
        for each, settings in members:
            given.append(settings.seconds)
            yield failed(each.name)

    propose(TARGET, tmp_path, Plan(candidates=6, minutes=30.0), failing, 2)
    # A third of the time is for the first comparison. What a candidate leaves is for those after it.
    assert given == pytest.approx([2 * 600.0 / left for left in (6, 5, 4, 3, 2)] + [600.0], abs=10.0)


def test_no_candidate_waits_until_others_have_ended(tmp_path):
    begun = []

    def all_at_once(members, drawn):
        begun.append([each.name for each, _ in members])
        yield from map(failed, begun[-1])

    propose(TARGET, tmp_path, Plan(candidates=6), all_at_once, 1)
    assert [len(names) for names in begun] == [6]


@pytest.mark.slow
def test_a_run_ends_after_its_own_time(tmp_path):
    problem = next(draw_candidates(TARGET, 1, 1)).posed.with_changes({"optimizer.iterations": 3})
    end = run_member("one", problem, str(tmp_path / "one"), lambda *_: None, False, None, LoopSettings(seconds=0.0))
    run = open_run(tmp_path / "one")
    assert end.completed and cut_short(run) and len(run.history()) == 1


def test_a_candidate_that_fails_is_lost_with_its_reason(tmp_path):
    def failing(members, drawn):
        return (failed(each.name) for each, _ in members)

    found = propose(TARGET, tmp_path, Plan(candidates=3), failing, 1)
    assert [each.lost for each in found] == ["no equilibrium was found"] * 3
