"""A block that settles under its weight."""

import numpy as np
import pytest

from pneumorph.analysis.settling import settle
from pneumorph.mechanics import neo_hookean_rubber


@pytest.mark.parametrize(("bulk", "tolerance"), [(4.8, 1e-3), (200.0, 1e-3)], ids=["plain", "mixed"])
def test_a_block_between_walls_settles_like_a_column(bulk, tolerance):
    """Held sideways, strains are uniaxial: u = −ρ g z (h − z/2) / (κ + 4μ/3), for small loads."""
    shear, density, tall = 0.3, 1.1e-9, 60.0
    rubber = neo_hookean_rubber(shear, bulk, density)

    def held(points):
        sides = (points == 0.0) | (points == [20.0, 10.0, -1.0])
        return sides

    nodes, moved = settle(rubber, (0.0, 0.0, 0.0), (20.0, 10.0, tall), np.ones((2, 2, 4), bool), held)
    z = nodes[:, 2]
    exact = -density * 9810.0 * z * (tall - z / 2.0) / (bulk + 4.0 * shear / 3.0)
    assert np.abs(moved[:, 2] - exact).max() < 2.0 * tolerance * np.abs(exact).max()
    assert np.abs(moved[:, :2]).max() < tolerance * np.abs(exact).max()


def test_a_hole_is_left_out():
    rubber = neo_hookean_rubber(0.3, 4.8, 1.1e-9)
    filled = np.ones((3, 1, 3), bool)
    filled[1, 0, 1] = False
    nodes, moved = settle(rubber, (0, 0, 0), (30.0, 10.0, 30.0), filled, lambda points: points[:, [2, 2, 2]] == 0.0)
    inside = (np.abs(nodes[:, 0] - 15.0) < 4.9) & (np.abs(nodes[:, 2] - 15.0) < 4.9)
    assert not inside.any()
    roof = (np.abs(nodes[:, 0] - 15.0) < 1e-9) & (np.abs(nodes[:, 2] - 20.0) < 1e-9)
    beside = (np.abs(nodes[:, 0]) < 1e-9) & (np.abs(nodes[:, 2] - 20.0) < 1e-9)
    assert moved[roof, 2].max() < moved[beside, 2].min() < 0.0
