"""Pressures for motions: those of a known motion are found again, and bounds and effort are respected."""

import numpy as np
import pytest
from texts import EXTEND, problem_text

import pneumorph as pm
from pneumorph.analysis import Explorer, reaching
from pneumorph.analysis.reaching import Reaching
from pneumorph.problem import loads
from pneumorph.problem.components import MOTIONS

PLACES = {3: ((4.2, 0.0), (-2.1, 3.6), (-2.1, -3.6)), 2: ((4.0, 0.0), (-4.0, 0.0))}
LARGEST = 0.06


def arm(count):
    """A short arm with chambers around its axis."""
    chambers = [(name, 1.6, f"{x} mm", f"{y} mm") for name, (x, y) in zip("ABC", PLACES[count], strict=False)]
    pressures = ", ".join(f'{name} = "60 kPa"' for name, *_ in chambers)
    rest = EXTEND.replace('A = "60 kPa"', pressures) + '[mesh]\nsize = "6 mm"\n'
    return pm.starting_design(loads(problem_text(rest, chambers=chambers, body='control_density = "0.3 /mm"')))


def searcher(design, count):
    explorer = Explorer(design.problem, design.body)
    return Reaching(explorer, dict.fromkeys("ABC"[:count], (0.0, LARGEST)))


def motion_at(design, pressures):
    step = design.explorer().at(pressures).step
    return dict(zip(MOTIONS, (*step.translation, *step.rotation), strict=True))


@pytest.fixture(scope="module")
def three():
    return arm(3)


def test_pressures_are_found_again(three):
    search, rng = searcher(three, 3), np.random.default_rng(0)
    counts = []
    for _ in range(4):
        pressures = dict(zip("ABC", rng.uniform(0.05, 0.95, 3) * LARGEST, strict=True))
        motion = motion_at(three, pressures)
        found = search.reach({name: motion[name] for name in ("extension", "bending_x", "bending_y")})
        assert found.reached and found.starts == 1
        for name, value in pressures.items():
            assert found.pressures[name] == pytest.approx(value, abs=0.03 * LARGEST)
        counts.append(found.solves)
    assert np.median(counts) <= 6


def test_derivatives_are_those_of_the_motion(three):
    pressures = {"A": 0.03, "B": 0.02, "C": 0.01}
    found = searcher(three, 3).reach(motion_at(three, pressures))
    assert found.reached
    step = 1e-3
    for column, name in enumerate("ABC"):
        ends = [
            np.array(list(motion_at(three, {**found.pressures, name: found.pressures[name] + sign * step}).values()))
            for sign in (1, -1)
        ]
        expected = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            found.by_pressure[:, column], expected, rtol=2e-3, atol=1e-3 * np.abs(expected).max()
        )


def test_of_many_pressures_the_least_are_found(three):
    """Away from A the body bends by B and C alike, and by nothing in A."""
    wanted = 0.5 * abs(motion_at(three, {"A": LARGEST})["bending_y"])
    found = searcher(three, 3).reach({"bending_y": wanted})
    assert found.reached
    assert found.pressures["A"] == pytest.approx(0.0, abs=1e-4 * LARGEST)
    assert found.pressures["B"] == pytest.approx(found.pressures["C"], rel=0.02)


def test_what_is_out_of_reach_is_at_the_bounds_nearest_to_it():
    design = arm(2)
    most = motion_at(design, {"A": LARGEST})["bending_y"]
    found = searcher(design, 2).reach({"bending_y": 1.5 * most})
    assert not found.reached
    assert found.pressures["A"] == pytest.approx(LARGEST) and found.pressures["B"] == pytest.approx(0.0, abs=1e-6)
    assert found.at_bounds == ("A",)
    assert found.distance == pytest.approx(abs(0.5 * np.degrees(most)), rel=1e-3)
    assert found.nearer < 1e-3 * found.distance


def test_what_is_not_nearest_would_be_nearer_to_first_order(three, monkeypatch):
    """After one step a search has not come to an end, and says how much is left."""
    monkeypatch.setattr(reaching, "MOST", 1)
    monkeypatch.setattr(reaching, "RESTARTS", 1)
    motion = motion_at(three, {"A": 0.7 * LARGEST, "B": 0.2 * LARGEST})
    found = searcher(three, 3).reach({name: 3.0 * motion[name] for name in ("bending_x", "bending_y")})
    assert not found.reached and found.nearer > 0.1 * found.distance
