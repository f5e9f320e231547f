"""Tests of a vulcanised natural rubber with 8 % sulphur: Treloar, Trans. Faraday Soc. 40 (1944) 59, in MPa.

The points are those that are commonly read from his figures (Steinmann, Hossain and Possart, Arch. Appl. Mech. 82
(2012) 1183). `OGDEN` are the parameters that Ogden, Proc. R. Soc. A 326 (1972) 565, gives for them: μ′ = 6.3, 0.012,
−0.1 kg/cm² and α = 1.3, 5, −2, with moduli μ = α μ′/2 that add up to the shear modulus.
"""

from pathlib import Path

import numpy as np

KILOGRAM = 0.0980665
"""One kg/cm² in MPa."""

EXAMPLES = Path(__file__).parents[2] / "examples" / "treloar"

TESTS = {
    mode: np.loadtxt(EXAMPLES / f"{mode}.csv", delimiter=",", skiprows=2).T
    for mode in ("uniaxial", "equibiaxial", "planar")
}
"""Stretches and nominal stresses (2, n) of each mode."""

OGDEN = np.array([6.3 * 1.3 / 2 * KILOGRAM, 1.3, 0.012 * 5 / 2 * KILOGRAM, 5.0, 0.1 * 2 / 2 * KILOGRAM, -2.0])
"""Parameters of `energies.ogden`: modulus in MPa and exponent of each term."""
