"""The states of a step are followed in parts, on the mesh before it and on a new one."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse, predict_states
from pneumorph.mechanics import NoEquilibrium, Skin
from pneumorph.mesh import poor, relax
from pneumorph.optimize import trial, way
from pneumorph.optimize.buckling import judge
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.iterate import AnalysedDesign
from pneumorph.optimize.settings import TrialSettings
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.way import Place, Way, before_last_part, follow
from pneumorph.problem import loads


@pytest.fixture(scope="module", params=["quadratic", "mixed"])
def start(request):
    problem = loads(tiny(size=f'"5 mm"\nelement = "{request.param}"', pressure='{ A = "60 kPa" }'))
    setup = build_setup(problem)
    phi = setup.space.start
    disc = setup.discretise(setup.space.body(phi), 0.0)
    analysis = analyse(problem, setup.space, disc, phi)
    return setup, AnalysedDesign(analysis, disc, setup.certify(phi), judge(disc, analysis, {}))


def tried(start, phi, stride=6.0):
    setup, now = start
    steps = trial.analyse_trial(setup, 1, now, phi, stride, Clock())
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def way_to(start, phi, end=None):
    setup, now = start
    return Way(setup, Place(now.disc, now.analysis), end or now.disc, phi)


@pytest.mark.parametrize("new", [False, True])
def test_a_step_in_parts_ends_where_the_whole_one_does(start, new, monkeypatch):
    setup, now = start
    space = setup.space
    phi = space.start + 0.1 * np.random.default_rng(0).normal(size=space.n)
    if new:
        monkeypatch.setattr(trial, "needs_remesh", lambda *given: "asked for")
    whole, asked = tried(start, phi), []

    def not_at_once(problem, space, disc, phi, *rest, **options):
        asked.append(phi)
        refused = NoEquilibrium("not at once", 0.0, None)
        return refused if len(asked) == 1 else analyse(problem, space, disc, phi, *rest, **options)

    monkeypatch.setattr(way, "analyse", not_at_once)
    parts = tried(start, phi)
    assert parts.remeshed == whole.remeshed == new
    assert parts.analysis.value == pytest.approx(whole.analysis.value, rel=1e-5)
    if new:
        # The design before it comes first.
        assert asked[1] == pytest.approx(now.analysis.phi)
        assert asked[2] == pytest.approx(phi)
    else:
        # The first part is half of the step.
        assert asked[1] == pytest.approx(0.5 * (now.analysis.phi + phi))
        assert asked[2] == pytest.approx(phi)
        assert parts.stride == pytest.approx(0.5 * way_to(start, phi).length, rel=0.6)


def test_a_body_that_would_intersect_itself_on_a_new_mesh_ends_the_way(start, monkeypatch):
    """Though it does so before the step there too: not on the mesh before."""
    setup, _ = start
    phi = setup.space.start + 0.1 * np.random.default_rng(0).normal(size=setup.space.n)
    monkeypatch.setattr(trial, "needs_remesh", lambda *given: "asked for")
    monkeypatch.setattr(Skin, "intersects_itself", lambda self, x: True)
    asked = []

    def not_at_once(*given, **options):
        asked.append(given)
        return NoEquilibrium("not at once", 0.0, None) if len(asked) == 1 else analyse(*given, **options)

    monkeypatch.setattr(way, "analyse", not_at_once)
    found = tried(start, phi)
    assert found.remeshed and found.analysis is None
    assert found.crossed.task == "extend" and found.reason == "the body would self-intersect"
    assert len(asked) == 2


def test_a_long_step_is_followed_in_parts_that_grow(start, monkeypatch):
    setup, _ = start
    phi = setup.space.start + 0.1 * np.random.default_rng(0).normal(size=setup.space.n)
    ahead, asked = way_to(start, phi), []

    def watched(problem, space, disc, phi, *rest, **options):
        asked.append(phi)
        return analyse(problem, space, disc, phi, *rest, **options)

    whole = follow(ahead, 6.0)
    monkeypatch.setattr(way, "analyse", watched)
    found = follow(ahead, 0.2 * ahead.length)
    assert found.found.value == pytest.approx(whole.found.value, rel=1e-5)
    shares = np.array([np.linalg.norm(each - setup.space.start) for each in asked]) / np.linalg.norm(phi - asked[0])
    parts = np.diff(shares, prepend=0.0) / shares[-1]
    assert parts[0] == pytest.approx(0.2)
    assert len(parts) < 5 and parts.max() > 0.25
    assert (found.reached, found.stride) == (1.0, pytest.approx(0.3 * ahead.length))


def test_what_two_states_predict_is_of_second_order(start):
    """With half the way the error is an eighth, and a quarter with one state."""
    setup, now = start
    direction = 0.02 * np.random.default_rng(0).normal(size=setup.space.n)
    end, errors = setup.space.start + direction, {}
    known = analyse(setup.problem, setup.space, now.disc, end, tolerance=1e-10)
    for far in (1.0, 0.5):
        before, after = (
            analyse(setup.problem, setup.space, now.disc, end + sign * far * direction, tolerance=1e-10)
            for sign in (-1.0, 1.0)
        )
        exact = after.equilibria["extend"].state.u
        for name, given in (("one", None), ("two", (before, -1.0))):
            guess = predict_states(setup.space, now.disc, known, after.phi, given)["extend"]
            errors[name, far] = np.linalg.norm(np.asarray(guess.state.u) - exact)
    rates = {name: np.log2(errors[name, 1.0] / errors[name, 0.5]) for name in ("one", "two")}
    assert rates["one"] == pytest.approx(2.0, abs=0.4)
    assert rates["two"] == pytest.approx(3.0 if now.disc.model.plain else 2.0, abs=0.4)


@pytest.mark.parametrize(("taken", "after"), [(1, 3.0), (4, 3.0), (5, 2.0), (6, 2.0), (7, 2.0 / 1.5), (8, 2.0 / 1.5)])
def test_the_next_first_part_is_as_long_as_few_factorisations_allow(taken, after):
    assert way._after_first(TrialSettings(), 2.0, 2.0, taken) == pytest.approx(after)


def test_a_short_step_says_nothing_against_a_longer_first_part():
    settings = TrialSettings()
    assert way._after_first(settings, 4.0, 0.5, 2) == 4.0
    assert way._after_first(settings, 6.0, 6.0, 1) == settings.longest


@pytest.mark.parametrize("left", [1.0, 0.3])
@pytest.mark.parametrize("part", np.linspace(0.05, 2.0, 14))
def test_no_short_part_is_left_for_the_last(part, left):
    length = way._without_rest(part, left)
    assert length == pytest.approx(min(part, left), rel=0.21)
    assert length == left or left - length > 0.16 * left


@pytest.mark.parametrize("stride", [0.3, 1.5, 1.9, 2.4])
def test_steps_of_one_length_end_as_one_part_while_parts_take_few_factorisations(stride):
    settings, step = TrialSettings(), 3.0
    for _ in range(8):
        first = step * way._without_rest(stride / step, 1.0)
        stride = way._after_first(settings, stride, first, settings.few)
    assert way._without_rest(stride / step, 1.0) == 1.0


def test_a_step_without_any_state_is_given_up_with_the_reason(start, monkeypatch):
    space = start[0].space
    monkeypatch.setattr(way, "analyse", lambda *given, **options: NoEquilibrium("it balloons", 0.0, None))
    found = tried(start, space.start + 0.01)
    assert found.analysis is None
    # Half of a quarter of the step may have one.
    assert (found.reason, found.reached) == ("it balloons", 0.125)


def test_nodes_inside_go_along(start, monkeypatch):
    """Half way, they are half way between their places on both meshes."""
    setup, now = start
    disc, X = now.disc, now.analysis.X
    phi, moved = setup.space.start + 0.05, np.zeros_like(X)
    moved[-1] = 0.2
    end, seen = replace(disc, morph=replace(disc.morph, shift=moved)), []

    def watched(problem, space, disc, phi, *rest, **options):
        seen.append(disc.morph.positions(space.control_points(phi)))
        return analyse(problem, space, disc, phi, *rest, **options)

    monkeypatch.setattr(way, "analyse", watched)
    ahead = way_to(start, phi, end)
    assert follow(ahead, 0.5 * ahead.length).reached == 1.0
    assert seen[0] == pytest.approx(0.5 * (X + seen[1]), abs=1e-12)


def test_where_elements_fold_on_the_way_its_rest_is_one_part(start, monkeypatch):
    monkeypatch.setattr(way, "quality", lambda *given: -0.1)
    ahead, asked = way_to(start, start[0].space.start + 0.05), []

    def watched(problem, space, disc, phi, *rest, **options):
        asked.append(phi)
        return analyse(problem, space, disc, phi, *rest, **options)

    monkeypatch.setattr(way, "analyse", watched)
    found = follow(ahead, 0.5 * ahead.length)
    assert found.reached == 1.0 and len(asked) == 1 and asked[0] is ahead.phi
    # What was learnt is of all of it.
    assert found.stride >= min(ahead.length, TrialSettings.longest) / TrialSettings.growth
    # A new mesh may serve where the old one does not.
    known = before_last_part(ahead, 0.5 * ahead.length)
    assert known.here.analysis is start[1].analysis and known.reached == 0.0
    # It is not tried again and again.
    asked.clear()
    monkeypatch.setattr(way, "analyse", lambda *given, **options: asked.append(1) or NoEquilibrium("none", 0.0, None))
    assert isinstance(follow(ahead, 0.5 * ahead.length).found, NoEquilibrium) and asked == [1]


def test_nodes_slide_along_surfaces_before_a_new_mesh_is_made(start, monkeypatch):
    """Where those inside are not enough, and the state found on the way is that from rest."""
    # Not for edges along which surfaces turn by much, which sliding does not help.
    monkeypatch.setattr(trial, "needs_remesh", poor)
    setup, now = start
    space = setup.space
    phi = space.start + 0.9 * np.random.default_rng(1).normal(size=space.n)
    points = space.control_points(phi)
    assert poor(relax(now.disc.morph, points), points)
    found = tried(start, phi)
    assert not found.remeshed and found.disc.model is now.disc.model
    moved = found.disc.morph.positions(points) - now.disc.morph.positions(points)
    assert np.abs(moved[: now.disc.morph.n_surface]).max() > 0.1
    alone = analyse(setup.problem, space, found.disc, phi)
    assert found.analysis.value == pytest.approx(alone.value, rel=1e-5)
