"""The strain of a task: an upper bound of the largest share, close to it, with exact derivatives."""

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse, discretise, strain_shares, strain_slopes
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import TOLERANCE
from pneumorph.objective.strain import ABOVE
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import taylor_test

PRESSURE = '{ A = { start = "60 kPa", min = "0 kPa", max = "100 kPa" } }'


def problem(**rubber) -> Problem:
    table = loads(tiny(pressure=PRESSURE)).model_dump(mode="json", exclude_none=True)
    table["material"] |= {"valid_stretch": 1.6, **rubber}
    return Problem.model_validate(table)


def with_a_liner() -> Problem:
    liner = problem(valid_stretch=1.3).model_dump(mode="json", exclude_none=True)["material"]
    region = {"name": "liner", "material": liner, "sleeve": {"thickness": "1 mm", "chambers": ["A"]}}
    return problem().with_changes({"region": [region]})


CASES = {
    "plain": problem(),
    "mixed": problem(bulk_modulus="490 MPa"),
    "regions": with_a_liner(),
    "free": problem().with_changes({"end_effector": {"kind": "free"}}),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=list(CASES))
def case(request: pytest.FixtureRequest):
    asked = request.param
    body = starting_body(asked.tubes)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    return asked, space, disc, analyse(asked, space, disc, space.start, tolerance=TOLERANCE)


def test_the_aggregate_is_just_above_the_largest_share(case):
    _, _, disc, found = case
    stretches = found.equilibria["extend"].stretches
    largest = max(stretch / disc.model.rubbers[name].valid_stretch for name, stretch in stretches.items())
    assert largest <= strain_shares(disc, found)["extend"] <= largest + ABOVE
    assert max(stretches.values()) > 1.05


def test_derivatives_by_shape_and_pressure(case):
    asked, space, disc, found = case
    shares, slopes = strain_slopes(space, disc, found, strain_shares(disc, found)["extend"])
    assert shares[0] == pytest.approx(strain_shares(disc, found)["extend"], rel=1e-12)
    states = {name: each.state for name, each in found.equilibria.items()}
    rng = np.random.default_rng(1)
    shape = np.where(np.arange(space.n) < space.n_shape, rng.uniform(-0.02, 0.02, space.n), 0.0)
    pressure = np.where(np.arange(space.n) < space.n_shape, 0.0, 0.05)

    def value(phi):
        return strain_shares(disc, analyse(asked, space, disc, phi, states, tolerance=TOLERANCE))["extend"]

    for direction in (shape, pressure):
        test = taylor_test(value, space.start, slopes[0], direction, 0.1, start=shares[0])
        assert test.passed, test
