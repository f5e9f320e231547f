"""The size of elements that is chosen for an error of the mesh."""

import pytest
from texts import problem_text
from tiny import tiny

from pneumorph import ProblemError
from pneumorph.analysis import analyse, analyse_body, is_estimated, outgrown, quick_errors
from pneumorph.analysis.sized import AIM, ENOUGH, Sized, chosen, next_size, relative_error, sized
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.runs import prepare_run
from pneumorph.optimize.buckling import judge
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.events import Remeshed
from pneumorph.optimize.iterate import AnalysedDesign
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.trial import analyse_trial
from pneumorph.problem import loads
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


def test_the_error_is_as_asked_for_on_the_chosen_size(problem):
    found = sized(problem)
    assert found.mesh.size < problem.mesh.size and found.mesh.error == 0.06
    at = analyse_body(found, starting_body(found.tubes))
    assert 0.02 < relative_error(found, at.disc, at.analysis) <= 0.06


def test_a_size_follows_from_the_order_that_two_meshes_show():
    """Where errors fall with the square of the size, a quarter of the error takes half the size."""
    found = [Sized(8.0, 0.16, 100), Sized(4.0, 0.04, 800)]
    assert next_size(found, 0.01 / AIM) == pytest.approx(2.0, rel=1e-2)


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


def test_a_design_that_has_outgrown_its_mesh_gets_smaller_elements():
    """Every fifth design is looked at, and its body meshed anew with elements of the size that its error asks for."""
    problem = loads(tiny(size='"6 mm"\nelement = "quadratic"\nerror = "1 %"', pressure='{ A = "60 kPa" }'))
    setup, clock = build_setup(problem), Clock()
    phi = setup.space.start
    disc = setup.discretise(setup.space.body(phi), 0.0)
    analysis = analyse(problem, setup.space, disc, phi)
    assert [is_estimated(problem, number) for number in (0, 4, 5)] == [True, False, True]
    without = problem.with_changes({"mesh.error": False})
    assert not any(is_estimated(without, number) for number in (0, 5))
    errors = quick_errors(problem, disc, analysis)
    assert outgrown(problem, disc, {}) is None
    size = outgrown(problem, disc, errors)
    assert 0.4 * disc.morph.size <= size < disc.morph.size
    now = AnalysedDesign(analysis, disc, setup.certify(phi), judge(disc, analysis, {}))
    events = list(follow := Kept(analyse_trial(setup, 6, now, phi, clock, 4.8)))
    assert [type(event) for event in events] == [Remeshed]
    assert follow.value.disc.morph.size == pytest.approx(4.8, rel=0.1)
    assert follow.value.disc.model.elements > disc.model.elements and follow.value.analysis is not None


class Kept:
    """A generator whose value is kept."""

    def __init__(self, of):
        self._of, self.value = of, None

    def __iter__(self):
        self.value = yield from self._of


def test_a_run_is_resumed_with_the_size_that_was_chosen_for_it(problem, tmp_path):
    create(tmp_path / "run", problem.with_changes({"mesh.size": "3.3 mm"}))
    assert prepare_run(problem, tmp_path / "run", resume=True).problem.mesh.size == pytest.approx(3.3, rel=1e-12)
    with pytest.raises(ProblemError, match="another problem"):
        prepare_run(problem.with_changes({"mesh.error": False, "mesh.size": "8 mm"}), tmp_path / "run", resume=True)
