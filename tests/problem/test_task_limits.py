"""Limits on states in problem files: their units, whose they are, and what is refused."""

import numpy as np
import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.limits.kinds.states import direction
from pneumorph.limits.table import in_history
from pneumorph.problem import Problem, loads

SECOND = {"name": "bend", "pressure": {"A": "30 kPa"}, "objective": {"kind": "maximize", "motion": "bending_y"}}


def two_tasks(limits, **of_task) -> Problem:
    """A task that extends and one that bends; `of_task` are the limits of these by name."""
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    table["task"].append(dict(SECOND))
    table["limits"] |= limits
    for task in table["task"]:
        if task["name"] in of_task:
            task["limits"] = of_task[task["name"]]
    return Problem.model_validate(table)


def bounds(problem: Problem) -> dict[str, float]:
    of_shape = {key for _, key, _ in in_history(two_tasks({}))}
    return {key: bound for _, key, bound in in_history(problem) if key not in of_shape}


def test_bounds_are_in_the_units_that_are_shown():
    problem = two_tasks({"motion": {"tilt": "0.1 rad", "shift": "0.05 cm", "torsion": "2 deg"}})
    assert bounds(problem) == pytest.approx({"tilt_deg": np.degrees(0.1), "shift_mm": 0.5, "twist_deg": 2.0})


def test_limits_of_a_task_come_before_those_of_all_key_by_key():
    problem = two_tasks({"motion": {"tilt": "1 deg", "twist": "2 deg"}}, bend={"motion": {"tilt": "90 deg"}})
    wanted = {"tilt_deg of extend": 1.0, "tilt_deg of bend": 90.0, "twist_deg": 2.0}
    assert bounds(problem) == pytest.approx(wanted)
    assert bounds(two_tasks({}, bend={"motion": {"shift_x": "1 mm"}})) == {"shift_x_mm": 1.0}


def test_least_motions_have_a_direction():
    problem = two_tasks({"at_least": {"axial": "1 mm"}}, bend={"at_least": {"bending_y": "-3 deg"}})
    assert bounds(problem) == pytest.approx({"least_extension_mm": 1.0, "least_bending_y_deg": 3.0})
    extend, bend = problem.task
    assert direction("extension", problem, extend) == 1.0 and direction("bending_y", problem, bend) == -1.0


def test_a_least_motion_that_symmetry_forbids_is_refused():
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    table["body"]["symmetry"] = {"mirror": ["yz"]}
    table["limits"] |= {"at_least": {"bending_y": "3 deg"}}
    with pytest.raises(ProblemError, match=r"limits\.at_least\.bending_y: .*mirror \"yz\""):
        Problem.model_validate(table)


def test_what_is_made_small_has_something_to_do():
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    table["task"][0]["objective"] = {"kind": "minimize", "of": "mass"}
    with pytest.raises(ProblemError, match=r"task\[0\]\.objective\.of: .*at_least"):
        Problem.model_validate(table)
    table["limits"] |= {"at_least": {"extension": "1 mm"}}
    Problem.model_validate(table)
    table["task"][0]["objective"]["of"] = "pressure"
    with pytest.raises(ProblemError, match=r"task\[0\]\.objective\.of: .*designed"):
        Problem.model_validate(table)


def test_a_sensitivity_is_for_motions_of_its_unit():
    for one, key in (("2 deg/kPa", "angle"), ("2 mm/kPa", "length")):
        assert bounds(two_tasks({"sensitivity": one})) == pytest.approx({f"sensitivity_of_{key}": 2.0})
    both = two_tasks({"sensitivity": {"angle": "2 °/kPa", "length": "500 mm/MPa"}})
    assert bounds(both) == pytest.approx({"sensitivity_of_angle": 2.0, "sensitivity_of_length": 0.5})


@pytest.mark.parametrize(
    ("limits", "of_task", "key"),
    [
        ({"sensitivity": "2 kPa"}, {}, r"limits\.sensitivity: .*deg/kPa"),
        ({"sensitivity": "-2 deg/kPa"}, {}, r"limits\.sensitivity: "),
        ({}, {"extend": {"sensitivity": "2 deg/kPa"}}, r"task\[0\]\.limits\.sensitivity: is for a rotation"),
        ({"motion": {"tilt": "0 deg"}}, {}, r"limits\.motion\.tilt: .*not above zero"),
        ({"at_least": {"twist": "0 deg"}}, {}, r"limits\.at_least\.twist: .*no least motion"),
        ({"at_least": {"tilt": "1 deg"}}, {}, r"limits\.at_least\.tilt: "),
        ({"motion": {"tilt": "1 mm"}}, {}, r"limits\.motion\.tilt: "),
        ({"motion": {"lean": "1 deg"}}, {}, r"limits\.motion\.lean: "),
        ({}, {"extend": {"wall": "1 mm"}}, r"task\[0\]\.limits\.wall: "),
    ],
)
def test_what_does_not_fit_is_refused_by_its_key(limits, of_task, key):
    with pytest.raises(ProblemError, match=key):
        two_tasks(limits, **of_task)


def test_they_are_written_as_they_are_read():
    problem = two_tasks({"motion": {"tilt": "1 deg"}, "sensitivity": "2 deg/kPa"}, bend={"motion": {"shift": "3 mm"}})
    assert loads(problem.to_toml()) == problem


def test_a_least_motion_the_other_way_is_told_with_its_sign():
    def told(problem: Problem) -> dict[str, str]:
        return {key: limit.asked(bound) for limit, key, bound in in_history(problem) if key.startswith("least")}

    both = two_tasks({"at_least": {"bending_y": "-1 deg", "extension": "2 mm"}})
    assert told(both) == {"least_bending_y_deg": "-1° or farther", "least_extension_mm": "at least 2 mm"}
    # As far in two directions are two limits.
    apart = two_tasks({"at_least": {"bending_y": "-1 deg"}}, bend={"at_least": {"bending_y": "1 deg"}})
    assert told(apart) == {
        "least_bending_y_deg of extend": "-1° or farther",
        "least_bending_y_deg of bend": "at least 1°",
    }
