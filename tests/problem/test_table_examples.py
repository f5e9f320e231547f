"""What is no table but should be one is refused with an example that is one."""

import copy
import tomllib

import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem

TABLES = [
    ("limits",),
    *(("limits", key) for key in ("fold", "at_least", "motion", "stiffness", "envelope", "scaling")),
    *((key,) for key in ("gravity", "mesh", "optimizer", "contact", "make", "robust", "design", "material")),
    ("end_effector", "spring"),
    ("end_effector", "hold"),
    *(("body", key) for key in ("symmetry", "ripple", "dome")),
    ("task", 0, "pressure"),
    ("task", 0, "volume"),
    ("task", 0, "objective"),
]


def faults(path, value):
    data = copy.deepcopy(tomllib.loads(tiny()))
    at = data
    for part in path[:-1]:
        at = at[part] if isinstance(part, int) else at.setdefault(part, {})
    at[path[-1]] = value
    try:
        Problem.model_validate(data)
    except ProblemError as error:
        return error.faults
    return ()


@pytest.mark.parametrize("path", TABLES, ids=str)
def test_the_example_of_a_table_is_one(path):
    message = next(each for each in faults(path, 3) if "should be a table" in each)
    example = tomllib.loads(message.split("write e.g. ")[1])[path[-1]]
    refused = [
        each for each in faults(path, example) if any(words in each for words in ("should be", "unknown", "missing"))
    ]
    assert isinstance(example, dict) and refused == []


def test_the_example_has_what_was_given_where_a_key_takes_it():
    (told,) = faults(("limits", "fold"), "0.3 mm")
    keys, example = told.split("; write e.g. ")
    assert keys == "limits.fold: should be a table with keys such as distance, neighbourhood"
    assert example == 'fold = { distance = "0.3 mm" }'
    assert faults(("limits", "fold"), "3 kPa")[0].endswith('fold = { distance = "1 mm" }')
