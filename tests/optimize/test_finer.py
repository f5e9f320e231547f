"""Designs whose elements are divided until the error of the mesh is as small as asked for."""

from dataclasses import replace

import numpy as np
import pytest
from texts import problem_text

from pneumorph.analysis import (
    analyse,
    checkpoint,
    divided,
    is_estimated,
    joined,
    largest_share,
    quick_errors,
    recorded_share,
    to_divide,
)
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh.refine import refine
from pneumorph.optimize import DesignAccepted, Divided, Finished, NotDivided, design, finer, loop, start, trial
from pneumorph.optimize.buckling import judge
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.finer import with_finer_mesh
from pneumorph.optimize.iterate import AnalysedDesign, Learnt, evaluate, unpack_learnt
from pneumorph.optimize.model import no_curvature
from pneumorph.optimize.settings import LoopSettings
from pneumorph.optimize.setup import build_setup
from pneumorph.problem import loads

TASK = """
[[task]]
name = "move"
pressure = { A = "40 kPa" }
objective = { motion = "extension" }
[mesh]
size = "8 mm"
element = "ELEMENT"
error = "ERROR"
[optimizer]
iterations = 2
"""


class Coarse:
    """A start on a mesh whose error is larger than is asked for."""

    def __init__(self, element="quadratic", error="3 %"):
        text = TASK.replace("ELEMENT", element).replace("ERROR", error)
        self.problem = loads(problem_text(text, radius=10, body='symmetry = { mirror = ["xz", "yz"] }'))
        self.setup = build_setup(self.problem)
        self.phi = self.setup.space.start
        self.disc = self.setup.discretise(self.setup.space.body(self.phi), 0.0)
        self.analysis = analyse(self.problem, self.setup.space, self.disc, self.phi)
        self.errors = quick_errors(self.problem, self.disc, self.analysis)
        self.share = largest_share(self.problem, self.errors)

    def iterate(self):
        lateral = judge(self.disc, self.analysis, {})
        now = AnalysedDesign(self.analysis, self.disc, self.setup.certify(self.phi), lateral)
        learnt = Learnt(self.setup.stepper, no_curvature(self.setup.space.n), 1.0, (1.0,))
        found = evaluate(self.setup, 5, now, learnt, Clock())
        return found.__class__(**(vars(found) | {"errors": self.errors}))


@pytest.fixture(scope="module")
def coarse():
    return Coarse()


@pytest.fixture(scope="module")
def fine():
    """A design on a mesh that has been divided for an error of 2 %."""
    coarse = Coarse(error="2 %")
    list(follow := Kept(with_finer_mesh(coarse.setup, coarse.iterate(), Clock())))
    return coarse, follow.value


@pytest.mark.parametrize(("element", "error"), [("quadratic", "3 %"), ("mixed", "1 %")])
def test_the_elements_that_contribute_most_are_divided(element, error):
    """Some of the elements are worth half of a uniform refinement."""
    coarse = Coarse(element, error)
    problem, disc, analysis = coarse.problem, coarse.disc, coarse.analysis
    assert coarse.share > problem.mesh.error
    marked = to_divide(problem, disc, analysis, coarse.errors)
    assert 0 < len(marked) < 0.45 * disc.model.elements
    new, states = divided(problem, disc, analysis, marked, ())
    there = analyse(problem, coarse.setup.space, new, coarse.phi, states, most=6)
    assert not isinstance(there, NoEquilibrium)
    gained = there.equilibria["move"].plate[2] - analysis.equilibria["move"].plate[2]
    of_all, all_states = divided(problem, disc, analysis, np.arange(disc.model.elements), ())
    assert of_all.model.elements == len(refine(disc.morph.mesh).mesh.tets)
    uniform = analyse(problem, coarse.setup.space, of_all, coarse.phi, all_states)
    most = uniform.equilibria["move"].plate[2] - analysis.equilibria["move"].plate[2]
    assert 0.4 * most < gained < most and new.model.elements < 0.65 * of_all.model.elements


def test_nothing_is_divided_where_the_error_is_small_enough_or_unknown(coarse):
    arguments = (coarse.disc, coarse.analysis)
    assert not len(to_divide(coarse.problem, *arguments, {}))
    assert not len(to_divide(coarse.problem.with_changes({"mesh.error": "50 %"}), *arguments, coarse.errors))
    assert not len(to_divide(coarse.problem.with_changes({"mesh.error": False}), *arguments, coarse.errors))


def test_a_design_that_has_outgrown_its_mesh_gets_smaller_elements(coarse):
    """Its error is as asked for afterwards, and so it is after remeshing."""
    problem, setup, current = coarse.problem, coarse.setup, coarse.iterate()
    events = list(follow := Kept(with_finer_mesh(setup, current, Clock())))
    after = follow.value
    assert events and all(isinstance(event, Divided) for event in events)
    assert events[0].share == coarse.share and events[-1].elements == after.disc.model.elements
    assert largest_share(problem, after.errors) <= 0.03
    # What earlier designs gained stays.
    (before, own) = after.learnt.objectives
    assert own == after.analysis.value and own - before == pytest.approx(coarse.analysis.value - 1.0)
    P = coarse.analysis.points
    again = setup.discretise(setup.space.body(coarse.phi), 0.0, after.disc.morph.at(P))
    assert 0.6 < again.model.elements / after.disc.model.elements < 1.6
    arrays = checkpoint.pack(after.analysis, after.disc)
    restored, analysis = checkpoint.unpack(problem, setup.space, arrays)
    np.testing.assert_array_equal(restored.morph.mesh.halved, after.disc.morph.mesh.halved)
    assert analysis.value == pytest.approx(after.analysis.value, rel=1e-5)


def test_a_new_mesh_has_larger_elements_where_little_of_a_small_error_comes_from(fine):
    """Where elements are joined, those that contribute least; the error is no more than asked for with many fewer."""
    coarse, now = fine
    halved = now.disc.morph.mesh.halved
    np.testing.assert_array_equal(joined(coarse.problem, now.disc, now.analysis), halved)
    assert joined(coarse.problem, coarse.disc, coarse.analysis) is None
    asked = (coarse.problem.with_changes({"mesh.error": each}) for each in ("3 %", "6 %"))
    some, more = (joined(problem, now.disc, now.analysis) for problem in asked)
    for fewer in (some, more):
        assert fewer.min() >= 0.0 and set(np.round(3 * (halved - fewer)).astype(int)) <= {0, 1, 2, 3}
    assert 0 < np.count_nonzero(some < halved) < np.count_nonzero(more < halved) < len(halved)


def test_where_a_body_is_meshed_anew_its_elements_are_those_that_it_needs_now(fine, monkeypatch):
    coarse, now = fine
    monkeypatch.setattr(trial, "needs_remesh", lambda *_: "it is asked for")
    found = {}
    for error in ("2 %", "6 %"):
        setup = build_setup(coarse.problem.with_changes({"mesh.error": error}))
        list(follow := Kept(trial.analyse_trial(setup, 6, now.design, coarse.phi, 3.0, Clock())))
        there = follow.value
        assert there.remeshed and there.analysis is not None
        share = largest_share(setup.problem, quick_errors(setup.problem, there.disc, there.analysis))
        found[error] = there.disc.model.elements, share
    elements, share = found["6 %"]
    assert elements < 0.6 * found["2 %"][0]
    assert found["2 %"][1] < share <= 0.06


def test_a_design_without_a_state_on_the_finer_mesh_keeps_its_own_and_says_so(coarse, monkeypatch):
    monkeypatch.setattr(finer, "analyse", lambda *_, **__: NoEquilibrium("task move: it balloons", 0.5, None))
    current = coarse.iterate()
    (event,) = list(follow := Kept(with_finer_mesh(coarse.setup, current, Clock())))
    assert isinstance(event, NotDivided) and event.share == coarse.share and "it balloons" in event.reason
    assert follow.value is current


def test_errors_are_estimated_where_a_design_may_have_outgrown_its_mesh(coarse):
    problem, before = coarse.problem.with_changes({"optimizer.iterations": 12}), np.array([2.0, 1.0])
    same, grown = np.array([2.9, 1.4]), np.array([2.0, 1.6])
    assert [is_estimated(problem, number, same, before) for number in (3, 4, 5, 12)] == [False, False, True, True]
    assert is_estimated(problem, 6, grown, before) and is_estimated(problem, 6, same, before, remeshed=True)
    assert not is_estimated(problem, 3, grown, before) and not is_estimated(problem, 6, same, before)
    assert is_estimated(problem, 3, same, np.zeros(0))
    without = problem.with_changes({"mesh.error": False})
    assert not any(is_estimated(without, number, grown, before, remeshed=True) for number in (0, 6, 12))


def test_a_run_begins_and_ends_with_the_error_that_is_asked_for(coarse):
    events = list(design(coarse.problem))
    accepted = [event for event in events if isinstance(event, DesignAccepted)]
    assert isinstance(events[0], Divided) and len(accepted) == 3
    assert accepted[0].entry.elements > coarse.disc.model.elements
    assert not accepted[1].entry.finer
    for entry in (accepted[0].entry, accepted[2].entry):
        assert recorded_share(coarse.problem, entry) <= 0.03


def test_a_run_that_ends_early_goes_on_with_its_last_design_on_a_finer_mesh(coarse, monkeypatch):
    """Where no design was looked at, the last one is, and follows once more."""
    for module in (loop, start):
        monkeypatch.setattr(module, "with_errors", lambda setup, current, remeshed=False: current)
    problem = coarse.problem.with_changes({"optimizer.iterations": 9})
    few = replace(LoopSettings(), stopping=replace(LoopSettings().stopping, designs=1, progress=1e9))
    events = list(design(problem, settings=few))
    accepted = [event for event in events if isinstance(event, DesignAccepted)]
    assert [event.iteration for event in accepted] == [0, 1] and isinstance(events[-1], Finished)
    coarser, last = (event.entry for event in accepted)
    assert not coarser.finer and recorded_share(problem, last) <= 0.03 and last.elements > coarser.elements
    np.testing.assert_array_equal(accepted[0].state["phi"], accepted[1].state["phi"])


def test_what_was_looked_at_last_is_known_after_resuming(coarse):
    first = next(event for event in design(coarse.problem) if isinstance(event, DesignAccepted))
    here = first.entry.tasks["move"]
    assert first.state["looked"] == pytest.approx([np.hypot(*here.translation[::2])], rel=1e-6)
    assert unpack_learnt(coarse.setup, first.state).looked == pytest.approx(first.state["looked"])


class Kept:
    """A generator whose value is kept."""

    def __init__(self, of):
        self._of, self.value = of, None

    def __iter__(self):
        self.value = yield from self._of
