"""Pressures for motions: those of a known motion are found again, and bounds and effort are respected."""

import numpy as np
import pytest
from texts import EXTEND, problem_text

import pneumorph as pm
from pneumorph.analysis import Explorer, reaching
from pneumorph.analysis.reaching import Reaching
from pneumorph.problem import loads
from pneumorph.problem.components import MOTIONS

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

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


def test_a_push_is_found_again_and_balances_a_load(three):
    """Pressures for a force: the plate that is held pushes with it, and a load of that size brings a free one there."""
    pressures = {"A": 0.01, "B": 0.035, "C": 0.03}
    (held,) = three.simulate({name: f"{p} MPa" for name, p in pressures.items()}, block="shift_x").steps
    wanted = held.reaction["shift_x"]
    answer = three.pressures_for({"push_shift_x": f"{wanted} N"})
    found = answer.found
    assert found.reached and found.solves <= 6 and abs(wanted) > 0.005
    assert found.pushes["shift_x"] == pytest.approx(wanted, rel=1e-3) and abs(found.motion[0]) < 1e-9
    assert f"force along x {wanted:.4g} N" in str(answer)
    asked = {name: f"{p} MPa" for name, p in found.pressures.items()}
    (again,) = three.simulate(asked, block="shift_x").steps
    assert again.reaction["shift_x"] == pytest.approx(wanted, rel=2e-3)
    loaded = three.problem.with_changes({"task[0].force": [f"{-wanted} N", "0 N", "0 N"]})
    (free,) = pm.starting_design(loaded).simulate(asked).steps
    (light,) = three.simulate(asked).steps
    assert abs(free.translation[0]) < 3e-3 * abs(light.translation[0])


def test_a_push_with_a_motion_under_a_load(three):
    """Held beside its place, with something on the plate, it pushes and turns as wanted."""
    loads = {"load": {"force_y": "0.003 N", "moment_z": "0.1 N*mm"}, "block": "shift_x=0.02 mm"}
    base = three.pressures_for({"push_shift_x": "0 N"}, **loads).found
    assert base.motion[0] == pytest.approx(0.02) and base.reached
    pushed = base.pushes["shift_x"] + 0.003
    found = three.pressures_for({"push_shift_x": f"{pushed} N", "bending_x": f"{base.motion[3]} rad"}, **loads).found
    assert found.reached and found.pushes["shift_x"] == pytest.approx(pushed, abs=1e-5)
    problem = three.problem.with_changes(
        {
            "task[0].force": ["0 N", "0.003 N", "0 N"],
            "task[0].moment": ["0 N*mm", "0 N*mm", "0.1 N*mm"],
            "task[0].hold": {"shift_x": "0.02 mm"},
        }
    )
    asked = {name: f"{p} MPa" for name, p in found.pressures.items()}
    (exact,) = pm.starting_design(problem).simulate(asked).steps
    assert exact.reaction["shift_x"] == pytest.approx(found.pushes["shift_x"], rel=2e-3, abs=1e-5)
    np.testing.assert_allclose([*exact.translation, *exact.rotation], found.motion, atol=2e-4)


def test_where_gravity_points_is_a_load():
    design = arm(2)
    heavy = design.problem.with_changes({"gravity": {"direction": [-1, 0, 0], "acceleration": "98.1 m/s^2"}})
    design = pm.starting_design(heavy)
    (still,) = design.simulate({"A": "0 kPa", "B": "0 kPa"}).steps
    # Of itself it hangs towards -x; hung up along its axis it does not bend at all.
    found = design.pressures_for({"bending_y": "0 deg"}, load={"gravity": "0,0,1"}).found
    assert found.reached and max(found.pressures.values()) < 1e-3 < abs(still.rotation[1])
