"""Bars and beams under small loads, against linear elasticity; what has larger ones is in `pneumorph.verify`."""

import numpy as np
import pytest

from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


def test_a_bar_on_a_small_dead_force_stretches_as_young_says():
    mesh = tube(4, 8, 60, (1, 8, 12))
    built = build_model(mesh, RUBBER)
    force = 1e-4
    wrench = np.array([0, 0, force, 0, 0, 0])
    found = solve(configure(built, mesh.points, build_loads(built, {}, wrench=wrench)), Tangent(built))
    young = 9 * 4.80 * 0.49 / (3 * 4.80 + 0.49)
    expected = force * 60 / (young * np.pi * (8**2 - 4**2))
    # The clamped ends hinder the contraction, over about a diameter each.
    assert found.plate[2] == pytest.approx(expected, rel=0.05)


def test_a_slender_tube_under_a_small_moment_bends_and_twists_as_beams_do():
    mesh = tube(4, 5, 100, (1, 12, 20))
    built = build_model(mesh, RUBBER)
    moment = 1e-3
    young = 9 * 4.80 * 0.49 / (3 * 4.80 + 0.49)
    second = np.pi / 4 * (5**4 - 4**4)
    wrench = np.array([0, 0, 0, 0, moment, moment])
    found = solve(configure(built, mesh.points, build_loads(built, {}, wrench=wrench)), Tangent(built))
    assert found.plate[4] == pytest.approx(moment * 100 / (young * second), rel=0.03)
    assert found.plate[5] == pytest.approx(moment * 100 / (0.49 * 2 * second), rel=0.01)
