"""The pressure at which a body balloons: of a sphere in closed form elsewhere; here its exact derivatives."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from designing import analysed
from texts import problem_text
from tiny import tiny

from pneumorph.analysis import (
    analyse,
    ballooning,
    checkpoint,
    limit_points,
    margin_slopes,
    margins,
    near_margins,
    remember_limit_points,
)
from pneumorph.mechanics import TOLERANCE, Equilibrium, Tangent, follow, solve
from pneumorph.optimize.states import linear_states, worst_state
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import margin as module
from pneumorph.sensitivity import taylor_test
from pneumorph.sensitivity.margin import BEYOND, find_margin

PRESSURE = '{ A = { start = "60 kPa", min = "0 kPa", max = "100 kPa" } }'


def soft(shear: str) -> Problem:
    """A thin tube of a soft rubber, which balloons not far above its working pressure."""
    table = loads(tiny(pressure=PRESSURE)).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": shear, "bulk_modulus": "2 MPa"}
    table["material"] |= {"density": "1 g/cm^3", "compressible": True}
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    return Problem.model_validate(table)


def test_derivatives_by_shape_and_pressure():
    asked = soft("0.25 MPa")
    space, disc, found = analysed(asked)
    values, slopes = margin_slopes(space, disc, found, 2.0)
    assert 1.05 < values[0] < 2.0 * BEYOND - 0.05
    states = {name: each.state for name, each in found.equilibria.items()}

    def value(phi):
        return margins(disc, analyse(asked, space, disc, phi, states, tolerance=TOLERANCE), 2.0)["extend"]

    rng = np.random.default_rng(1)
    of_shape = np.arange(space.n) < space.n_shape
    for direction in (np.where(of_shape, rng.uniform(-0.2, 0.2, space.n), 0.0), np.where(of_shape, 0.0, 0.3)):
        test = taylor_test(value, space.start, slopes[0], direction, 0.2, count=3, start=values[0])
        assert test.passed, test


def test_a_stiff_body_is_far_from_its_limit():
    space, disc, found = analysed(soft("4 MPa"))
    values, slopes = margin_slopes(space, disc, found, 1.2)
    assert values[0] == pytest.approx(1.2 * BEYOND) and not slopes.any()


def test_a_path_that_cannot_be_followed_is_not_taken_for_one_without_a_limit_point(monkeypatch):
    monkeypatch.setattr(module, "follow", partial(follow, most=2))
    asked = soft("0.25 MPa")
    space, disc, found = analysed(asked)
    near, followed = near_margins(disc, found, 2.0)
    assert near == {} and 1.0 <= followed["extend"] < 2.0
    # What is not known neither stops a step nor counts as satisfied.
    states = linear_states(asked, space, disc, found)
    assert [limit.name for limit in states.unknown] == ["margin"]
    assert states.values()["margin"] is None and not states.violated
    assert worst_state(asked, disc, found)[0] <= 0.0


def test_the_limit_point_of_a_design_nearby_leads_to_the_same_one(monkeypatch):
    asked = soft("0.25 MPa")
    space, disc, found = analysed(asked)
    first = limit_points(disc, found, 2.0)["extend"]
    rng = np.random.default_rng(2)
    phi = space.start + np.where(np.arange(space.n) < space.n_shape, rng.uniform(-0.05, 0.05, space.n), -0.3)
    states = {name: each.state for name, each in found.equilibria.items()}
    alone, after = (analyse(asked, space, disc, phi, states, tolerance=TOLERANCE) for _ in range(2))
    by_path = limit_points(disc, alone, 2.0)["extend"]
    assert abs(by_path.load / first.load - 1.0) > 0.01
    remember_limit_points(found, after)
    # No path is followed.
    monkeypatch.setattr(module, "follow", None)
    assert limit_points(disc, after, 2.0)["extend"].load == pytest.approx(by_path.load, rel=1e-7)
    slopes = [margin_slopes(space, disc, each, 2.0)[1] for each in (alone, after)]
    np.testing.assert_allclose(*slopes, rtol=1e-3, atol=1e-3 * np.abs(slopes[0]).max())


def test_a_limit_point_is_found_where_that_of_a_design_nearby_does_not_lead_to_it():
    asked = soft("0.25 MPa")
    _, disc, found = analysed(asked)
    at, equilibrium = found.configurations["extend"], found.equilibria["extend"]
    first = find_margin(at, Tangent(disc.model), equilibrium, 2.0)
    # A state that is none, and a limit point below the working pressures.
    vector = disc.model.vector(first.state)
    for wrong in (disc.model.state(-vector), disc.model.state(0.0 * vector)):
        again = find_margin(at, Tangent(disc.model), equilibrium, 2.0, replace(first, state=wrong))
        assert again.load == pytest.approx(first.load, rel=1e-7)


def two(second: str, **changes) -> Problem:
    """The soft tube with a second task."""
    table = soft("0.25 MPa").model_dump(mode="json", exclude_none=True)
    more = table["task"][0] | {"name": "more", "pressure": {"A": second}} | changes
    return Problem.model_validate(table | {"task": [*table["task"], more]})


def counted(monkeypatch):
    calls = []
    monkeypatch.setattr(ballooning, "find_margin", lambda *given: calls.append(1) or find_margin(*given))
    return calls


def test_tasks_at_pressures_in_the_same_ratio_share_their_path(monkeypatch):
    calls, asked = counted(monkeypatch), two("50 kPa")
    space, disc, found = analysed(asked)
    values, slopes = margin_slopes(space, disc, found, 2.0)
    assert len(calls) == 1
    assert values[1] == pytest.approx(1.2 * values[0])
    # Each for itself gives the same.
    alone = analyse(asked, space, disc, space.start, tolerance=TOLERANCE)
    own = find_margin(alone.configurations["more"], Tangent(disc.model), alone.equilibria["more"], 2.0)
    assert own.load == pytest.approx(values[1], rel=1e-4)
    by_shape = slopes[:, : space.n_shape]
    np.testing.assert_allclose(by_shape[1], 1.2 * by_shape[0], rtol=1e-6, atol=1e-9)


def test_tasks_under_other_loads_do_not(monkeypatch):
    calls = counted(monkeypatch)
    _, disc, found = analysed(two("60 kPa", force=["0 N", "0 N", "0.3 N"]))
    first, second = margins(disc, found, 2.0).values()
    assert len(calls) == 2 and first != second


def test_limit_points_are_stored_with_a_design(monkeypatch):
    asked = two("50 kPa")
    space, disc, found = analysed(asked)
    values, slopes = margin_slopes(space, disc, found, 2.0)
    arrays = checkpoint.pack(found, disc)
    calls = counted(monkeypatch)
    again, restored = checkpoint.unpack(asked, space, arrays)
    assert margins(again, restored, 2.0) == pytest.approx(dict(zip(("extend", "more"), values, strict=True)))
    back, of_back = margin_slopes(space, again, restored, 2.0)
    assert not calls
    np.testing.assert_allclose(back, values)
    np.testing.assert_allclose(of_back, slopes, rtol=1e-6, atol=1e-9 * np.abs(slopes).max())


COARSE, VOLUME = 'control_density = "0.3 /mm"', 'volume = { B = "0.1 ml" }\n'
BESIDE = """
[[task]]
name = "bend"
pressure = { A = { start = "20 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { motion = "bending_y" }
[mesh]
size = "6 mm"
"""


@pytest.mark.parametrize("law", ["liquid", "gas"])
def test_what_is_filled_or_sealed_keeps_its_own_control(law):
    """A balloons while B keeps its water or its gas; between 0.98 and 1.02 of its limit states end."""
    chambers = ("A", 4.5, "-5 mm", "0 mm"), ("B", 3, "6 mm", "0 mm")
    text = problem_text(BESIDE, radius=11, chambers=chambers, body=COARSE)
    given = {"gas": ('name = "B"\n', 'gas = { pressure = "2 kPa" }\n'), "liquid": ('name = "bend"\n', VOLUME)}[law]
    text = text.replace(given[0], "".join(given))
    table = loads(text).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.1 MPa", "bulk_modulus": "2 MPa"}
    table["material"] |= {"density": "1 g/cm^3", "compressible": True}
    asked = Problem.model_validate(table)
    space, disc, found = analysed(asked)
    values, slopes = margin_slopes(space, disc, found, 2.0)
    assert 1.05 < values[0] < 2.0 * BEYOND - 0.05
    at, near = found.configurations["bend"], found.equilibria["bend"]
    for load, exists in ((0.98, True), (1.02, False)):
        pressure = np.array(at.loads.pressure) * [load * values[0], 1.0]
        asked_for = replace(at, loads=at.loads._replace(pressure=pressure))
        there = solve(asked_for, Tangent(disc.model), since=(at, near.state), most=40)
        assert isinstance(there, Equilibrium) == exists
    states = {name: each.state for name, each in found.equilibria.items()}

    def value(phi):
        return margins(disc, analyse(asked, space, disc, phi, states, tolerance=TOLERANCE), 2.0)["bend"]

    rng = np.random.default_rng(1)
    of_shape = np.arange(space.n) < space.n_shape
    direction = np.where(of_shape, rng.uniform(-0.2, 0.2, space.n), 0.3)
    test = taylor_test(value, space.start, slopes[0], direction, 0.2, count=3, start=values[0])
    assert test.passed, test
