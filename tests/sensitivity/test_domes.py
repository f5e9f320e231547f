"""The gradient of a body whose tip is a dome, by the order of Taylor remainders."""

import numpy as np
import pytest

from pneumorph.analysis import analyse, analyse_body, design_gradient
from pneumorph.geometry.starting import body_of
from pneumorph.problem import loads
from pneumorph.sensitivity import taylor_test

FINGER = """
[material]
model = "neo-hookean"
shear_modulus = "0.15 MPa"
bulk_modulus = "1.5 MPa"
density = "1.1 g/cm^3"
[body]
length = "26 mm"
radius = "8 mm"
control_density = "0.4 /mm"
[body.dome]
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["1 mm", "0.5 mm"]
span = ["4 mm", "20 mm"]
ends = "pole"
[end_effector]
spring = { axial = "0.2 N/mm", bending_y = "20 N*mm/rad" }
[[task]]
name = "bend"
pressure = { A = "30 kPa" }
force = ["0.02 N", "0 N", "0.01 N"]
objective = { kind = "maximize", motion = "bending_y" }
[limits]
wall = "2 mm"
[mesh]
size = "4 mm"
"""


STRAIGHT = 'length = "26 mm"\n'
BENT = 'axis = [{ length = "26 mm", bend = "50 deg", towards = "20 deg" }]\n'


@pytest.mark.slow
@pytest.mark.parametrize("axis", [STRAIGHT, BENT])
def test_remainders_of_a_domed_finger_are_of_second_order(axis: str) -> None:
    problem = loads(FINGER.replace(STRAIGHT, axis))
    at = analyse_body(problem, body_of(problem))
    mesh = at.disc.morph.mesh
    # What is bonded to the plate is around the pole, and curved.
    assert set(np.unique(mesh.faces["tip"])) & set(np.unique(mesh.faces["exterior"]))
    assert np.ptp(mesh.points[np.unique(mesh.faces["tip"]), 2]) > 0.1
    slope = design_gradient(problem, at.space, at.disc, at.analysis)
    states = {name: each.state for name, each in at.analysis.equilibria.items()}

    def value(phi: np.ndarray) -> float:
        return analyse(problem, at.space, at.disc, phi, states, tolerance=1e-11).value

    direction = np.random.default_rng(1).uniform(-1, 1, at.space.n)
    start = value(at.space.start)
    assert abs(slope @ direction) > 1e-6 * abs(start)
    test = taylor_test(value, at.space.start, slope, direction, 0.04, start=start)
    assert test.rate == pytest.approx(2.0, abs=0.02), test
