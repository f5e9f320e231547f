"""Derivatives of the tip's motion by the constants of its rubber: against solutions, and those by all moduli."""

from dataclasses import replace

import numpy as np
import pytest
from texts import BEND_UNDER_LOADS, TWO_BESIDE, problem_text

from pneumorph.analysis.near import analyse_near
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import parameters_by_constants, rubber_of, solve, with_rubbers
from pneumorph.objective import measure_features
from pneumorph.problem import loads
from pneumorph.problem.constants import constants, is_modulus, with_constants
from pneumorph.sensitivity import motion_slopes, parameter_forces

REST = 'bulk_modulus = "6 MPa"\ndensity = "1.1 g/cm^3"\n'
RUBBERS = {
    "yeoh": ('model = "yeoh"\ncoefficients = ["0.15 MPa", "0.02 MPa", "0.003 MPa"]', "mixed"),
    "polynomial": ('model = "mooney-rivlin"\nc10 = "0.1 MPa"\nc01 = "0.04 MPa"\nc20 = "0.02 MPa"', "quadratic"),
    "ogden": (
        'model = "ogden"\nterms = [{ modulus = "0.2 MPa", exponent = 1.7 }, { modulus = "0.1 MPa", exponent = -2.4 }]',
        "mixed",
    ),
    "gent": ('model = "gent"\nshear_modulus = "0.3 MPa"\nlimit = 8.0', "quadratic"),
    "arruda-boyce": ('model = "arruda-boyce"\nshear_modulus = "0.25 MPa"\nlocking_stretch = 1.6', "mixed"),
    "softened": (
        'model = "yeoh"\ncoefficients = ["0.15 MPa", "0.02 MPa"]\nstate = "softened and relaxed"\n'
        'relaxation = [{ share = 0.2, time = "10 s" }]\nsoftening = { r = 2.0, m = "20 kPa", stretch = 1.6 }',
        "quadratic",
    ),
}


def solved(material, element):
    text = problem_text(BEND_UNDER_LOADS, material=f"{material}\n{REST}", chambers=TWO_BESIDE, radius=10)
    problem = loads(text).with_changes({"mesh.element": element, "mesh.size": "9 mm"})
    return analyse_near(problem, starting_body(problem.tubes), ())


def motion_with(whole, values):
    """The motion (6,) with other constants of the rubber."""
    at = whole.analysis.configurations["bend"]
    rubber = rubber_of(with_constants(whole.problem.material, values))
    there = replace(at, model=with_rubbers(at.model, {"": rubber}))
    equilibrium = solve(there, whole.disc.tangents["bend"], whole.analysis.equilibria["bend"].state, 1e-12)
    moved = measure_features(there.model, there.X, equilibrium.state)
    return np.concatenate([moved.translation, moved.rotation])


SLOW = [pytest.param(kind, marks=pytest.mark.slow) if kind == "ogden" else kind for kind in RUBBERS]


@pytest.mark.parametrize("kind", SLOW)
def test_constants_have_the_derivatives_of_the_discrete_problem(kind):
    """Along a random relative change of all of them the remainder falls with order 2; all moduli together scale ψ."""
    whole = solved(*RUBBERS[kind])
    at, state = whole.analysis.configurations["bend"], whole.analysis.equilibria["bend"].state
    slopes = motion_slopes(at, whole.disc.tangents["bend"], state)
    by_parameters = -slopes.adjoints @ parameter_forces(at, state)[""].T
    material = whole.problem.material
    by_constants = {name: by_parameters @ change for name, change in parameters_by_constants(material).items()}

    relative = dict(zip(by_constants, np.random.default_rng(2).uniform(0.5, 1.0, len(by_constants)), strict=True))
    slope = sum(part * by_constants[name] for name, part in relative.items())
    start, remainders = motion_with(whole, {}), []
    for step in (0.04, 0.02):
        values = {name: (1.0 + step * relative[name]) * value for name, value in constants(material).items()}
        remainders.append(np.linalg.norm(motion_with(whole, values) - start - step * slope))
    assert np.log2(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.1)

    together = sum(by for name, by in by_constants.items() if is_modulus(name))
    if kind == "softened":
        # The energy that softening begins with is none of the constants; all moduli scale with it.
        together = together + at.model.rubber.parameters[1] * by_parameters[:, 1]
    np.testing.assert_allclose(together, slopes.moduli[""], atol=1e-8 * np.abs(slopes.moduli[""]).max())
