"""Perturbed castings: the spread between them is that of first derivatives, and their objectives have gradients."""

from dataclasses import replace

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis import analyse, design_gradient, design_slopes, discretise
from pneumorph.analysis.castings import Casting, worst_changes
from pneumorph.analysis.near import analyse_near
from pneumorph.analysis.scatter import scatter_of
from pneumorph.analysis.tolerances import MODULUS, Tolerances, as_cast, moved_by
from pneumorph.geometry.starting import space_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, solve
from pneumorph.problem import loads

TOLERANCES = Tolerances(scale=0.0, load=0.0)
MATERIAL = 'shear_modulus = "0.3 MPa"\nbulk_modulus = "6 MPa"\ndensity = "1.1 g/cm^3"'
BEND = """
[[task]]
name = "bend"
pressure = { A = { start = "12 kPa", min = "0 kPa", max = "20 kPa" } }
objective = OBJECTIVE
[mesh]
size = "8 mm"
"""
ANGLE, MOST = '{ kind = "motion", bending_y = "3 deg" }', '{ motion = "bending_y" }'
HELD = ANGLE + '\nhold = { extension = "0.1 mm" }'


CHAMBER = (("A", 4, "1 mm", "0 mm"),)
REINFORCED = """
[[membrane]]
name = "paper"
stiffness = "0.8 N/mm"
angles = ["-50 deg", "50 deg"]
wrinkling = 0.02
[[fibres]]
name = "thread"
stiffness = { start = "1.5 N/mm", min = "0.5 N/mm", max = "4 N/mm" }
winding = { start = "70 deg", min = "50 deg", max = "85 deg" }
buckling = 0.02
"""


def bending(objective, material=MATERIAL):
    return loads(problem_text(BEND.replace("OBJECTIVE", objective), material=material, chambers=CHAMBER))


def reinforced(objective, material=MATERIAL):
    """With a sheet and fibres whose stiffness and winding angle are designed."""
    return loads(problem_text(BEND.replace("OBJECTIVE", objective) + REINFORCED, material=material, chambers=CHAMBER))


def with_castings(disc, analysis, task, deviations):
    """The mesh with the worst castings of a task."""
    at, tangent, equilibrium = analysis.configurations[task], disc.tangents[task], analysis.equilibria[task]
    objective = disc.objectives[task]
    worst = worst_changes(disc.morph, at, tangent, equilibrium.state, objective, TOLERANCES, deviations)
    off = tuple(Casting(each, moved_by(disc.morph, at.X, each), Tangent(disc.model)) for each in worst)
    return replace(disc, castings={task: off})


CASES = {"angle": bending(ANGLE), "most": bending(MOST), "held": bending(HELD), "sheet, fibres": reinforced(ANGLE)}


@pytest.fixture(scope="module", params=CASES)
def robust(request):
    problem = CASES[request.param]
    space, disc = space_of(problem), discretise(problem, starting_body(problem.tubes))
    analysis = analyse(problem, space, disc, space.start, tolerance=1e-11)
    disc = with_castings(disc, analysis, "bend", 1.5)
    return problem, space, disc, analyse(problem, space, disc, space.start, tolerance=1e-11)


def test_the_robust_objective_has_the_gradient_of_the_discrete_problem(robust):
    """By shape, pressure and data of fibres the remainder falls with order 2; the loop has the same derivatives."""
    problem, space, disc, analysis = robust
    slope = design_gradient(problem, space, disc, analysis)
    random = np.random.default_rng(0)
    along = random.standard_normal(space.n)
    along[: space.n_shape] *= 0.2
    remainders = []
    for step in (0.4, 0.2):
        there = analyse(problem, space, disc, space.start + step * along, tolerance=1e-11)
        remainders.append(there.value - analysis.value - step * (slope @ along))
    assert np.log2(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.15)
    assert np.all(slope[space.n_shape :])
    loop = design_slopes(problem, space, disc, analysis).total
    np.testing.assert_allclose(loop, slope, atol=1e-4 * np.abs(slope).max())


@pytest.mark.parametrize("bulk", ["6 MPa", "300 MPa"], ids=["plain", "mixed"])
def test_castings_near_the_design_need_no_factorisation_of_their_own(bulk):
    """Their states, stability and gradients are those that a factorisation of their own gives."""
    problem = bending(ANGLE, MATERIAL.replace("6 MPa", bulk))
    space, disc = space_of(problem), discretise(problem, starting_body(problem.tubes))
    disc = with_castings(disc, analyse(problem, space, disc, space.start), "bend", 0.3)
    found = analyse(problem, space, disc, space.start, tolerance=1e-9)
    slope = design_slopes(problem, space, disc, found).total
    assert [casting.tangent.factorisations for casting in disc.castings["bend"]] == [0, 0]
    for casting, off in zip(disc.castings["bend"], found.castings["bend"], strict=True):
        assert off.equilibrium.stable
        casting.tangent.factorise(off.at, off.equilibrium.state)
        assert casting.tangent.negative_pivots == 0
    np.testing.assert_allclose(design_slopes(problem, space, disc, found).total, slope, atol=1e-4 * np.abs(slope).max())


def rotations(disc, analysis):
    """The rotations of both castings about y."""
    objective = disc.objectives["bend"]
    for off in analysis.castings["bend"]:
        yield float(objective.features(off.at.model, off.at.X, off.equilibrium.state).rotation[1])


def test_the_objective_of_a_target_is_that_of_the_mean_and_the_spread():
    problem = bending(ANGLE)
    space, disc = space_of(problem), discretise(problem, starting_body(problem.tubes))
    analysis = analyse(problem, space, disc, space.start)
    found = analyse(problem, space, with_castings(disc, analysis, "bend", 1.0), space.start)
    up, down = rotations(disc, found)
    mean, spread = (up + down) / 2, (up - down) / 2
    assert found.value == pytest.approx((mean - np.radians(3.0)) ** 2 + spread**2, rel=1e-6)
    assert found.values["bend"] == pytest.approx(analysis.values["bend"], rel=1e-6)


def test_without_a_target_it_is_the_worse_casting(robust):
    _, _, disc, analysis = robust
    off = analysis.castings["bend"]
    if disc.objectives["bend"].residuals is None:
        assert len(off) == 1
        assert analysis.value == off[0].value > analysis.values["bend"]
    else:
        assert len(off) == 2


def test_the_spread_is_the_first_order_deviation():
    """Half the difference of both castings, over k, approaches it with order 2."""
    whole = analyse_near(bending(ANGLE), starting_body(bending(ANGLE).tubes), ())
    deviation = scatter_of(whole, TOLERANCES)["bend"].deviations[4]
    space, far = space_of(whole.problem), []
    for k in (0.8, 0.4):
        disc = with_castings(whole.disc, whole.analysis, "bend", k)
        found = analyse(whole.problem, space, disc, space.start, tolerance=1e-11)
        up, down = rotations(disc, found)
        far.append(abs(abs(up - down) / (2 * k) - deviation))
        assert far[-1] < 0.02 * deviation
    assert far[1] < 0.35 * far[0]


def test_castings_of_a_half_differ_as_those_of_the_whole():
    """Two chambers that are images of each other vary by themselves, and cores move out of the mirror plane."""
    task = '[[task]]\nname = "lift"\npressure = { A = "12 kPa", B = "12 kPa" }\nobjective = { motion = "extension" }\n'
    problem = loads(problem_text(task, material=MATERIAL, chambers=TWO_BESIDE, radius=10)).with_changes(
        {"mesh.size": "5 mm", "body.symmetry.mirror": ["xz", "yz"]}
    )
    body = starting_body(problem.tubes)
    deviation = scatter_of(analyse_near(problem, body, ()), TOLERANCES)["lift"].deviations[2]
    space, disc = space_of(problem), discretise(problem, body)
    assert disc.model.part
    analysis = analyse(problem, space, disc, space.start)
    found = analyse(problem, space, with_castings(disc, analysis, "lift", 0.2), space.start)
    assert (found.value - analysis.value) / 0.2 == pytest.approx(deviation, rel=0.06)


@pytest.mark.parametrize(("made", "objective"), [(reinforced, ANGLE), (bending, HELD)], ids=["sheet, fibres", "held"])
@pytest.mark.parametrize("motion", ["up", "down"])
def test_stiffer_rubber_moves_as_the_same_under_smaller_loads_with_softer_sheets_and_fibres(motion, made, objective):
    """The state of a casting is that of the problem whose rubber has these moduli, with the same sheet and fibres."""
    factor = {"up": 1.3, "down": 0.8}[motion]
    problem = made(objective)
    scaled = made(objective, MATERIAL.replace("0.3 MPa", f"{0.3 * factor} MPa").replace("6 MPa", f"{6 * factor} MPa"))
    there = analysed(scaled)[1].equilibria["bend"].state
    disc, analysis = analysed(problem)
    at = as_cast(analysis.configurations["bend"], None, {MODULUS: factor - 1.0})
    found = solve(at, Tangent(disc.model), analysis.equilibria["bend"].state, tolerance=1e-11)
    assert np.abs(found.state.u - there.u).max() < 1e-7 * np.abs(there.u).max()
    assert np.abs(found.state.u - analysis.equilibria["bend"].state.u).max() > 0.02 * np.abs(there.u).max()


def analysed(problem):
    space, disc = space_of(problem), discretise(problem, starting_body(problem.tubes))
    return disc, analyse(problem, space, disc, space.start, tolerance=1e-11)
