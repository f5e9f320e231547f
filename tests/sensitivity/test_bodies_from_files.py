"""The gradient of bodies from CAD files, by the order of Taylor remainders."""

import numpy as np
import pytest

import pneumorph as pm
from pneumorph.analysis import analyse, analyse_body, design_gradient
from pneumorph.geometry.starting import body_of
from pneumorph.problem import load
from pneumorph.sensitivity import taylor_test

STARTS = {
    "dome": (lambda: pm.bodies.dome("12 mm", "2.5 mm", "3 mm", "4 mm"), "4 mm"),
    "cup": (lambda: pm.bodies.cup("10 mm", "5 mm", "2 mm", "4 mm", "3 mm"), "3 mm"),
    "bellows": (lambda: pm.bodies.bellows("12 mm", "9 mm", "9 mm", 1), "4 mm"),
    "pneunet": (lambda: pm.bodies.pneunet("24 mm", "14 mm", "12 mm", 1), "4.5 mm"),
    "hand": (lambda: pm.bodies.hand(2, "14 mm", "4 mm", "20 mm", "12 mm", "11 mm", 1), "4.5 mm"),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", STARTS)
def test_remainders_are_of_second_order(kind, tmp_path):
    make, size = STARTS[kind]
    changes = {"mesh.size": size}
    if kind == "hand":
        # The ball touches the fingers.
        changes["obstacle[0].radius"] = "6.6 mm"
    problem = load(make().write(tmp_path / kind)).with_changes(changes)
    at = analyse_body(problem, body_of(problem))
    slope = design_gradient(problem, at.space, at.disc, at.analysis)
    states = {name: each.state for name, each in at.analysis.equilibria.items()}

    def value(phi):
        return analyse(problem, at.space, at.disc, phi, states, tolerance=1e-11).value

    # Pressures are variables too, of which 1 mm stands for all of the pressure.
    direction = np.random.default_rng(1).uniform(-1, 1, at.space.n)
    start = value(at.space.start)
    assert abs(slope @ direction) > 1e-6 * abs(start)
    test = taylor_test(value, at.space.start, slope, direction, 0.04, start=start)
    assert test.rate == pytest.approx(2.0, abs=0.02), test
