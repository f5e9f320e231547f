"""The size of elements that is chosen for an error of the mesh."""

import numpy as np
import pytest
from texts import problem_text

from pneumorph import ProblemError
from pneumorph.analysis import MeshError, analyse_body
from pneumorph.analysis.sized import (
    AIM,
    COARSER,
    ENOUGH,
    Sized,
    chosen,
    motion_share,
    next_size,
    relative_error,
    relative_errors,
    sized,
)
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.runs import prepare_run
from pneumorph.problem import loads
from pneumorph.results import FineResult
from pneumorph.run.opening import create

TASK = """
[[task]]
name = "move"
pressure = { A = "40 kPa" }
objective = { motion = "extension" }
[mesh]
size = "8 mm"
element = "quadratic"
error = "6 %"
"""


@pytest.fixture(scope="module")
def problem():
    return loads(problem_text(TASK, radius=10, body='symmetry = { mirror = ["xz", "yz"] }'))


def test_the_chosen_size_has_three_times_the_error_that_is_asked_for(problem):
    """Grading begins from there."""
    found = sized(problem.with_changes({"mesh.error": "2 %"}))
    assert found.mesh.size < problem.mesh.size and found.mesh.error == 0.02
    at = analyse_body(found, starting_body(found.tubes))
    assert 0.02 < relative_error(found, at.disc, at.analysis) <= COARSER * 0.02


def test_a_size_follows_from_the_order_that_two_meshes_show():
    """Where errors fall with the square of the size, a quarter of the error takes half the size."""
    found = [Sized(8.0, 0.16, 100), Sized(4.0, 0.04, 800)]
    assert next_size(found, 0.01 / AIM) == pytest.approx(2.0, rel=1e-2)


def test_a_motion_that_is_hardly_there_has_no_huge_error(problem):
    """Bending of a straight tube that extends, which an uneven mesh makes: 0.01° beside 1 mm."""
    still = {name: {} for name in ("errors", "volumes", "contact", "contact_normal", "contact_area")}
    here, fine = (
        FineResult(0.0, translation=(0.0, 0.0, z), rotation=(0.0, bend, 0.0), **still)
        for z, bend in ((1.0, 2e-4), (1.02, 0.0))
    )
    error = MeshError(here, fine)
    np.testing.assert_allclose(relative_errors(error)[[2, 4]], [0.02, 2e-4 / 0.01], rtol=1e-5)
    (task,) = problem.task
    bending = task.model_copy(update={"objective": task.objective.model_copy(update={"motion": "bending_y"})})
    assert motion_share(task, error) == pytest.approx(0.02, rel=1e-5)
    assert motion_share(bending, error) == pytest.approx(0.02, rel=1e-5)


def test_percentages_are_read_and_written(problem):
    assert problem.mesh.error == 0.06
    assert loads(problem.to_toml()).mesh.error == 0.06
    with pytest.raises(ProblemError, match=r"mesh.error"):
        problem.with_changes({"mesh.error": "6"})


def falling(order, constant=0.01):
    """Meshes of a body of 8000 mm³ whose error falls with a power of the size."""
    return lambda size: Sized(size, constant * size**order, round(8.0 * 8000.0 / size**3))


@pytest.mark.parametrize("order", [1.0, 1.2, 2.0, 3.5])
@pytest.mark.parametrize("first", [2.0, 10.0])
def test_the_error_is_met_whatever_its_order_is(order, first):
    estimated = falling(order)
    size = chosen(estimated, first, 0.03, coarsest=15.0)
    assert ENOUGH * 0.03 <= estimated(size).error <= 0.03


def test_elements_are_no_larger_than_possible():
    assert chosen(falling(1.2, 1e-4), 2.0, 0.03, coarsest=3.0) == 3.0


def test_more_elements_than_can_be_solved_are_refused():
    with pytest.raises(ProblemError, match=r"mesh.error: 0.01 % takes"):
        chosen(falling(1.2), 4.0, 1e-4, coarsest=15.0)


def test_a_run_is_resumed_with_the_size_that_was_chosen_for_it(problem, tmp_path):
    create(tmp_path / "run", problem.with_changes({"mesh.size": "3.3 mm"}))
    assert prepare_run(problem, tmp_path / "run", resume=True).problem.mesh.size == pytest.approx(3.3, rel=1e-12)
    with pytest.raises(ProblemError, match="another problem"):
        prepare_run(problem.with_changes({"mesh.error": False, "mesh.size": "8 mm"}), tmp_path / "run", resume=True)
