"""Where a step would make a body intersect itself, the next steps leave a gap there and go on."""

from types import SimpleNamespace

import numpy as np
import pytest
from designing import BRIEFLY, accepted, analysed, solved
from texts import problem_text
from tiny import tiny

from pneumorph.analysis import SelfIntersecting, gap_slope
from pneumorph.mechanics import Equilibrium, Skin
from pneumorph.optimize import DesignRejected, design
from pneumorph.optimize.crossings import CROSSINGS, Crossing, crossings_of, joined, measured, pack, unpack
from pneumorph.problem import loads
from pneumorph.sensitivity import taylor_test
from pneumorph.verify.solids import tube

LENGTH = 3.0
RING = tube(8, 9.5, LENGTH, (1, 96, 1))
"""Its inner surface is 16 mm wide."""

BELLOWS = problem_text(
    """
[end_effector]
kind = "plate"
hold = ["shift_x", "shift_y", "bending_x", "bending_y"]
[[task]]
name = "contract"
pressure = { A = "-5 kPa" }
objective = { kind = "maximize", motion = "-extension" }
[limits]
wall = "1 mm"
curvature = "0.5 /mm^2"
stretch = "0.3 /mm^2"
skew = 0.5
margin = 1
[mesh]
size = "5 mm"
[optimizer]
iterations = 3
""",
    length=29,
    radius=10,
    chambers=(("A", 7.5, "0 mm", "0 mm"),),
    body='control_density = "0.4 /mm"\nripple = { amplitude = "2.5 mm", period = "11 mm" }\n'
    "symmetry = { rotation = 6 }",
    material='model = "neo-hookean"\nshear_modulus = "0.15 MPa"\nbulk_modulus = "1.5 MPa"\ndensity = "1.1 g/cm^3"',
)
"""A bellows that contracts under vacuum until its folds would go through each other."""


def pushed(by):
    """Displacements of the ring whose upper half is pushed down, at most by so many mm, on the lower one."""
    X, u = RING.points, np.zeros_like(RING.points)
    above = (X[:, 1] > 0.0) & (np.abs(X[:, 0]) < 7.5)
    u[above, 1] = -by * np.cos(np.pi * X[above, 0] / 15.0) ** 2
    return u


def ring_of(by):
    """The mesh of the ring, and its only state."""
    disc = SimpleNamespace(skin=Skin(RING), morph=SimpleNamespace(size=1.0))
    return disc, SimpleNamespace(X=RING.points, equilibria={"push": SimpleNamespace(u=pushed(by))})


def test_where_a_body_goes_through_itself():
    disc, state = ring_of(17.0)
    crossed = SelfIntersecting("", 1.0, state.equilibria["push"], task="push", X=RING.points)
    found = crossings_of(disc, crossed)
    assert 1 <= len(found) <= CROSSINGS.most
    for each in found:
        (x, y, _), radius = each.places.T, np.hypot(*each.places.T[:2])
        assert np.abs(x).max() < 4.0 and np.sign(y).sum() == 0.0, "one place is above, the other one below"
        assert radius == pytest.approx(8.0, abs=0.3)


@pytest.mark.parametrize("by", [12.0, 15.0])
def test_a_gap_is_between_the_nearest_points(by):
    disc, state = ring_of(by)
    beside = np.array([[0.3, 8.0, 1.0], [-0.2, -8.0, 1.2]])
    (found,) = measured(disc, state, [Crossing("push", beside)])
    assert found.width == pytest.approx(16.0 - by, rel=1e-3)
    assert np.abs(found.crossing.places[:, :2] - [[0.0, 8.0], [0.0, -8.0]]).max() < 0.6
    for other in (by, by + 0.5):
        assert found.gap.of(RING.points + pushed(other)) == pytest.approx(16.0 - other, rel=5e-3)


def test_new_crossings_take_the_place_of_those_that_are_near():
    disc, _ = ring_of(0.0)
    apart = 3.0 * CROSSINGS.same * disc.morph.size
    places = [
        np.array([[number * apart, 8.0, 0.0], [number * apart, -8.0, 0.0]]) for number in range(3 + CROSSINGS.most)
    ]
    known = [Crossing("push", each) for each in places[:3]]
    turned = Crossing("push", places[1][::-1] + 0.1)
    assert [each.places[0, 0] for each in joined(disc, known, [turned])] == [0.0, 2 * apart, apart + 0.1]
    other = Crossing("other", places[1])
    many = joined(disc, [other, *known], [Crossing("push", each) for each in places[3:]])
    assert len(many) == 1 + CROSSINGS.most and other in many
    assert not {each.places[0, 0] for each in many if each is not other} & {0.0, apart, 2 * apart}


def test_the_derivative_of_a_gap():
    """Between two places of a tube under pressure, with the state that follows the shape."""
    problem = loads(tiny())
    space, disc, analysis = analysed(problem)
    (found,) = measured(disc, analysis, [Crossing("extend", np.array([[8.0, 0.0, 4.0], [0.0, 8.0, 19.0]]))])
    slope = gap_slope(space, disc, analysis, "extend", found.gap)

    def value(phi):
        there = solved(problem, space, disc, phi, {"extend": analysis.equilibria["extend"].state})
        return found.gap.of(there.X + there.equilibria["extend"].u)

    direction = np.random.default_rng(0).normal(size=space.n)
    test = taylor_test(value, space.start, slope, direction / np.abs(direction).max(), 0.1)
    assert test.passed, test
    assert value(space.start) == pytest.approx(found.width)


def test_what_was_learnt_of_crossings_is_stored():
    stored = pack([Crossing(task, places) for task, places in zip("ab", np.arange(12.0).reshape(2, 2, 3), strict=True)])
    again = unpack(stored, ["a", "b", "c"])
    assert [each.task for each in again] == ["a", "b"]
    assert np.array_equal([each.places for each in again], stored["crossing places"])
    assert [each.task for each in unpack(stored, ["b"])] == ["b"]
    assert unpack(pack([]), ["a"]) == unpack({}, ["a"]) == ()
    for places in (np.zeros((2, 3)), np.zeros((3, 2, 3)), np.full((2, 2, 3), np.nan), np.full((2, 2, 3), "x")):
        assert unpack(stored | {"crossing places": places}, ["a", "b"]) == ()


def test_designs_go_on_where_steps_would_make_the_body_intersect_itself():
    events = list(design(loads(BELLOWS), settings=BRIEFLY))
    rejected = [each for each in events if isinstance(each, DesignRejected) and "self-intersect" in each.reason]
    designs = [each.entry for each in accepted(events)]
    assert rejected, "a step would have"
    assert "self-intersect" not in events[-1].reason
    assert not any(each.tasks["contract"].self_intersecting for each in designs)
    # Without that the run ends one design earlier.
    assert len(designs) == 4 and designs[-1].objective < 1.05 * designs[-2].objective < 0.0


def test_the_search_ends_at_the_first_task_in_which_it_would(monkeypatch):
    from pneumorph.analysis import analyse

    text = tiny() + '[[task]]\nname = "again"\npressure = { A = "50 kPa" }\nobjective = { motion = "extension" }\n'
    problem = loads(text)
    space, disc, apart = analysed(problem)
    monkeypatch.setattr(Skin, "intersects_itself", lambda self, x: True)
    found = analyse(problem, space, disc, space.start, apart=apart)
    assert isinstance(found, SelfIntersecting) and found.task == "extend"
    assert isinstance(found.last, Equilibrium) and np.array_equal(found.X, apart.X)
    before = analyse(problem, space, disc, space.start)
    assert before.self_intersecting == {"extend": True, "again": True}
    assert not isinstance(analyse(problem, space, disc, space.start, apart=before), SelfIntersecting)
