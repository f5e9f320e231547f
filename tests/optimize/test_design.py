"""The whole loop on a coarse mesh.

It designs, holds limits, goes on after a stop as if nothing had happened, and says why it ends.
"""

from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from certifying import certified
from designing import BRIEFLY, accepted
from texts import EXTEND, problem_text
from tiny import tiny

from pneumorph.errors import MeshError, ProblemError
from pneumorph.limits.table import TUBE_KINDS
from pneumorph.mechanics import Skin
from pneumorph.optimize import DesignAccepted, DesignRejected, Finished, MeshKept, Started, design
from pneumorph.optimize.settings import LoopSettings, TrialSettings
from pneumorph.optimize.stopping import _time_is_up
from pneumorph.optimize.trial import analyse_trial
from pneumorph.problem import load, loads
from pneumorph.results import to_json

REST = """
[limits]
envelope = { radius = "12 mm" }
[mesh]
size = "4 mm"
[optimizer]
iterations = ITERATIONS
method = "METHOD"
"""
BODY = 'control_density = "0.6 /mm"\nripple = { amplitude = "0.4 mm", period = "10 mm" }'
FILE = problem_text(EXTEND + REST, 40, chambers=(("A", 5, "0 mm", "0 mm"),), body=BODY)


def run(iterations, method="sqp", state=None, settings=BRIEFLY):
    problem = loads(FILE.replace("ITERATIONS", str(iterations)).replace("METHOD", method))
    return problem, list(design(problem, state, settings))


@pytest.fixture(scope="module")
def three():
    return run(3, settings=None)


def extension(event):
    return event.entry.tasks["extend"].translation[2]


def test_extension_grows_threefold_in_three_designs(three):
    problem, events = three
    designs = accepted(events)
    assert extension(designs[3]) >= 3 * extension(designs[0])
    last = events[-1]
    assert isinstance(last, Finished)
    assert last.held
    assert certified(designs[-1].body, problem.limits).satisfied()


def test_the_history_line_is_as_documented(three):
    line = accepted(three[1])[1].entry
    keys = {"iteration", "objective", "tasks", "limits", "elements", "dofs", "factorisations", "seconds"}
    assert keys <= set(to_json(line))
    of_tubes = {limit.key for kind in TUBE_KINDS for limit in kind.limits if limit.key}
    assert set(line.limits) == of_tubes | {"strain", "margin"}
    assert {"geometry", "equilibrium", "gradient", "subproblem", "total"} == set(line.seconds)
    assert line.equivalents > 0
    assert line.objective == -line.tasks["extend"].translation[2]


def test_the_error_of_the_mesh_is_estimated_of_the_end_alone(three):
    designs = accepted(three[1])
    here, fine = extension(designs[-1]), three[1][-1].finer["extend"].translation[2]
    assert here < fine < 1.5 * here
    assert not any(event.entry.finer for event in designs)


def test_a_stopped_run_goes_on_as_if_nothing_had_happened(three):
    designs = accepted(three[1])
    _, events = run(3, state=designs[1].state)
    again = accepted(events)
    assert [event.iteration for event in again] == [event.iteration for event in designs[2:]]
    # In mm; adjoints in the loop have six digits, and other factorisations are at hand. In the second design a program
    # has a row more for it, and programs are not solved to the end.
    for one, other, apart in zip(again, designs[2:], (5e-5, 2e-2), strict=True):
        assert one.entry.objective == pytest.approx(other.entry.objective, rel=apart / 50)
        assert np.abs(one.body.control_points() - other.body.control_points()).max() < apart


def test_no_design_begins_to_go_through_itself(three, monkeypatch):
    """As if the body did so where it is longer than some length."""
    most = 0.6 * extension(accepted(three[1])[-1])
    monkeypatch.setattr(Skin, "intersects_itself", lambda self, x: x[:, 2].max() > 40.0 + most)
    _, events = run(9)
    assert 0.5 * most < extension(accepted(events)[-1]) <= most
    assert any(isinstance(each, DesignRejected) and "self-intersect" in each.reason for each in events)
    assert "self-intersect; with a table [contact]" in events[-1].reason
    assert not any(each.entry.tasks["extend"].self_intersecting for each in accepted(events))


def test_a_start_that_goes_through_itself_goes_on(monkeypatch):
    monkeypatch.setattr(Skin, "intersects_itself", lambda self, x: True)
    _, events = run(1)
    assert [each.entry.tasks["extend"].self_intersecting for each in accepted(events)] == [True, True]


def test_a_mesh_that_cannot_be_made_anew_goes_on_and_is_told(three, monkeypatch):
    def fails(*_):
        raise MeshError("surfaces may touch")

    monkeypatch.setattr("pneumorph.optimize.trial.needs_remesh", lambda *_: "it is worn")
    monkeypatch.setattr("pneumorph.optimize.setup.Setup.discretise", fails)
    before = accepted(three[1])[1]
    _, events = run(2, state=before.state)
    assert [type(event) for event in events] == [Started, MeshKept, DesignAccepted, Finished]
    assert "surfaces may touch" in events[1].reason
    assert 0 < events[1].quality < 1
    assert extension(events[2]) > extension(before)


def test_a_mesh_that_serves_is_not_replaced_by_a_much_finer_one(three, monkeypatch):
    problem, events = three
    tried = []

    def fails(solids, faces, nodes, size):
        tried.append(size)
        raise MeshError("surfaces may touch")

    monkeypatch.setattr("pneumorph.optimize.trial.needs_remesh", lambda *_: "it is worn")
    monkeypatch.setattr("pneumorph.mesh.build.fill", fails)
    run(2, state=accepted(events)[1].state)
    coarse, tried[:] = min(tried), []
    assert coarse >= 0.8 * problem.mesh.size
    unsound = LoopSettings(trial=TrialSettings(sound=1.0), looked_at=False)
    list(design(problem.with_changes({"optimizer.iterations": 2}), accepted(events)[1].state, unsound))
    assert min(tried) == 0.5 * problem.mesh.size


def test_a_run_of_an_earlier_version_goes_on(three):
    problem, events = three
    state = dict(accepted(events)[2].state)
    old = {name: value for name, value in state.items() if name != "multipliers" and not name.startswith("curvature_")}
    assert isinstance(next(design(problem, old)), Started)
    with pytest.raises(ProblemError, match="start the run again in another directory"):
        next(design(problem, old | {"phi": old["phi"][:-1]}))


@pytest.fixture
def optimised_kernels():
    """Its penalties are evaluated so often that they are worth being compiled well."""
    as_elsewhere = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", False)
    yield
    jax.config.update("jax_disable_most_optimizations", as_elsewhere)


@pytest.mark.slow
def test_the_papers_method_designs_too(three, optimised_kernels):
    _, events = run(1, "dfp")
    designs = accepted(events)
    assert extension(designs[-1]) > 1.2 * extension(designs[0])


@pytest.mark.slow
def test_a_first_step_that_is_too_long_for_tight_limits_costs_nothing():
    """Beyond some tenths of a millimetre linearised limits are wrong, and steps in such a region are tiny."""

    def gained(step):
        changes = {"mesh.size": "6 mm", "limits.curvature": "0.02 /mm^2", "limits.stretch.limit": "0.02 /mm^2"}
        problem = load("examples/small.toml").with_changes(
            {**changes, "optimizer.step": step, "optimizer.iterations": 3}
        )
        designs = accepted(design(problem, settings=BRIEFLY))
        return extension(designs[-1]) - extension(designs[0])

    assert gained("1 mm") > 0.9 * gained("0.4 mm")


def test_a_target_far_away_takes_longer_steps_at_first():
    """A step of the length that was asked for promises too little of J = ((0.1 − 20) mm)² to be worth a solve."""
    text = tiny(objective='{ kind = "motion", extension = "20 mm" }')
    problem = loads(text.replace("iterations = 2", 'iterations = 1\nstep = "0.05 mm"'))
    events = list(design(problem, settings=BRIEFLY))
    steps = [event.entry.step for event in accepted(events)]
    assert len(steps) == 2
    assert steps[1] > 0.05


def test_a_target_that_is_met_ends_the_run():
    """An extension of 0.4 mm is reached in a few designs, after which nothing is left to improve."""
    text = tiny(objective='{ kind = "motion", extension = "0.4 mm" }')
    *_, last, end = design(loads(text.replace("iterations = 2", "iterations = 20")), settings=BRIEFLY)
    assert end.reason == "the targets are reached"
    assert 0 < last.entry.objective < 1e-6 * 0.3**2


def test_a_run_that_begins_near_its_target_does_not_polish_it():
    """Targets are measured from rest: of the little that is left at such a start, a thousandth is nothing to seek."""
    text = tiny(objective='{ kind = "motion", extension = "TARGET mm" }').replace("iterations = 2", "iterations = 9")
    first = list(accepted(design(loads(text.replace("TARGET", "0.4")), settings=BRIEFLY)))[-1]
    reached = first.entry.tasks["extend"].translation[2]
    near = loads(text.replace("TARGET", f"{reached + 2e-4:.6f}"))
    *_, end = design(near, settings=BRIEFLY, begin=first.state)
    assert (end.reason, end.iteration) == ("the targets are reached", 0)


@pytest.mark.parametrize("late, ends", [(0.4, False), (0.6, True)])
def test_a_design_that_would_end_too_late_is_not_begun(monkeypatch, late, ends):
    """By so much of its own time would another one like this be late."""
    monkeypatch.setattr("time.time", lambda: 10.0)
    setup = SimpleNamespace(settings=LoopSettings(until=10.0 + (1.0 - late) * 100.0))
    assert (_time_is_up(setup, SimpleNamespace(took=100.0)) is not None) == ends


def radii(monkeypatch, trials_in_vain, iterations=1, reached=1.0):
    """The trust regions after each design, where the first trials are said to have no equilibrium."""
    left = [trials_in_vain]

    def tried(*given):
        trial = yield from analyse_trial(*given)
        if left[0]:
            left[0] -= 1
            return replace(trial, analysis=None, reason="it is said to have no equilibrium", reached=reached)
        return trial

    monkeypatch.setattr("pneumorph.optimize.loop.analyse_trial", tried)
    text = tiny().replace("iterations = 2", f"iterations = {iterations}")
    return [event.state["radius"] for event in accepted(design(loads(text), settings=BRIEFLY))]


def test_a_region_that_was_too_large_does_not_grow_at_once(monkeypatch):
    """Else every design would begin with the same trial in vain."""
    assert radii(monkeypatch, 0)[-1] == 2.0
    assert radii(monkeypatch, 1)[-1] == 0.5


def test_a_region_that_was_much_too_large_is_remembered(monkeypatch):
    """Each design that begins in it and keeps what was promised may double it."""
    assert radii(monkeypatch, 4, iterations=3)[1:] == [0.0625, 0.125, 0.25]


def test_a_step_without_any_state_is_followed_by_a_much_shorter_one(monkeypatch):
    """Of a half and a quarter it is known already that they have none."""
    assert radii(monkeypatch, 1, reached=0.0)[-1] == 0.125
    assert radii(monkeypatch, 1, reached=0.3)[-1] == 0.3
    assert radii(monkeypatch, 1, reached=0.75)[-1] == 0.5
