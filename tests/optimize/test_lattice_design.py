"""Bodies from files are designed: objectives improve, and every design is within its limits and symmetric."""

import numpy as np
import pytest
from scipy.spatial import KDTree
from solids import box, cylinder, problem, written

from pneumorph.errors import ProblemError
from pneumorph.geometry.lattice.pieces import patches_of
from pneumorph.geometry.starting import space_of
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.table import ROWS
from pneumorph.optimize import DesignAccepted, Finished, build_setup, optimise, within
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.settings import TrialSettings
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.optimize.start import resumed
from pneumorph.problem import loads

WALL, HALF = 2.4, 6.8
REST = f"""
[design]
spacing = "6 mm"
keep = [{{ faces = "x = 6 mm" }}]
[limits]
wall = "{WALL} mm"
envelope = {{ box = [["-{HALF} mm", "-9 mm", "-1 mm"], ["{HALF} mm", "9 mm", "31 mm"]] }}
[optimizer]
step = "0.3 mm"
iterations = 4
"""
GRID = np.array([[1 - u - v, u, v] for u in np.linspace(0, 1, 9) for v in np.linspace(0, 1, 9) if u + v <= 1 + 1e-12])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A file with a finger of rectangular section with one void, symmetric about xz."""
    where = tmp_path_factory.mktemp("design")
    written(box((-6, -7, 0), (6, 7, 30)) - box((-3, -4, 3), (3, 4, 27)), where / "finger.step")
    return where


@pytest.fixture(scope="module")
def setup(folder):
    text = problem("finger.step", 'symmetry = { mirror = ["xz"] }', "4.5 mm").replace(
        'motion = "extension"', 'motion = "bending_y"'
    )
    return build_setup(loads(text + REST, folder=folder))


@pytest.fixture(scope="module")
def events(setup):
    return list(optimise(setup))


def points(surface):
    """Dense samples of a displaced surface, by the weights of its control points."""
    patches = patches_of(surface)
    count = len(patches.nodes)
    places = patches.places(np.repeat(np.arange(count), len(GRID)), np.tile(GRID, (count, 1)))
    return surface.lattice.weights(places) @ surface.net


def test_designs_gain(events):
    values = [event.entry.objective for event in events if isinstance(event, DesignAccepted)]
    assert len(values) == 5
    assert values == sorted(values, reverse=True)
    assert values[-1] < values[0] - 0.002
    assert isinstance(events[-1], Finished)


def test_limits_hold_on_dense_samples(events):
    nearest = np.inf
    for event in events:
        if isinstance(event, DesignAccepted):
            exterior, chamber = map(points, event.body.surfaces)
            wall = KDTree(exterior).query(chamber)[0].min()
            nearest = min(nearest, wall)
            assert event.entry.limits["wall_mm"] <= wall
            assert wall >= WALL
            assert np.abs(exterior[:, 0]).max() <= HALF
            assert event.entry.held
    assert nearest < WALL + 0.05


def test_designs_are_symmetric_and_kept_faces_stay(events):
    body = [event.body for event in events if isinstance(event, DesignAccepted)][-1]
    for surface in body.surfaces:
        lower, upper = surface.lattice.lower, surface.lattice.upper
        places = np.random.default_rng(0).uniform(lower, upper, (100, 3))
        one, other = (surface.lattice.weights(each) @ surface.net for each in (places, places * [1, -1, 1]))
        np.testing.assert_allclose(one, other * [1, -1, 1], atol=1e-10)
    moved = body.exterior.shell()[0] - body.exterior.outline
    kept = np.abs(body.exterior.outline[:, 0] - 6.0) < 1e-6
    assert np.abs(moved[kept]).max() < 1e-10
    assert np.abs(moved).max() > 0.2


def test_a_design_is_resumed(setup, events):
    middle = [event for event in events if isinstance(event, DesignAccepted)][2]
    again = resumed(setup, {**middle.state, "stride": 1.7})
    assert again.analysis.value == pytest.approx(middle.entry.objective, rel=1e-6)
    assert again.learnt.stride == 1.7
    # As runs of earlier versions are, which do not know it.
    assert "stride" in middle.state
    older = {key: value for key, value in middle.state.items() if key != "stride"}
    assert resumed(setup, older).learnt.stride == TrialSettings.stride


def test_faces_that_stay_at_the_envelope_ask_for_no_motion(folder, monkeypatch):
    bound = REST.replace(f'["{HALF} mm", "9 mm"', '["6 mm", "9 mm"')
    asked = loads(problem("finger.step", size="4.5 mm") + bound, folder=folder)
    space = space_of(asked)
    limits, smooth, motions, move = limits_of(asked, space.reference), build_smoothing(space), [], within.least_motion
    monkeypatch.setattr(within, "least_motion", lambda *given: motions.append(given) or move(*given))
    wave = smooth.apply(np.random.default_rng(0).uniform(-1, 1, space.n))
    found = within.within(space, smooth, limits, space.start + 0.9 * wave / np.abs(wave).max())
    assert isinstance(found, within.Within)
    # Five in vain would follow if rows that no motion changes counted.
    assert len(motions) < 5
    rows = limits.rows(space.body(found.phi), 0.1, -0.05)
    stay = abs(rows.jacobian @ space.L).sum(axis=1) < 1e-9
    assert (rows.kind[stay] == ROWS.index("envelope")).any()
    assert (abs(linear_limits(space, limits, found.phi, 0.1, -0.05).jacobian).sum(axis=1) > 1e-4).all()


def test_what_is_not_covered_is_refused(folder):
    with pytest.raises(ProblemError, match=r"optimizer\.method"):
        loads(problem("finger.step") + '\n[optimizer]\nmethod = "dfp"\n', folder=folder)


def test_a_body_with_a_port_is_designed_and_keeps_it(folder):
    written(box((-6, -7, 0), (6, 7, 30)) - box((-3, -4, 3), (3, 4, 27)) - cylinder(1.5, -1, 4), folder / "open.step")
    port = '[[body.chamber]]\nname = "A"\ninside = ["0 mm", "0 mm", "15 mm"]\nport = "z = 0 mm"\n'
    text = problem("open.step", port, "4.5 mm").replace('motion = "extension"', 'motion = "bending_y"')
    setup = build_setup(loads(text + REST.replace("iterations = 4", "iterations = 2"), folder=folder))
    accepted = [event for event in optimise(setup) if isinstance(event, DesignAccepted)]
    assert len(accepted) == 3
    assert np.all(np.diff([event.entry.objective for event in accepted]) < -1e-3)
    exterior, chamber = accepted[-1].body.surfaces
    rim = np.flatnonzero(
        (np.abs(np.hypot(*chamber.outline.T[:2]) - 1.5) < 1e-6) & (np.abs(chamber.outline[:, 2]) < 1e-6)
    )
    assert len(rim) > 8
    np.testing.assert_allclose(chamber.shell()[0][rim], chamber.outline[rim], atol=1e-9)
    # The wall is there between all points but those beside each other at the rim.
    here, there = points(exterior), points(chamber)
    away, near = KDTree(here).query(there)
    close = away < WALL
    centre = np.array([0.0, 0.0, 0.0])
    for found in (there[close], here[near[close]]):
        assert np.linalg.norm(found - centre, axis=1).max(initial=0.0) < 1.5 + 2 * WALL
    assert close.any()
    assert accepted[-1].entry.limits["wall_mm"] >= WALL
