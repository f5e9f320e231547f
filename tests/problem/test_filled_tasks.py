"""Tasks without pressures in problem files, and numbers that are not finite."""

import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, loads


def table() -> dict:
    return loads(tiny()).model_dump(mode="json", exclude_none=True)


def test_a_task_whose_chambers_are_all_filled_is_told_how_to_have_no_pressures():
    filled = table()
    task = filled["task"][0]
    del task["pressure"]
    task["volume"] = {"A": "1 ml"}
    with pytest.raises(ProblemError, match=r"task\[0\].pressure: .*pressure = \{\}"):
        Problem.model_validate(filled)
    task["pressure"] = {}
    assert Problem.model_validate(filled).task[0].volumes == {"A": 1000.0}


def test_an_infinite_number_is_not_taken_for_text():
    infinite = table()
    infinite["limits"]["margin"] = float("inf")
    with pytest.raises(ProblemError, match=r"limits.margin: .* is not finite"):
        Problem.model_validate(infinite)
