"""The verification cases at small size, and that a wrong answer does not pass."""

import numpy as np
import pytest

from pneumorph.errors import ComputationError
from pneumorph.mechanics import neo_hookean_rubber
from pneumorph.verify import (
    beams,
    cases,
    contact,
    element,
    homogeneous,
    inflation,
    memory,
    radial,
    rubbers,
    work,
    wound,
)
from pneumorph.verify.verdict import absolute, at_least, relative


@pytest.mark.parametrize(
    "case",
    [
        element.patch_test,
        element.rigid_rotation,
        *(case.verdicts for case in homogeneous.cases()),
        inflation.incompressible,
        inflation.limit_points,
        inflation.radial_references,
        inflation.thick_sphere,
        lambda: inflation.thick_sphere((2, 4, 4), 2e-3),
        inflation.plane_strain_tube,
        lambda: inflation.plane_strain_tube((2, 12, 1), 5e-3),
        lambda: inflation.lame_limit(2, 2e-2),
        beams.elastica_reference,
        lambda: work.energy_balance(8.0),
        lambda: work.blocked_force(8.0),
        memory.held,
        lambda: memory.cycled(30, 2e-3),
        memory.softened,
        contact.patch_test,
        lambda: contact.hertz((4, 3), 0.05),
        lambda: contact.energy_balance(8.0),
        lambda: contact.free_ball(6.0),
        lambda: rubbers.in_series(3.0, 2e-3),
        lambda: rubbers.side_by_side(3.0, 1e-3),
        lambda: wound.magic_angle((70.0,), 4.0),
        lambda: wound.one_family(4.0, 1e-2),
        lambda: wound.covered_tube(4.0),
        lambda: wound.half_covered(4.0),
        beams.layered,
    ],
)
def test_a_case_passes(case):
    verdicts = list(case())
    assert verdicts
    for verdict in verdicts:
        assert verdict.passed, verdict


@pytest.mark.slow
@pytest.mark.parametrize("case", [inflation.convergence, beams.moment, beams.force])
def test_a_long_case_passes(case):
    for verdict in case():
        assert verdict.passed, verdict


def test_a_wrong_rubber_fails():
    solid = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
    wrong = homogeneous.tension(solid, homogeneous.neo_hookean(0.4901), homogeneous.UNIAXIAL, (1.5,))
    assert not any(verdict.passed for verdict in wrong)


def test_a_wrong_pressure_fails(monkeypatch):
    right = radial.inflated
    monkeypatch.setattr(
        inflation, "inflated", lambda rubber, a, b, pressure, curved: right(rubber, a, b, 1.01 * pressure, curved)
    )
    assert not any(verdict.passed for verdict in inflation.thick_sphere((2, 4, 4), 2e-3))


def test_what_is_no_number_fails():
    assert not relative("x", float("nan"), 1.0, 1e-3).passed
    assert not absolute("x", float("nan"), 0.0, 1e-3).passed
    assert not at_least("x", float("nan"), 2.8).passed
    assert not at_least("x", 2.79, 2.8).passed
    assert at_least("x", 2.81, 2.8).passed


def test_names_are_different_and_sources_named():
    known = cases()
    assert len({case.name for case in known}) == len(known)
    assert all(case.source for case in known)


def test_the_radial_solver_says_where_there_is_no_state():
    with pytest.raises(ComputationError, match="radial boundary-value problem at 5 MPa"):
        radial.inflated(neo_hookean_rubber(0.49, 4.80, 1.1e-9), 10, 11, 5.0, radial.SPHERE)(np.array(10.0))
