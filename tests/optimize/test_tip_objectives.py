"""Objectives about the stiffness of the tip, the force with which it is held, and the stretch of the rubber."""

from dataclasses import replace

import numpy as np
import pytest
from designing import BRIEFLY, accepted, analysed
from tiny import tiny

from pneumorph.analysis import analyse
from pneumorph.analysis.slopes import design_gradient
from pneumorph.errors import ProblemError
from pneumorph.mechanics import TOLERANCE, part_of, solve
from pneumorph.optimize import design
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import measured_of, response, taylor_test

PRESSURE = '{ A = { start = "50 kPa", min = "0 kPa", max = "100 kPa" } }'
TIGHT = 1e-11
QUARTER = {"body.symmetry": {"mirror": ["xz", "yz"]}}
MIXED = {"mesh.element": "mixed"}


def asked(objective: dict, hold: dict | None = None, on_axis: bool = False, least: dict | None = None, **changes):
    """A tube whose chamber is off its axis, with a moment, so that the tip bends, shifts and twists."""
    table = loads(tiny(pressure=PRESSURE, iterations="3")).model_dump(mode="json", exclude_none=True)
    table["end_effector"] = {}
    if not on_axis:
        table["body"]["chamber"][0]["center"] = ["1 mm", "0.5 mm"]
        table["end_effector"] = {"moment": ["0 N*mm", "5 N*mm", "20 N*mm"]}
    table["task"][0] |= {"objective": objective} | ({"hold": hold} if hold else {})
    table["limits"] |= {"margin": 1, "strain": "off", "at_least": least or {}}
    return Problem.model_validate(table).with_changes(changes)


def stiffness(motion: str, tip: str = "stiff", **changes) -> Problem:
    return asked({"kind": "stiffness", "motion": motion, "tip": tip}, **changes)


def blocked(motion: str, hold: dict, **changes) -> Problem:
    return asked({"kind": "blocked", "motion": motion}, hold, **changes)


CASES = {
    "against a shift": stiffness("shift_x"),
    "against bending, soft": stiffness("bending_y", "soft"),
    "against twist, mixed": stiffness("torsion", **MIXED),
    "free tip": stiffness("shift_x", end_effector={"kind": "free"}),
    "half": stiffness("shift_x", on_axis=True, **{"body.symmetry": {"mirror": ["xz"]}}),
    "force at rest": blocked("extension", {"extension": "0 mm"}),
    "force where it is moved": blocked("-bending_y", {"bending_y": "3 deg"}),
    "force, quarter": blocked(
        "extension", {"axial": "0.2 mm"}, on_axis=True, **{"body.symmetry": {"mirror": ["xz", "yz"]}}
    ),
    "stretch": asked({"kind": "minimize", "of": "stretch"}, least={"extension": "0.01 mm"}),
}


@pytest.mark.parametrize("problem", CASES.values(), ids=list(CASES))
def test_the_gradient_is_exact(problem):
    space, disc, _ = analysed(problem)
    # A force at a hold has the error of the state to first order.
    found = analyse(problem, space, disc, space.start, tolerance=TIGHT)
    slope = design_gradient(problem, space, disc, found)
    starts = {name: each.state for name, each in found.equilibria.items()}
    rng = np.random.default_rng(1)
    shape = np.arange(space.n) < space.n_shape
    ways = {"shape": np.where(shape, rng.uniform(-0.2, 0.2, space.n), 0.0), "pressure": np.where(shape, 0.0, 0.3)}
    for way, direction in ways.items():

        def value(phi):
            return analyse(problem, space, disc, phi, starts, tolerance=TIGHT).value

        test = taylor_test(value, space.start, slope, direction, 0.1, count=3, start=found.value)
        assert abs(test.rate - 2.0) < 0.02, (way, test)


@pytest.mark.parametrize("motion, number", [("shift_x", 0), ("bending_y", 4), ("twist", 5)])
def test_the_stiffness_is_that_of_a_small_load(motion, number):
    _, disc, found = analysed(stiffness(motion))
    at, equilibrium = found.configurations["extend"], found.equilibria["extend"]
    size, moved = 1e-3, []
    for load in (size * np.eye(6)[number], -size * np.eye(6)[number]):
        there = replace(at, loads=at.loads._replace(wrench=at.loads.wrench + load))
        moved.append(solve(there, disc.tangents["extend"], equilibrium.state, TOLERANCE).plate[number])
    assert -found.value == pytest.approx(2 * size / (moved[0] - moved[1]), rel=1e-6)
    tip = response(at, disc.tangents["extend"], equilibrium.state, measured_of())
    assert -found.value == pytest.approx(1.0 / tip.compliance[number, number], rel=1e-9)


def test_part_of_a_body_is_as_stiff_as_the_whole_and_is_solved_where_the_force_keeps_its_symmetry():
    mirror = {"body.symmetry": {"mirror": ["xz"]}}
    half = stiffness("shift_x", on_axis=True, **mirror)
    assert part_of(half) and not part_of(stiffness("shift_y", on_axis=True, **mirror))
    plain = asked({"kind": "maximize", "motion": "extension"}, on_axis=True, **mirror)
    limited = plain.with_changes({"limits.stiffness": {"shift_y": "0.1 N/mm"}})
    assert part_of(plain) and not part_of(limited)
    whole = stiffness("shift_x", on_axis=True)
    assert analysed(half)[2].value == pytest.approx(analysed(whole)[2].value, rel=2e-2)


def test_the_force_is_the_reaction_of_what_holds_the_tip():
    _, _, found = analysed(blocked("extension", {"extension": "0 mm"}))
    assert -found.value == pytest.approx(found.equilibria["extend"].reaction[2]) and found.value < 0


def test_the_stretch_is_just_above_the_largest():
    _, _, found = analysed(CASES["stretch"])
    largest = max(found.equilibria["extend"].stretches.values())
    assert largest <= found.value <= largest + 0.03


@pytest.mark.parametrize("name", ["against a shift", "force at rest", "stretch"])
def test_designs_improve(name):
    entries = [event.entry for event in accepted(design(CASES[name], settings=BRIEFLY))]
    assert entries[-1].objective < entries[0].objective


@pytest.mark.parametrize(
    "objective, hold, key",
    [
        ({"kind": "stiffness", "motion": "shift_x"}, {"shift_x": "0 mm"}, "task[0].objective.motion"),
        ({"kind": "blocked", "motion": "extension"}, None, "task[0].objective.motion"),
        ({"kind": "stiffness", "motion": "sideways"}, None, "task[0].objective.motion"),
    ],
)
def test_what_makes_no_sense_is_refused(objective, hold, key):
    with pytest.raises(ProblemError, match=key.replace("[", r"\[").replace("]", r"\]")):
        asked(objective, hold)


def test_a_limit_on_what_is_held_is_refused():
    with pytest.raises(ProblemError, match=r"limits\.stiffness\.extension"):
        blocked("extension", {"extension": "0 mm"}).with_changes({"limits.stiffness": {"extension": "1 N/mm"}})
