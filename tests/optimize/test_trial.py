"""A step whose state is not found at once is gone in parts, on the mesh before it and on a new one."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import poor, relax
from pneumorph.optimize import trial
from pneumorph.optimize.buckling import judge
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.iterate import AnalysedDesign
from pneumorph.optimize.setup import build_setup
from pneumorph.problem import loads


@pytest.fixture(scope="module", params=["quadratic", "mixed"])
def start(request):
    problem = loads(tiny(size=f'"5 mm"\nelement = "{request.param}"', pressure='{ A = "60 kPa" }'))
    setup = build_setup(problem)
    phi = setup.space.start
    disc = setup.discretise(setup.space.body(phi), 0.0)
    analysis = analyse(problem, setup.space, disc, phi)
    return setup, AnalysedDesign(analysis, disc, setup.certify(phi), judge(disc, analysis, {}))


def tried(start, phi):
    setup, now = start
    steps = trial.analyse_trial(setup, 1, now, phi, Clock())
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


@pytest.mark.parametrize("new", [False, True])
def test_a_step_in_parts_ends_where_the_whole_one_does(start, new, monkeypatch):
    setup, now = start
    space = setup.space
    phi = space.start + 0.2 * np.random.default_rng(0).normal(size=space.n)
    if new:
        monkeypatch.setattr(trial, "needs_remesh", lambda *given: "asked for")
    whole, asked = tried(start, phi), []

    def not_at_once(problem, space, disc, phi, *rest, **options):
        asked.append(phi)
        refused = NoEquilibrium("not at once", 0.0, None)
        return refused if len(asked) == 1 else analyse(problem, space, disc, phi, *rest, **options)

    monkeypatch.setattr(trial, "analyse", not_at_once)
    parts = tried(start, phi)
    assert parts.remeshed == whole.remeshed == new
    assert parts.analysis.value == pytest.approx(whole.analysis.value, rel=1e-5)
    # The first part is half of the step; on a new mesh the design before it comes first.
    assert asked[1 + new] == pytest.approx(0.5 * (now.analysis.phi + phi))
    assert asked[2 + new] == pytest.approx(phi)


def test_a_step_without_any_state_is_given_up_with_the_reason(start, monkeypatch):
    space = start[0].space
    monkeypatch.setattr(trial, "analyse", lambda *given, **options: NoEquilibrium("it balloons", 0.0, None))
    found = tried(start, space.start + 0.01)
    assert found.analysis is None
    assert (found.reason, found.reached) == ("it balloons", 0.0)


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

    monkeypatch.setattr(trial, "analyse", watched)
    _, reached = trial._in_parts(setup, disc, now.analysis, end, phi)
    assert reached == 1.0
    assert seen[0] == pytest.approx(0.5 * (X + seen[1]), abs=1e-12)


def test_elements_that_invert_half_way_only_halve_the_region(start, monkeypatch):
    """They say nothing of the states of a shorter step, of which none is known either."""
    setup, now = start
    monkeypatch.setattr(trial, "_quality", lambda *given: -0.1)
    phi = setup.space.start + 0.05
    found, reached = trial._in_parts(setup, now.disc, now.analysis, now.disc, phi)
    assert isinstance(found, NoEquilibrium)
    assert reached == 0.5


def test_nodes_slide_along_surfaces_before_a_new_mesh_is_made(start):
    """Where those inside are not enough, and the state found on the way is that from rest."""
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
