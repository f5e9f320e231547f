"""Rubber and moulds of designs, of bodies for which both are known."""

import math

import pytest

from pneumorph.geometry.starting import body_of
from pneumorph.problem import Problem
from pneumorph.proposals.making import difficulty, rubber_volume


def tube(**body):
    """A round tube of 40 mm with a chamber of 30 mm."""
    chamber = {"name": "A", "radius": "5 mm", "center": ["0 mm", "0 mm"], "span": ["5 mm", "35 mm"]}
    return Problem.model_validate(
        {
            "material": {"name": "Dragon Skin 30"},
            "body": {"length": "40 mm", "radius": "9 mm", "chamber": [chamber]} | body,
            "task": [{"name": "go", "pressure": {"A": "10 kPa"}, "objective": {"motion": "extension"}}],
        }
    )


def test_the_rubber_is_what_is_between_exterior_and_chambers():
    exact = math.pi * (81.0 * 40.0 - 25.0 * 30.0)
    assert rubber_volume(body_of(tube())) == pytest.approx(exact, rel=0.01)


def test_a_plain_tube_needs_two_pieces_and_threads_more_or_stretch_the_rubber():
    pytest.importorskip("OCP")
    ripple = {"amplitude": "1.5 mm", "period": "40 mm", "lobes": 5}
    plain, threaded = tube(), tube(ripple=ripple, control_density="0.8 /mm")
    assert difficulty(plain, body_of(plain)).startswith("2 mould pieces, 1 core")
    assert "undercuts" not in difficulty(plain, body_of(plain))
    told = difficulty(threaded, body_of(threaded))
    assert "undercuts" in told or not told.startswith("2 ")
