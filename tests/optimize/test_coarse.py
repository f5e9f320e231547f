"""Runs whose first designs are on elements larger than those asked for."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from designing import BRIEFLY, accepted
from texts import EXTEND, problem_text

from pneumorph.errors import Hopeless, MeshError, ProblemError
from pneumorph.optimize import (
    DesignAccepted,
    Finished,
    NotRefined,
    Refined,
    Served,
    Started,
    acceptance,
    coarse,
    design,
    loop,
    trial,
)
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.coarse import coarse_setup, has_served, refined, serves
from pneumorph.optimize.iterate import Learnt
from pneumorph.optimize.record import StepRecord, checkpoint
from pneumorph.optimize.settings import CoarseSettings
from pneumorph.optimize.setup import Setup, build_setup
from pneumorph.optimize.start import resumed
from pneumorph.optimize.stopping import conclusion
from pneumorph.problem import loads

FILE = problem_text(
    EXTEND
    + """
[mesh]
size = "4 mm"
[optimizer]
iterations = 4
""",
    40,
    chambers=(("A", 5, "0 mm", "0 mm"),),
    body='control_density = "0.6 /mm"\nsymmetry = { mirror = ["xz", "yz"] }',
)
SMALL = replace(BRIEFLY, coarse=CoarseSettings(fewest=4, least=100))
"""A body so small that it would have none of the larger elements otherwise."""
WHY, BEFORE = "a test says so", StepRecord(3, remeshed=True)


@pytest.fixture(scope="module")
def problem():
    return loads(FILE)


@pytest.fixture(scope="module")
def events(problem):
    return list(design(problem, settings=SMALL))


@pytest.fixture(scope="module")
def setups(problem):
    setup = build_setup(problem, SMALL)
    return setup, coarse_setup(setup)


@pytest.fixture(scope="module")
def last(setups, events):
    """The last design on larger elements, as a run goes on with it, and the checkpoints before it."""
    states = [event.state for event in accepted(events)[:3]]
    return resumed(setups[1], states[-1]), states[:-1]


def of(kind, events):
    return [event for event in events if isinstance(event, kind)]


def test_the_last_designs_are_on_the_elements_asked_for(problem, events):
    """Three quarters of the designs are on larger ones; then one is analysed on smaller ones, and steps go on there."""
    (change,) = of(Refined, events)
    designs = accepted(events)
    elements = [event.entry.elements for event in designs]
    assert (change.iteration, change.shape, change.size) == (3, 3, problem.mesh.size)
    (begun,) = of(Started, events)
    assert (begun.elements, begun.larger) == (elements[0], 1.5 * problem.mesh.size)
    assert elements[3] == elements[4] == change.elements > 1.5 * elements[0]
    assert designs[3].entry.remeshed
    assert designs[3].entry.step > 0.0
    assert [event.state["coarse"] for event in designs] == [True, True, True, False, False]
    assert all(after.entry.objective < before.entry.objective for before, after in pairwise(designs))
    assert events[-1].iteration == 4


def test_objectives_of_before_are_those_of_the_elements_asked_for(events):
    """Else a run could take what smaller elements change for what a step gains."""
    designs = accepted(events)
    before, after = designs[2].state["values"], designs[3].state["values"]
    assert len(after) == len(before) + 1
    assert np.diff(after[:-1]) == pytest.approx(np.diff(before), rel=1e-12)
    assert after[-1] == designs[3].entry.objective


def test_a_run_goes_on_where_it_was(problem, events):
    """On larger elements, where it was stopped there, with the same designs."""
    designs = accepted(events)
    again = accepted(list(design(problem, designs[1].state, SMALL)))
    assert [event.state["coarse"] for event in again] == [True, False, False]
    assert again[0].entry.objective == pytest.approx(designs[2].entry.objective, rel=1e-5)
    # Rounding errors may decide how a body is meshed.
    assert again[-1].entry.objective == pytest.approx(designs[-1].entry.objective, rel=0.01)
    assert len(accepted(list(design(problem, designs[3].state, SMALL)))) == 1


def test_a_shape_that_is_not_sound_on_smaller_elements_is_left(setups, last, monkeypatch):
    """The one before it follows, in a region half as large."""
    setup, larger = setups
    current, passed = last
    asked = iter([True, False])
    monkeypatch.setattr(coarse, "buckles", lambda now, after: next(asked))
    events, found = followed(refined(setup, larger, current.learning(radius=2.0), passed, 3, WHY, BEFORE, Clock()))
    (why,), (no,), (yes,) = of(Served, events), of(NotRefined, events), of(Refined, events)
    assert (why.iteration, why.reason) == (2, WHY)
    assert (no.iteration, no.reason) == (2, "it would buckle laterally")
    assert (yes.iteration, yes.shape, found.number) == (3, 1, 3)
    assert np.array_equal(found.analysis.phi, passed[1]["phi"])
    assert "larger" not in conclusion(setup, found, "", {"extend": True})
    assert (found.learnt.radius, found.learnt.stride) == (1.0, Learnt.stride)
    assert len(found.learnt.objectives) == 2


def test_where_no_shape_is_sound_a_run_stays_on_larger_elements(problem, setups, last, monkeypatch):
    setup, larger = setups
    current, passed = last
    monkeypatch.setattr(coarse, "buckles", lambda now, after: True)
    events, found = followed(refined(setup, larger, current, passed, 3, WHY, BEFORE, Clock()))
    assert found is None
    assert [event.iteration for event in events] == [2, 2, 1]

    def lost(setup, state):
        raise ProblemError("a test says so")

    monkeypatch.setattr(coarse, "restored", lost)
    events, found = followed(refined(setup, larger, current, passed, 3, WHY, BEFORE, Clock()))
    assert found is None
    assert [event.iteration for event in events] == [2, 2]

    def none(setup, body, finest, like=None):
        raise MeshError("a test says so")

    monkeypatch.setattr(type(setup), "discretise", none)
    events, found = followed(refined(setup, larger, current, (), 3, WHY, BEFORE, Clock()))
    assert found is None
    assert [event.reason for event in events] == [WHY, "a test says so"]


def test_a_run_goes_on_with_larger_elements_where_it_has_to(problem, monkeypatch, events):
    monkeypatch.setattr(loop, "refined", lambda *given: iter(()))
    following = list(design(problem, accepted(events)[2].state, SMALL))
    found = accepted(following)
    assert [event.iteration for event in found] == [3, 4]
    assert "its elements are larger than those asked for" in following[-1].reason
    assert all(event.state["coarse"] for event in found)


def test_a_start_without_a_state_on_larger_elements_begins_on_those_asked_for(problem, monkeypatch):
    begun = loop.start

    def start(setup, clock):
        if setup.coarse:
            raise Hopeless("a test says so")
        return begun(setup, clock)

    monkeypatch.setattr(loop, "start", start)
    following = design(problem, settings=SMALL)
    assert not next(event for event in following if isinstance(event, DesignAccepted)).state["coarse"]


def test_why_larger_elements_have_served(setups, last):
    _, larger = setups
    current = last[0]
    late, early = replace(current, number=3), replace(current, number=1)
    assert has_served(larger, late) == "75 % of the designs are made"
    assert has_served(larger, early) is None
    settings = replace(larger.settings, until=0.0)
    assert has_served(replace(larger, settings=settings), early) == "time is short"
    morph = replace(early.disc.morph, size=4.0)
    there = replace(early.design, disc=replace(early.disc, morph=morph))
    assert has_served(larger, replace(early, design=there)) == "larger ones would not mesh this body"
    motion = 'objective = { kind = "motion", extension = "9 mm" }'
    aimed = loads(FILE.replace('objective = { kind = "maximize", motion = "extension" }', motion))
    near = replace(larger, problem=aimed)
    first, *_ = current.learnt.objectives
    assert has_served(near, early.learning(objectives=(first, 0.011 * abs(first)))) is None
    assert has_served(near, early.learning(objectives=(first, 0.009 * abs(first)))) == "the targets are near"


def test_smaller_elements_decide_what_stops_a_step(problem, monkeypatch):
    """A step that is rejected for its states ends the larger elements."""
    monkeypatch.setattr(acceptance, "buckles", lambda now, after: True)
    following = design(problem, settings=SMALL)
    designs, change, why = [], None, None
    for event in following:
        change = event if isinstance(event, Refined) else change
        why = event if isinstance(event, Served) else why
        designs += accepted([event])
        if len(designs) == 2:
            break
    assert (change.iteration, change.shape) == (1, 0)
    assert why.reason == "a step on larger ones was rejected: it would buckle laterally"
    assert [event.state["coarse"] for event in designs] == [True, False]


def test_no_mesh_of_larger_elements_is_finer_than_asked_for(setups, last, monkeypatch):
    """Where larger ones do not mesh a body, those asked for are to do that."""
    asked, discretise = [], Setup.discretise

    def recorded(setup, body, finest, like=None):
        asked.append(finest)
        return discretise(setup, body, finest, like)

    monkeypatch.setattr(trial, "needs_remesh", lambda morph, points: "a test says so")
    monkeypatch.setattr(trial, "quality", lambda disc, points: 0.01)
    monkeypatch.setattr(Setup, "discretise", recorded)
    now = last[0].design
    for setup in setups:
        list(trial.analyse_trial(setup, 3, now, now.analysis.phi + 1e-3, 3.0, Clock()))
    assert asked == [0.0, setups[0].problem.mesh.size]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("iterations = 4", "iterations = 3"),
        ('size = "4 mm"', 'size = "8 mm"'),
        ('size = "4 mm"', 'size = "4 mm"\nerror = "3 %"'),
    ],
    ids=["few designs", "few elements", "an error of the mesh is asked for"],
)
def test_where_no_larger_elements_serve(old, new):
    problem = loads(FILE.replace(old, new))
    larger = coarse_setup(build_setup(problem, SMALL))
    assert larger is None or not serves(larger)


def test_a_checkpoint_tells_which_elements_there_are(setups, last):
    setup, larger = setups
    assert checkpoint(larger, last[0])["coarse"]
    assert not checkpoint(setup, last[0])["coarse"]


def followed(following):
    """The events of a generator, and what it returns."""
    events = []
    while True:
        try:
            events.append(next(following))
        except StopIteration as end:
            return [event for event in events if not isinstance(event, (DesignAccepted, Finished))], end.value
