"""Stress and moduli of an energy of principal stretches against derivatives of the same energy by F."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.mechanics.elements.element import mixed
from pneumorph.mechanics.elements.response import StrainedPoints, along_at, moduli_at, stress_at
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.material.energies import Energy, along_parameters, ogden
from pneumorph.mechanics.material.memory import after_pulls

OWN = (0.3, 1.7, 0.2, -2.3, 4.8)


def diagonal(*stretches):
    return np.diag(np.array(stretches))


def turned(F):
    axis, angle = np.array([1.0, 2.0, 2.0]) / 3.0, 0.7
    hat = np.cross(np.eye(3), axis)
    return (np.eye(3) + np.sin(angle) * hat + (1.0 - np.cos(angle)) * hat @ hat) @ F


STATES = {
    "at rest": np.eye(3),
    "turned": turned(np.eye(3)),
    "uniaxial": turned(diagonal(2.0, 2.0**-0.5, 2.0**-0.5)),
    "equibiaxial": diagonal(1.5, 1.5, 1.5**-2),
    "nearly equal": turned(diagonal(1.5, 1.5 * (1.0 + 1e-7), 0.4)),
    "about equal": turned(diagonal(1.5, 1.5 * (1.0 + 4e-6), 0.4)),
    "sheared": np.array([[1.0, 0.8, 0.0], [0.0, 1.1, 0.0], [0.3, 0.0, 0.9]]),
    "turned inside out": diagonal(1.2, 1.0, -0.3),
}
POINTS = [*STATES.values(), *(np.eye(3) + 0.3 * np.random.default_rng(0).standard_normal((8, 3, 3)))]
F = np.moveaxis(np.array(POINTS).reshape(4, 4, 3, 3), (2, 3), (0, 1)).copy()
HERE = StrainedPoints(F, F, np.linspace(-0.1, 0.1, 16).reshape(4, 4), np.linspace(1.0, 2.0, 16).reshape(4, 4))

LAWS = {
    "ogden": (ogden, np.array(OWN)),
    "softened": (after_pulls(ogden), np.array([0.4, 0.02, 0.1, 0.5, *OWN])),
    "by a parameter": (along_parameters(ogden), np.array([OWN, (0.0, 1.0, 0.0, 0.0, 0.0)])),
}


def laws(name):
    """The element of a rubber, and the same without its formula in stretches."""
    isochoric, parameters = LAWS[name]
    whole = along_parameters(mixed(ogden)) if name == "by a parameter" else mixed(isochoric)
    assert whole.of_stretches is not None
    return Solid(whole, parameters), Solid(Energy(whole.function), parameters)


@pytest.fixture(params=["ogden", "softened"])
def both(request):
    return laws(request.param)


@pytest.mark.parametrize("name", LAWS)
def test_stress(name):
    for short, general in zip(*(stress_at(law, HERE) for law in laws(name)), strict=True):
        np.testing.assert_allclose(short, general, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("excess", [None, np.linspace(-0.5, 0.5, 16).reshape(4, 4)])
def test_moduli(both, excess):
    short, general = (moduli_at(law, HERE, excess) for law in both)
    np.testing.assert_allclose(short, general, rtol=0.0, atol=1e-9 * np.abs(general).max(axis=(0, 1)).max())
    np.testing.assert_allclose(short, short.swapaxes(0, 1), rtol=0.0, atol=1e-12 * np.abs(short).max())


def test_moduli_by_a_parameter():
    """There the general way is exact for the stress only."""
    (law, _), (own, _) = laws("by a parameter"), laws("ogden")
    step = 1e-6 * law.parameters[1]
    ahead, behind = (replace(own, parameters=own.parameters + way * step) for way in (1.0, -1.0))
    expected = (moduli_at(ahead, HERE) - moduli_at(behind, HERE)) / 2e-6
    np.testing.assert_allclose(moduli_at(law, HERE), expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_what_changes_along_a_direction(both):
    rng = np.random.default_rng(1)
    direction = rng.standard_normal(F.shape), rng.standard_normal(F.shape[2:])
    for short, general in zip(*(along_at(law, HERE)(*direction) for law in both), strict=True):
        np.testing.assert_allclose(short, general, rtol=1e-8, atol=1e-9 * np.abs(general).max())


def test_what_is_not_a_number_stays_so():
    law, _ = laws("ogden")
    broken = F.copy()
    broken[0, 0, 1, 2] = np.nan
    psi, stress, _ = stress_at(law, HERE._replace(F=broken))
    assert np.isnan(psi[1, 2]) and np.isnan(stress[:, :, 1, 2]).any()
    assert np.isnan(psi).sum() == 1
