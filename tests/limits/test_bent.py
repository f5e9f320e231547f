"""Limits of tubes about a bent axis: certified values against those of a piece of a torus, and rows against these."""

import math

import numpy as np
import pytest

from pneumorph.geometry.tube import build_design_space, starting_body
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.table import ROWS
from pneumorph.problem import Problem

CURVATURE, CHAMBER, EXTERIOR = math.radians(60) / 40.0, 5.0, 8.0
AWAY = 0.01  # mm


def problem_with(ends):
    chamber = {"name": "A", "radius": f"{CHAMBER} mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "37 mm"]}
    chamber["ends"] = ends
    axis = [{"length": "40 mm", "bend": "60 deg", "towards": "30 deg"}]
    return Problem.model_validate(
        {
            "material": {"name": "Dragon Skin 20"},
            "body": {"radius": f"{EXTERIOR} mm", "axis": axis, "control_density": "0.5 /mm", "chamber": [chamber]},
            "task": [{"name": "bend", "pressure": {}, "objective": {"motion": "bending_y"}}],
            "limits": {"envelope": {"half_space": [{"point": ["0 mm", "0 mm", "50 mm"], "normal": [0, 0, 1]}]}},
        }
    )


@pytest.fixture(scope="module")
def problem():
    return problem_with("flat")


def test_certified_values_are_those_of_a_torus(problem):
    body = starting_body(problem.tubes)
    found = limits_of(problem, body).certify(body)
    assert found.satisfied()
    inside = CURVATURE / (1.0 - CHAMBER * CURVATURE)
    expected = {
        # From the plane of the base, and as far from that of the tip: the inner edges of the chamber's ends.
        "wall": (1.0 / CURVATURE - CHAMBER) * math.sin(3.0 * CURVATURE),
        "curvature": 0.5 * (CHAMBER**-2 + inside**2),
    }
    for name, value in expected.items():
        reading = found[name]
        sense = 1.0 if name == "curvature" else -1.0
        # It is between what some place attains and what is certified, far from its bound to a hundredth of the way.
        assert sense * (reading.attained - value) < 2e-3 * value
        assert sense * (reading.value - value) > -2e-3 * value
        assert abs(reading.value - value) < 5e-3 * value + 0.011 * abs(value - reading.bound)
    assert abs(found["ends"].value) < 1e-9
    # The highest place, outside the bend where it ends.
    high = (1.0 / CURVATURE + EXTERIOR) * math.sin(math.radians(60)) - 50.0
    assert found["envelope"].attained == pytest.approx(high, abs=0.05)


@pytest.mark.parametrize("kind", ["planes", "rim", "ends"])
def test_rows_of_tilted_planes_are_derivatives(problem, kind):
    """Heights over tilted planes change with the control points as rows say."""
    body = starting_body(problem.tubes)
    space, limits = build_design_space(problem, body), limits_of(problem, body)
    # So small a step that the same samples stay the worst of their cells.
    way = 1e-7 * np.sin(np.arange(space.n))
    here, there = (limits.rows(space.body(at), 6.0, -1.0) for at in (space.start, space.start + way))
    slope = here.jacobian @ (space.L @ way)
    own, after = here.kind == ROWS.index(kind), there.kind == ROWS.index(kind)
    np.testing.assert_array_equal(here.cell[own], there.cell[after])
    change = there.value[after] - here.value[own]
    assert np.count_nonzero(own) > 20
    assert np.median(np.abs(change - slope[own])) < 1e-3 * np.median(np.abs(change))


@pytest.fixture(scope="module")
def domed():
    """A problem whose chamber has poles at both ends, its design space, its limits, and a body far from its start."""
    problem = problem_with("pole")
    start = starting_body(problem.tubes)
    space, limits = build_design_space(problem, start), limits_of(problem, start)
    return space, limits, space.body(space.start + AWAY * np.sin(np.arange(space.n)))


def test_poles_across_a_bent_axis_are_enclosed(domed):
    """Certificates are above dense samples, of which those beside poles have tangents as at any other place."""
    _, limits, body = domed
    found = limits.certify(body)
    q, r = np.arange(96) / 96, np.linspace(0.004, 0.996, 800)
    most = 0.0
    for surface in body.surfaces:
        x_q, x_r, x_qq, x_qr, x_rr = (
            surface.sample(q, r, dq, dr) for dq, dr in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        )
        normal = np.cross(x_q, x_r)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        E, F, G = (np.sum(a * b, axis=-1) for a, b in ((x_q, x_q), (x_q, x_r), (x_r, x_r)))
        L, M, N = (np.sum(each * normal, axis=-1) for each in (x_qq, x_qr, x_rr))
        area = E * G - F**2
        twice_H, gauss = (E * N - 2.0 * F * M + G * L) / area, (L * N - M**2) / area
        most = max(most, float((0.5 * twice_H**2 - gauss).max()))
    reading = found["curvature"]
    assert most * (1.0 - 1e-9) <= reading.value
    assert reading.value <= 1.03 * most + 0.011 * abs(reading.bound - most)


def test_rows_at_poles_across_a_bent_axis_are_derivatives(domed):
    space, limits, _ = domed
    at = space.start + AWAY * np.sin(np.arange(space.n))
    way = 1e-7 * np.cos(3.0 * np.arange(space.n))
    here, there = (limits.rows(space.body(each), 6.0, -1.0) for each in (at, at + way))
    slope = here.jacobian @ (space.L @ way)
    for kind in ("curvature", "stretch"):
        own, after = (np.flatnonzero(each.kind == ROWS.index(kind)) for each in (here, there))
        # Where two samples are about as bad, they may have changed places.
        same = here.cell[own] == there.cell[after]
        assert np.count_nonzero(same) > 20
        assert np.mean(same) > 0.9
        change = (there.value[after] - here.value[own])[same]
        assert np.median(np.abs(change - slope[own][same])) < 1e-3 * np.median(np.abs(change))
