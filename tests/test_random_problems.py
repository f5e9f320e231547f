"""The random problems of the yield benchmark: reproducible one by one, and of every class."""

import importlib
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from pneumorph.objective.kinds import custom
from pneumorph.objective.kinds.trial import Fault
from pneumorph.problem import load
from pneumorph.problem.material import library

FOLDER = Path(__file__).parents[1] / "benchmarks"


def benchmark(name):
    """A module of the folder of benchmarks, which is not a package."""
    sys.path.insert(0, str(FOLDER))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def random_problems():
    return benchmark("random_problems")


@pytest.fixture(scope="module")
def random_bodies():
    return benchmark("random_bodies")


@pytest.fixture
def tried_here(monkeypatch):
    """The functions that are drawn are tried in this process: one of its own for each takes seconds."""

    def fault_of(asked):
        found = custom.shape_of(asked)
        return None if found is None else Fault(*found)

    monkeypatch.setattr(custom, "fault_of", fault_of)


def test_every_class_is_met(random_problems, tried_here):
    drawn = [random_problems.draw(3, index) for index in range(45)]
    assert {one.layout for one in drawn} == set(random_problems.LAYOUTS)
    assert {one.objective for one in drawn} == set(random_problems.KINDS)
    assert {tomllib.loads(one.text)["material"]["name"] for one in drawn} == set(library())
    flags = {flag for one in drawn for flag in one.flags}
    assert flags >= {"pole", "mixed", "gravity", "spring", "symmetry", "lobes", "several tasks", "free pressures"}


def test_a_problem_is_drawn_again_by_its_number_alone(random_problems):
    assert random_problems.draw(5, 11) == random_problems.draw(5, 11)
    assert random_problems.draw(5, 11).text != random_problems.draw(6, 11).text


@pytest.mark.parametrize("index", [0, 1])
def test_a_body_from_a_file_is_drawn_again_and_is_within_its_envelope(random_bodies, index, tmp_path):
    drawn = random_bodies.draw(4711, index)
    assert drawn == random_bodies.draw(4711, index)
    assert drawn.layout == random_bodies.KINDS[index]
    drawn.write(tmp_path / "problem.toml")
    problem = load(tmp_path / "problem.toml")
    assert problem.limits.wall < 0.1 * problem.body.length
    if problem.limits.envelope is not None:
        lower, upper = np.sort(problem.limits.envelope.box, axis=0)
        points = problem.body.outline.points
        assert max((points - upper).max(), (lower - points).max()) <= 1e-9
