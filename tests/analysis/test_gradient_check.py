"""Which directions of a problem have a gradient to test, and what is said of the others."""

import numpy as np
from tiny import tiny

from pneumorph.analysis import GradientCheck, analyse_body, gradient, run_gradient_check, starting
from pneumorph.analysis.gradient import is_flat
from pneumorph.errors import MeshError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads
from pneumorph.sensitivity import TaylorTest


def checked(text):
    problem = loads(text)
    return run_gradient_check(analyse_body(problem, starting_body(problem.tubes)))


def test_an_angle_that_is_zero_by_symmetry():
    """A designed pressure does not bend a tube about its mirror plane, whose halves are solved."""
    free = '{ A = { start = "20 kPa", min = "0 kPa", max = "60 kPa" } }'
    text = tiny(pressure=free, objective='{ motion = "bending_y" }')
    check = checked(text)
    assert check.passed and "WRONG" not in str(check)


def test_what_remains_of_such_an_angle_on_a_mesh_is_flat():
    """Bending of a tube of 80 mm about its plane of symmetry, with remainders that are no second order."""
    remainders = np.array([4e-9, 2.5e-9, 2e-9, 1.9e-9])
    test = TaylorTest(0.05 * 0.5 ** np.arange(4), remainders, np.log2(remainders[:-1] / remainders[1:]))
    assert not test.passed
    assert is_flat(test, 3e-6, 0.3)
    assert not is_flat(test, 1e-2, 0.3)


def test_a_designed_pressure_is_tested_also_from_zero():
    check = checked(tiny(pressure='{ A = { start = "0 kPa", min = "0 kPa", max = "60 kPa" } }'))
    assert list(check.tests) == ["pressures"] and check.passed
    assert all("the body does not move" in reason for reason in check.nothing.values()) and len(check.nothing) == 2


def test_a_fine_mesh_is_not_needed(monkeypatch):
    """A test on a coarser mesh finds what a wrong gradient on the fine one would show: both come from the same code."""
    problem = loads(tiny(size='"2.5 mm"', pressure='{ A = "20 kPa" }'))
    monkeypatch.setattr(gradient, "ENOUGH", 500)
    at = analyse_body(problem, starting_body(problem.tubes))
    check = run_gradient_check(at)
    assert check.passed and 250 < check.elements < 750 < at.disc.model.elements
    exact = gradient.design_gradient
    monkeypatch.setattr(gradient, "design_gradient", lambda *of: 1.01 * exact(*of))
    assert not run_gradient_check(at).passed


def test_where_no_coarser_mesh_can_be_made_the_own_one_is_used(monkeypatch):
    def fails(*_):
        raise MeshError("too coarse")

    problem = loads(tiny())
    at = analyse_body(problem, starting_body(problem.tubes))
    monkeypatch.setattr(gradient, "ENOUGH", 100)
    monkeypatch.setattr(starting, "mesh_of", fails)
    check = run_gradient_check(at)
    assert check.passed and check.elements == at.disc.model.elements


def test_remainders_at_the_noise_are_rounding():
    zero = TaylorTest(np.ones(4), np.zeros(4), np.zeros(3))
    assert GradientCheck({"a": zero}, 0.0, 9).passed
    assert str(GradientCheck({"a": zero}, 0.0, 9, {"b": "so it is"})).splitlines()[1] == "b: nothing to test, so it is"
