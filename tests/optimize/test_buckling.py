"""Designs of which part is solved do not buckle laterally, and a stopped run goes on with what it knew of that."""

from types import SimpleNamespace

import numpy as np
import pytest
from designing import BRIEFLY, accepted
from texts import problem_text
from tiny import REST

from pneumorph.analysis import lateral_stiffness
from pneumorph.errors import ProblemError
from pneumorph.optimize import DesignAccepted, DesignRejected, Finished, acceptance, buckling, design
from pneumorph.problem import loads

COLUMN = problem_text(
    REST.replace('"0 N/mm"', '"0.5 N/mm"').replace('"6 mm"', '"4 mm"').replace("= 2", '= 5\nstep = "0.3 mm"'),
    length=80,
    radius=5,
    chambers=(("A", 3, "0 mm", "0 mm"),),
    body='control_density = "0.4 /mm"\nripple = { amplitude = "0.3 mm", period = "10 mm" }\n'
    'symmetry = { mirror = ["xz", "yz"] }',
)
"""A slender tube that pushes against a spring without a guide: as it becomes a bellows, it comes to buckle."""

BUCKLES = "it would buckle laterally"


@pytest.fixture(scope="module")
def events():
    return list(design(loads(COLUMN), settings=BRIEFLY))


def test_designs_are_stable_against_all_motions(events):
    rejected = [event for event in events if isinstance(event, DesignRejected) and event.reason == BUCKLES]
    assert rejected, "the column would not have buckled"
    finished = events[-1]
    assert isinstance(finished, Finished) and finished.stable == {"extend": True}
    first = next(event.iteration for event in rejected)
    objectives = [event.entry.objective for event in accepted(events)]
    assert len(objectives) > first + 1, "the steps after it lead on"
    assert objectives[-1] < 1.1 * objectives[first - 1] < 0.0


def test_without_that_they_would_buckle(events, monkeypatch):
    monkeypatch.setattr(acceptance, "buckles", lambda now, after: False)
    first = next(event.iteration for event in events if isinstance(event, DesignRejected) and event.reason == BUCKLES)
    before = next(event for event in accepted(events) if event.iteration == first - 1)
    finished = list(design(loads(COLUMN), before.state, BRIEFLY))[-1]
    assert isinstance(finished, Finished) and finished.stable == {"extend": False}
    assert "buckles laterally" in finished.reason


def test_a_body_far_from_buckling_is_judged_once_in_several_designs(monkeypatch):
    """A tube that nothing pushes against: its pressure pulls it straight."""
    judged = []

    def counted(disc, analysis, at_rest=False):
        judged.append(analysis)
        return lateral_stiffness(disc, analysis, at_rest)

    monkeypatch.setattr(buckling, "lateral_stiffness", counted)
    problem = loads(COLUMN.replace('"0.5 N/mm"', '"0 N/mm"').replace("= 5\n", "= 6\n"))
    events = list(design(problem, settings=BRIEFLY))
    tried = len(accepted(events)) - 1 + sum(isinstance(event, DesignRejected) for event in events)
    assert tried >= 6 and len(judged) <= 2 + tried // (1 + buckling.LATERAL.unjudged)
    assert judged[-1].value == pytest.approx(accepted(events)[-1].entry.objective), "the last design is judged"
    finished = events[-1]
    assert isinstance(finished, Finished) and finished.stable == {"extend": True}


def test_a_body_that_has_come_near_to_buckling_is_judged_from_then_on(monkeypatch):
    """Though more load seems to make a later design stiffer, as it does to a bent body that buckles a design after."""
    multiples = {"far": 4.0, "near": 1.3, "stiffened": np.inf}
    judged = []

    def told(disc, analysis, at_rest):
        judged.append(analysis)
        return buckling.LateralStability({}, {}, at_rest, multiples[analysis])

    monkeypatch.setattr(buckling, "judge", told)
    known = told(None, "far", {})
    for analysis in ("stiffened", "near", "near", "near", "near", "stiffened", "stiffened"):
        known = buckling.judge_after(None, analysis, known)
    assert judged == ["far", "near", "stiffened", "stiffened"]
    again = buckling.recall(SimpleNamespace(tangents=(), lateral=()), "stiffened", known.pack())
    assert (again.load, again.unjudged) == (known.load, 0) == (1.3, 0)


def test_a_stopped_run_goes_on_in_the_same_way(events):
    known = accepted(events)
    at = next(event for event in known if "at rest extend" in event.state)
    assert at.state["at rest extend"].min() > 0.0
    after = next(event for event in known if event.iteration == at.iteration + 1)
    again = next(event for event in design(loads(COLUMN), at.state) if isinstance(event, DesignAccepted))
    assert again.entry.objective == pytest.approx(after.entry.objective, rel=1e-3)


@pytest.mark.parametrize("at_rest", [[1.0], [1.0, -1.0, 1.0]])
def test_a_checkpoint_that_does_not_fit_is_named(events, at_rest):
    state = accepted(events)[0].state | {"at rest extend": np.array(at_rest)}
    with pytest.raises(ProblemError, match="stiffnesses at rest"):
        next(design(loads(COLUMN), state))
