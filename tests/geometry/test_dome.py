"""Tubes whose tip is a dome."""

import math

import numpy as np
import pytest

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mesh.tube.surface import surface_mesh
from pneumorph.problem import Problem, loads

TEXT = """
[material]
name = "Hei-Cast 8400"
[body]
length = "40 mm"
radius = "8 mm"
control_density = "0.5 /mm"
{body}
[body.dome]
{dome}
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["0 mm", "0 mm"]
span = ["4 mm", "{end} mm"]
ends = "{ends}"
[[task]]
name = "extend"
pressure = {{ A = "20 kPa" }}
objective = {{ kind = "maximize", motion = "extension" }}
[limits]
wall = "2 mm"
[mesh]
size = "3 mm"
"""


def problem(dome: str = "", body: str = "", end: float = 34.0, ends: str = "pole") -> Problem:
    return loads(TEXT.format(dome=dome, body=body, end=end, ends=ends))


@pytest.mark.parametrize("height", [5.0, 8.0, 12.0])
def test_volume_and_what_is_bonded_are_those_of_half_an_ellipsoid(height: float) -> None:
    spec = problem(f'height = "{height} mm"\nplate = "3 mm"').tubes
    body = starting_body(spec)
    exact = math.pi * 64 * (40 - height) + 2 / 3 * math.pi * 64 * height
    assert enclosed_volume(body.exterior) == pytest.approx(exact, rel=1e-4)
    mesh = surface_mesh(body, 3.0)
    nodes = mesh.B @ body.control_points()
    tip = nodes[np.unique(mesh.faces["tip"])]
    assert np.hypot(*tip[:, :2].T).max() == pytest.approx(3.0, abs=0.01)
    assert tip[:, 2].max() == pytest.approx(40.0, abs=1e-9)
    assert tip[:, 2].min() == pytest.approx(40 - height * (1 - math.sqrt(1 - 9 / 64)), abs=0.02)


def test_designs_keep_the_pole_at_the_length_of_the_body() -> None:
    asked = problem()
    body = starting_body(asked.tubes)
    space = build_design_space(asked, body)
    moved = space.body(space.start + np.random.default_rng(0).uniform(-0.2, 0.2, space.n)).exterior
    np.testing.assert_allclose(moved.net[-2:, :, 2], 40.0, atol=1e-9)
    assert np.ptp(moved.net[-1], axis=0).max() < 1e-9 < np.hypot(*moved.net[-1, 0, :2])
    np.testing.assert_allclose(moved.net[0, :, 2], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"dome": 'height = "50 mm"'}, "body.dome.height"),
        ({"dome": 'plate = "7 mm"'}, "body.dome.plate"),
        ({"body": 'symmetry = { mirror = ["xy"] }', "end": 36.0}, "body.dome"),
        ({"end": 39.0, "ends": "flat"}, "body.chamber[0].span"),
    ],
)
def test_what_a_dome_does_not_go_with_is_named(changes: dict, key: str) -> None:
    with pytest.raises(ProblemError, match=key.replace("[", r"\[").replace("]", r"\]")):
        problem(**changes)
