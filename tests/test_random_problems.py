"""The random problems of the yield benchmark: reproducible one by one, and of every class."""

import importlib.util
import sys
import tomllib
from pathlib import Path

import pytest

from pneumorph.problem.material import library

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "random_problems.py"


@pytest.fixture(scope="module")
def random_problems():
    spec = importlib.util.spec_from_file_location("random_problems", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_every_class_is_met(random_problems):
    drawn = [random_problems.draw(3, index) for index in range(45)]
    assert {one.layout for one in drawn} == set(random_problems.LAYOUTS)
    assert {one.objective for one in drawn} == set(random_problems.KINDS)
    assert {tomllib.loads(one.text)["material"]["name"] for one in drawn} == set(library())
    flags = {flag for one in drawn for flag in one.flags}
    assert flags >= {"pole", "mixed", "gravity", "spring", "symmetry", "lobes", "several tasks", "free pressures"}


def test_a_problem_is_drawn_again_by_its_number_alone(random_problems):
    assert random_problems.draw(5, 11) == random_problems.draw(5, 11)
    assert random_problems.draw(5, 11).text != random_problems.draw(6, 11).text
