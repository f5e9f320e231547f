"""The probability of ballooning: limit points of castings against their derivatives."""

import math
from dataclasses import replace

import numpy as np
import pytest
from designing import analysed
from tiny import tiny

from pneumorph.analysis.constants import with_changed
from pneumorph.analysis.near import Solved
from pneumorph.analysis.reliability import Ballooning, ballooning_of
from pneumorph.analysis.tolerances import LOADS, MODULUS, Tolerances, as_cast, moved_by, pressure_of
from pneumorph.mechanics import TOLERANCE, Equilibrium, Tangent, solve
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import find_margin

NONE = Tolerances(rubber=0.0, pressure=0.0, wall=0.0, shift=0.0, tilt=0.0, scale=0.0, load=0.0)


@pytest.fixture(scope="module")
def solved() -> Solved:
    """A thin tube that balloons at 1.3 times its pressure or so."""
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa"}
    table["material"] |= {"density": "1 g/cm^3", "compressible": True}
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    table["end_effector"]["spring"] = {"axial": "4 N/mm"}
    asked = Problem.model_validate(table)
    _, disc, found = analysed(asked)
    return Solved(asked, disc, found)


CASES = {
    "modulus": (replace(NONE, rubber=0.02), {MODULUS: 0.02}),
    "pressure": (replace(NONE, pressure=0.002), {pressure_of("A"): 0.002}),
    "springs": (replace(NONE, load=0.05), {LOADS["spring"]: 0.05}),
    "size": (replace(NONE, scale=0.01), {"size of the body": 0.01}),
}


@pytest.mark.parametrize("case", CASES.values(), ids=list(CASES))
def test_the_limit_point_moves_as_derivatives_say(solved, case):
    tolerances, changes = case
    own = ballooning_of(solved, tolerances)["extend"].deviation
    at, equilibrium = solved.analysis.configurations["extend"], solved.analysis.equilibria["extend"]
    margins = []
    for way in (1.0, -1.0):
        cast = {name: way * change for name, change in changes.items()}
        there = as_cast(at, moved_by(solved.disc.morph, at.X, cast), cast)
        tangent = Tangent(solved.disc.model)
        state = solve(there, tangent, equilibrium.state, TOLERANCE)
        assert isinstance(state, Equilibrium)
        margins.append(find_margin(there, tangent, state, 2.0).load)
    assert own > 1e-4
    assert own == pytest.approx(abs(math.log(margins[0] / margins[1])) / 2.0, rel=0.01)


def test_errors_of_a_fit_move_the_limit_point_as_derivatives_say(solved):
    """One deviation of both constants of a Yeoh rubber, together."""
    table = solved.problem.model_dump(mode="json", exclude_none=True)
    table["material"] |= {"model": "yeoh", "coefficients": ["0.125 MPa", "0.002 MPa"]}
    del table["material"]["shear_modulus"]
    error = np.array([0.01, -0.15])
    table["material"]["covariance"] = np.outer(error, error).tolist()
    asked = Problem.model_validate(table)
    _, disc, found = analysed(asked)
    own = ballooning_of(Solved(asked, disc, found), NONE)["extend"].deviation
    at, equilibrium = found.configurations["extend"], found.equilibria["extend"]
    margins = []
    for way in (0.5, -0.5):
        model = with_changed(at.model, asked, dict(zip(("c1", "c2"), way * error, strict=True)))
        there = replace(at, model=model)
        tangent = Tangent(there.model)
        state = solve(there, tangent, equilibrium.state, TOLERANCE)
        assert isinstance(state, Equilibrium)
        margins.append(find_margin(there, tangent, state, 2.0).load)
    assert own > 1e-4
    assert own == pytest.approx(abs(math.log(margins[0] / margins[1])), rel=0.01)


def test_where_only_pressure_acts_the_modulus_moves_the_limit_point_in_proportion(solved):
    """Without the spring λ is in proportion to the moduli, and ln λ differs by the deviation itself."""
    free = solved.problem.model_dump(mode="json", exclude_none=True)
    del free["end_effector"]["spring"]
    asked = Problem.model_validate(free)
    _, disc, found = analysed(asked)
    own = ballooning_of(Solved(asked, disc, found), replace(NONE, rubber=0.1))["extend"]
    assert own.deviation == pytest.approx(0.1, rel=1e-5)
    assert own.probability == pytest.approx(0.5 * math.erfc(math.log(own.margin) / 0.1 / math.sqrt(2.0)), rel=1e-3)


def test_nothing_that_varies_leaves_no_casting_to_balloon():
    assert Ballooning(1.2, 0.0).probability == 0.0
    assert Ballooning(1.0, 0.1).probability == 0.5
    assert np.isclose(Ballooning(math.exp(0.1), 0.1).probability, 0.158655, rtol=1e-5)
