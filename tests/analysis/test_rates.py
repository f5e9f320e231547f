"""How motions change with pressures and with the modulus, against differences of solutions."""

import numpy as np
import pytest
from texts import BEND_UNDER_LOADS, TWO_BESIDE, problem_text

from pneumorph.analysis import analyse_body, motion_rates
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads


def solved(factor, A, element):
    """The tip's motion (6,) with all moduli multiplied by a factor and pressure A in kPa."""
    material = (
        f'shear_modulus = "{0.3 * factor:.12g} MPa"\nbulk_modulus = "{6.0 * factor:.12g} MPa"\ndensity = "1.1 g/cm^3"'
    )
    text = problem_text(
        BEND_UNDER_LOADS.replace("12 kPa", f"{A:.12g} kPa"), material=material, chambers=TWO_BESIDE, radius=10
    )
    problem = loads(text).with_changes({"mesh.element": element, "mesh.size": "8 mm"})
    at = analyse_body(problem, starting_body(problem.tubes))
    (equilibrium,) = at.analysis.equilibria.values()
    return at, equilibrium.plate


@pytest.mark.parametrize("element", ["quadratic", "mixed"])
def test_rates_are_those_of_differences(element):
    at, _ = solved(1.0, 12.0, element)
    rates = motion_rates(at.disc, at.analysis)["bend"]
    step = 1e-3
    by_modulus = (solved(1.0 + step, 12.0, element)[1] - solved(1.0 - step, 12.0, element)[1]) / (2 * step)
    by_pressure = (solved(1.0, 12.0 + step, element)[1] - solved(1.0, 12.0 - step, element)[1]) / (2e-3 * step)
    np.testing.assert_allclose(rates.by_modulus, by_modulus, atol=2e-5 * np.abs(by_modulus).max())
    np.testing.assert_allclose(rates.by_pressure["A"], by_pressure, atol=2e-5 * np.abs(by_pressure).max())
