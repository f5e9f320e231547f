"""The area that triangles enclose in a plane."""

import numpy as np
import pytest
import pyvista as pv

from pneumorph.cad.shells import section_area


def test_the_area_of_a_section_is_that_of_a_circle():
    """A ball of many triangles, cut at a distance d: π(r² − d²)."""
    ball = pv.Sphere(radius=2.0, center=(5.0, 1.0, 3.0), theta_resolution=180, phi_resolution=180)
    corners = np.asarray(ball.points, float)[ball.regular_faces]
    normal = np.array([0.6, 0.0, 0.8])
    for distance in (0.0, 1.2, -1.7, 2.5):
        expected = np.pi * max(0.0, 4.0 - distance**2)
        assert section_area(corners, normal, 5.4 + distance) == pytest.approx(expected, rel=2e-3, abs=1e-12)
