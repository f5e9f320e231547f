"""Other solvers on a coarse body, and the maps between their nodal values and ours."""

from dataclasses import replace

import numpy as np
import pytest
from installed import needs

from pneumorph.geometry.tube.start import starting_body
from pneumorph.verify import calculix, ring, solvers, symbolic
from pneumorph.verify.actuator import several_rubbers
from pneumorph.verify.solids import octant


def short():
    """A length at which CalculiX takes seconds, not minutes."""
    return several_rubbers(16.0)


def short_start():
    return starting_body(short().body)


def test_ngsolve_has_the_curved_volume():
    needs(symbolic.ngsolve)
    ng = symbolic.ngsolve()
    mesh = octant(4, 8, (1, 2, 2))
    body = symbolic.ngsolve_mesh(mesh)
    # The wall and the outside see all of a body whose other faces lie in planes through the origin.
    assert ng.Integrate(ng.CF(1) * ng.dx, body.mesh) == pytest.approx(mesh.volume(), rel=1e-12)


def test_ngsolve_coefficients_and_nodal_values_are_one_to_one():
    needs(symbolic.ngsolve)
    mesh = octant(4, 8, (1, 2, 2))
    body = symbolic.ngsolve_mesh(mesh)
    u = np.random.default_rng(0).standard_normal(mesh.points.shape)
    assert np.abs(symbolic.nodal(body, body.to_coefficients @ u.ravel()) - u).max() < 1e-12


@pytest.mark.parametrize("solver", [solvers.ngsolve, solvers.calculix])
def test_a_solver_agrees_on_a_coarse_tube(solver):
    needs({solvers.ngsolve: symbolic.ngsolve, solvers.calculix: calculix.program}[solver])
    verdicts = list(solver(solvers.start, 8.0))
    assert len(verdicts) == 3
    for verdict in verdicts:
        assert verdict.passed, verdict


@pytest.mark.parametrize("solver", [solvers.ngsolve, solvers.calculix])
def test_a_solver_agrees_on_a_tube_of_three_rubbers(solver):
    needs({solvers.ngsolve: symbolic.ngsolve, solvers.calculix: calculix.program}[solver])
    verdicts = list(solver(short_start, 6.0, short))
    assert len(verdicts) == 3
    for verdict in verdicts:
        assert verdict.passed, verdict


def test_a_ring_on_itself_agrees():
    needs(calculix.program)
    verdicts = list(ring.self_contact(16, 0.005, (9.0, 10.4, 10.8), {}))
    assert len(verdicts) == 3
    for verdict in verdicts:
        assert verdict.passed, verdict
    assert verdicts[1].ours < 2.0 * verdicts[0].ours < 0.0, "the wall has not met itself"


@pytest.mark.slow
def test_a_fine_ring_agrees():
    needs(calculix.program)
    for verdict in ring.self_contact():
        assert verdict.passed, verdict


def test_a_ring_that_meets_itself_too_early_fails():
    needs(calculix.program)
    assert not list(ring.self_contact(16, 0.05, (9.0, 10.4), {}))[1].passed


def test_sums_of_forces_are_read():
    text = (
        " total force (fx,fy,fz) for set TIP and time  0.1000000E+01\n\n"
        "        1.5E-01 -6.47E-02 -4.6E-03\n\n"
        " total force (fx,fy,fz) for set TIP and time  0.2000000E+01\n\n"
        "       -1.0E-02  2.00E+00  3.0E+00\n"
    )
    assert calculix.total_forces(text).tolist() == [[0.15, -0.0647, -0.0046], [-0.01, 2.0, 3.0]]


def test_another_answer_fails():
    _, _, found = solvers.inflated(solvers.start, 8.0)
    assert all(verdict.passed for verdict in solvers.compared(found, found.u, found.plate, 1e-6))
    other = replace(found, u=1.01 * found.u, plate=1.01 * found.plate)
    assert not any(verdict.passed for verdict in solvers.compared(other, found.u, found.plate, 5e-3))
