"""What tolerances do to forces of a held tip and to volumes: derivatives against solutions with the changes made."""

from dataclasses import replace

import numpy as np
import pytest
from texts import BEND_UNDER_LOADS, TWO_BESIDE, problem_text

from pneumorph.analysis.constants import constants_in
from pneumorph.analysis.near import analyse_near
from pneumorph.analysis.scatter import one_deviation, scatter_at, scatter_of, with_moduli
from pneumorph.analysis.second_order import second_order
from pneumorph.analysis.tolerances import UNITS, Tolerances, pressure_of, shape_causes
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, settled, solve
from pneumorph.problem import loads
from pneumorph.sensitivity import quantities_at

MATERIAL = 'shear_modulus = "{:.12g} MPa"\nbulk_modulus = "{:.12g} MPa"\ndensity = "1.1 g/cm^3"'
HELD = BEND_UNDER_LOADS + 'hold = { bending_y = "4 deg" }\n'
ASKED = ("push_bending_y", "volume_A", "volume_B", "filled_A", "extension")
TIGHT = 1e-11


def solved(factor=1.0, element="quadratic", text=HELD):
    material = MATERIAL.format(0.3 * factor, 6.0 * factor)
    problem = loads(problem_text(text, material=material, chambers=TWO_BESIDE, radius=10))
    problem = problem.with_changes({"mesh.element": element, "mesh.size": "8 mm"})
    return analyse_near(problem, starting_body(problem.tubes), ())


@pytest.fixture(scope="module", params=["quadratic", "mixed"])
def whole(request):
    return solved(1.0, request.param)


def tight(whole, at):
    """The equilibrium of a configuration near that of the whole body, with the pressures that are found."""
    found = solve(at, whole.disc.tangents["bend"], whole.analysis.equilibria["bend"].state, TIGHT)
    return settled(at, found), found.state


def values_at(whole, at):
    return quantities_at(*tight(whole, at), ASKED)


def of_rubber(factor, **others):
    """The values of a body of another rubber."""
    other = solved(factor, **others)
    return values_at(other, other.analysis.configurations["bend"])


def causes_of(whole):
    """The values, derivatives by every cause in the units of the code, and the motions of nodes."""
    at, state = tight(whole, whole.analysis.configurations["bend"])
    shapes = list(shape_causes(whole.disc.morph, at.X, Tolerances()))
    tangent = Tangent(at.model)
    tangent.move_to(at, state)
    found = scatter_at(at, tangent, state, whole.disc.morph, shapes, Tolerances(), constants_in(whole.problem), ASKED)
    assert found.quantities == ASKED
    by = {cause.name: np.array(cause.by) / UNITS[cause.unit] for cause in found.causes}
    # All constants of this rubber are moduli.
    together = 100.0 * np.sum(list(found.constants.values()), axis=0)
    np.testing.assert_allclose(together, by["modulus of the rubber"], rtol=1e-5)
    return np.array(found.values), by, {each.name: each.everywhere(whole.disc.morph) for each in shapes}


def test_walls_and_cores_have_the_derivatives_of_the_discrete_problem(whole):
    """Along a random sum of all of them, the remainders fall with order 2."""
    at = whole.analysis.configurations["bend"]
    start, by, shapes = causes_of(whole)
    random, along, slope = np.random.default_rng(1), np.zeros_like(at.X), np.zeros(len(ASKED))
    for name, motion in shapes.items():
        share = random.choice([-1.0, 1.0]) / np.abs(motion).max()
        along += share * motion
        slope += share * by[name]
    one, two = (values_at(whole, replace(at, X=at.X + step * along)) - start - step * slope for step in (0.1, 0.05))
    np.testing.assert_allclose(np.log2(np.abs(one / two)), 2.0, atol=0.15)


def test_a_stiffer_rubber_and_higher_pressures_have_theirs(whole):
    element, at, step = "mixed" if whole.disc.model.mixed else "quadratic", whole.analysis.configurations["bend"], 1e-3
    _, by, _ = causes_of(whole)
    for number, chamber in enumerate("AB"):
        ends = []
        for way in (1.0, -1.0):
            pressure = at.loads.pressure + way * 1e-5 * np.eye(2)[number]
            ends.append(values_at(whole, replace(at, loads=at.loads._replace(pressure=pressure))))
        expected = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose(by[pressure_of(chamber)], expected, rtol=1e-4, atol=1e-6 * np.abs(expected).max())
    up, down = (solved(1.0 + way * step, element) for way in (1.0, -1.0))
    expected = values_at(up, up.analysis.configurations["bend"]) - values_at(down, down.analysis.configurations["bend"])
    np.testing.assert_allclose(by["modulus of the rubber"], expected / (2 * step), rtol=1e-3)
    modest = with_moduli(whole, "bend", (1.0 - step, 1.0 + step), ASKED)
    np.testing.assert_allclose(modest[1] - modest[0], expected, rtol=2e-2)


def test_a_force_has_the_castings_off_by_one_deviation(whole):
    """They approach the first-order figures with order 2, as those of motions do."""
    far = []
    for part in (0.2, 0.1):
        usual = {name: part * value for name, value in vars(Tolerances()).items() if isinstance(value, float)}
        scatter = scatter_of(whole, Tolerances(**usual))["bend"]
        number = scatter.quantities.index("push_bending_y")
        found = one_deviation(whole, "bend", scatter, number)
        middle, deviation = scatter.values[number], scatter.deviations[number]
        far.append(max(abs(found.up - middle - deviation), abs(middle - found.down - deviation)) / deviation)
        assert deviation <= second_order(whole, "bend", scatter, number, found) < 1.05 * deviation
    assert far[1] < 0.65 * far[0] < 0.1


def test_a_force_changes_with_pressures_that_are_found_too():
    """Of a chamber that is filled to a volume, whose pressure follows from walls and rubber."""
    text = HELD.replace('{ A = "12 kPa", B = "5 kPa" }', '{ B = "5 kPa" }\nvolume = { A = "0.05 ml" }')
    whole = solved(text=text)
    at = whole.analysis.configurations["bend"]
    start, by, shapes = causes_of(whole)
    assert at.enclosed is not None and start[1] > 0.0
    name, filled = "rubber at chamber A", ASKED.index("filled_A")

    def remainder(step):
        moved = replace(at, X=at.X + step * shapes[name])
        return np.delete(values_at(whole, moved) - start - step * by[name], filled)

    # The volume of the other chamber is nearly linear.
    assert (np.log2(np.abs(remainder(0.2) / remainder(0.1))) > 1.9).all()
    # What is filled in does not change.
    assert start[filled] == pytest.approx(50.0, rel=1e-6) and abs(by[name][filled]) < 1e-6 * abs(by[name][1])
    expected = (of_rubber(1.001, text=text) - of_rubber(0.999, text=text)) / 2e-3
    np.testing.assert_allclose(by["modulus of the rubber"][[0, 4]], expected[[0, 4]], rtol=1e-3)
