"""Stretch and stress of fields that are known."""

import numpy as np
import pytest
from records import one_element
from tiny import tiny

from pneumorph.mechanics import neo_hookean_rubber, rubber_of
from pneumorph.problem import loads
from pneumorph.results import nodal_stress, nodal_stretch

MESH = one_element().mesh
SHEAR = 0.49
TWO = loads(
    tiny().replace(
        'name = "Hei-Cast 8400"',
        'model = "mooney-rivlin"\nc10 = "0.2 MPa"\nc01 = "0.05 MPa"\nbulk_modulus = "4.8 MPa"\ndensity = "1 g/cm^3"',
    )
)


def test_stretch_of_a_uniform_stretch():
    u = MESH.points * np.array([-0.1, 0.05, 0.3])
    np.testing.assert_allclose(nodal_stretch(MESH, u), 1.3, rtol=1e-9)


@pytest.mark.parametrize("stretch", [0.8, 1.0, 1.5])
def test_stress_of_uniaxial_tension(stretch):
    """Without a change of volume the neo-Hookean rubber's is μ (λ² − 1/λ), whatever its pressure."""
    across = stretch**-0.5
    u = MESH.points * (np.array([across, across, stretch]) - 1)
    expected = SHEAR * abs(stretch**2 - 1 / stretch)
    np.testing.assert_allclose(nodal_stress(MESH, u, {"": neo_hookean_rubber(SHEAR, 4.8, 1e-9)}), expected, atol=1e-12)
    expected = 2 * (0.2 + 0.05 / stretch) * abs(stretch**2 - 1 / stretch)
    np.testing.assert_allclose(nodal_stress(MESH, u, {"": rubber_of(TWO.material)}), expected, atol=1e-12)


def test_a_rotation_and_a_change_of_volume_leave_no_stress():
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    u = 1.1 * MESH.points @ turned.T - MESH.points
    np.testing.assert_allclose(nodal_stress(MESH, u, {"": neo_hookean_rubber(SHEAR, 4.8, 1e-9)}), 0.0, atol=1e-12)
