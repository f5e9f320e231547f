"""A tube with a bent axis straightens under pressure, by halves as by the whole, and its gradient is exact."""

import pytest

from pneumorph.analysis import analyse_body, run_gradient_check
from pneumorph.geometry.starting import body_of
from pneumorph.problem import Problem

CHAMBER = {"name": "A", "radius": "5 mm", "center": ["0 mm", "0 mm"], "span": ["4 mm", "36 mm"], "ends": "pole"}


def analysed(mirror):
    axis = [{"length": "10 mm"}, {"length": "30 mm", "bend": "70 deg"}]
    body = {"axis": axis, "radius": "8 mm", "control_density": "0.3 /mm", "symmetry": {"mirror": mirror}}
    problem = Problem.model_validate(
        {
            "material": {"name": "Dragon Skin 20"},
            "body": body | {"chamber": [CHAMBER]},
            "task": [{"name": "straighten", "pressure": {"A": "8 kPa"}, "objective": {"motion": "-bending_y"}}],
            "mesh": {"size": "5 mm", "element": "quadratic"},
        }
    )
    return analyse_body(problem, body_of(problem))


def test_a_bent_tube_straightens_and_its_gradient_is_exact():
    whole, half = analysed([]), analysed(["xz"])
    turns = [at.analysis.equilibria["straighten"].plate[3:] for at in (whole, half)]
    # It bends to x, about y; under pressure it turns back.
    assert float(turns[0][1]) < -0.01
    assert abs(float(turns[0][0])) < 0.02 * abs(float(turns[0][1]))
    assert float(turns[1][1]) == pytest.approx(float(turns[0][1]), rel=0.03)
    assert half.disc.model.elements < 0.7 * whole.disc.model.elements
    tested = run_gradient_check(half)
    assert tested.passed
    for test in tested.tests.values():
        assert test.rate == pytest.approx(2.0, abs=0.02)
