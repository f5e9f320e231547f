"""How far ahead a body balloons, estimated from one state: of stiffening rubber, and where a wall is being touched."""

import math

import pytest
from designing import analysed
from tiny import tiny

from pneumorph.mechanics import Path, Tangent, follow, limit_ahead
from pneumorph.problem import Problem, loads

SOFT = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa", "density": "1 g/cm^3"}
STIFFENING = {
    "model": "yeoh",
    "coefficients": ["0.11 MPa", "0.002 MPa"],
    "bulk_modulus": "220 MPa",
    "density": "1 g/cm^3",
}
WALL = {"kind": "plane", "name": "wall", "point": ["8.6 mm", "0 mm", "0 mm"], "normal": [-1, 0, 0]}


def thin(pressure: str, **tables) -> Problem:
    """A tube with a thin wall."""
    table = loads(tiny(pressure=f'{{ A = "{pressure}" }}')).model_dump(mode="json", exclude_none=True)
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    return Problem.model_validate(table | {"material": SOFT} | tables)


def estimated(asked: Problem) -> tuple[float, float]:
    """The estimate of the factor of the pressures at which a body balloons, and where the path has its limit point."""
    _, disc, found = analysed(asked)
    at, equilibrium = found.configurations["extend"], found.equilibria["extend"]
    path = follow(at, Tangent(disc.model), first_limit=True, since=equilibrium)
    assert isinstance(path, Path)
    return limit_ahead(at, disc.tangents["extend"], equilibrium.state), path.limits[0].load


# The wall is touched at 17.7 kPa: there, what stops at it changes faster than all else.
@pytest.mark.parametrize("pressure", ["17.76 kPa", "60 kPa"])
def test_what_a_wall_stops_does_not_hide_that_the_rest_balloons(pressure):
    estimate, true = estimated(thin(pressure, obstacle=[WALL], contact={"self": False}))
    assert 0.25 < (estimate - 1.0) / (true - 1.0) <= 1.0


def test_rubber_that_stiffens():
    estimate, true = estimated(thin("60 kPa", material=STIFFENING))
    assert 0.4 < (estimate - 1.0) / (true - 1.0) <= 1.0


@pytest.mark.parametrize("pressure", ["1e-40 kPa", "1e-160 kPa"])
def test_what_is_hardly_inflated_is_far_from_ballooning(pressure):
    """Pressures that are designed may come as near to 0 as numbers can."""
    _, disc, found = analysed(thin(pressure))
    at, equilibrium = found.configurations["extend"], found.equilibria["extend"]
    assert limit_ahead(at, disc.tangents["extend"], equilibrium.state) == math.inf
