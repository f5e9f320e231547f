"""What tolerances do to the motion: first derivatives against solutions with the changes made, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from texts import BEND_UNDER_LOADS, TWO_BESIDE, problem_text

from pneumorph.analysis.near import analyse_near
from pneumorph.analysis.scatter import one_deviation, scatter_of, with_moduli
from pneumorph.analysis.second_order import second_order
from pneumorph.analysis.thickening import thickenings
from pneumorph.analysis.tolerances import Tolerances, shape_causes
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import solve
from pneumorph.objective import measure_features
from pneumorph.problem import loads

MATERIAL = 'shear_modulus = "{:.12g} MPa"\nbulk_modulus = "{:.12g} MPa"\ndensity = "1.1 g/cm^3"'


@pytest.fixture(scope="module", params=["quadratic", "mixed"])
def whole(request):
    return solved(1.0, request.param)


def solved(factor, element="quadratic"):
    material = MATERIAL.format(0.3 * factor, 6.0 * factor)
    text = problem_text(BEND_UNDER_LOADS, material=material, chambers=TWO_BESIDE, radius=10)
    problem = loads(text).with_changes({"mesh.element": element, "mesh.size": "8 mm"})
    return analyse_near(problem, starting_body(problem.tubes), ())


def motion_at(whole, at):
    """The tip's motion (6,) of a configuration near that of the whole body."""
    equilibrium = solve(at, whole.disc.tangents["bend"], whole.analysis.equilibria["bend"].state, 1e-11)
    moved = measure_features(whole.disc.model, at.X, equilibrium.state)
    return np.concatenate([moved.translation, moved.rotation])


UNITS = {"mm": 1.0, "°": np.radians(1.0), "%": 0.01}


@pytest.mark.parametrize("seed", [1, 2])
def test_walls_and_cores_have_the_derivatives_of_the_discrete_problem(whole, seed):
    """Along a random sum of all of them, the remainder falls with order 2."""
    at, morph = whole.analysis.configurations["bend"], whole.disc.morph
    by = {
        cause.name: np.array(cause.by[:6]) / UNITS.get(cause.unit, 1.0)
        for cause in scatter_of(whole, Tolerances())["bend"].causes
    }
    random, start = np.random.default_rng(seed), motion_at(whole, at)
    along, slope = np.zeros_like(at.X), np.zeros(6)
    for each in shape_causes(morph, at.X, Tolerances()):
        everywhere = each.everywhere(morph)
        share = random.choice([-1.0, 1.0]) / np.abs(everywhere).max()
        along += share * everywhere
        slope += share * by[each.name]
    steps = np.array([0.1, 0.05])
    remainders = [
        np.linalg.norm(motion_at(whole, replace(at, X=at.X + step * along)) - start - step * slope) for step in steps
    ]
    assert np.log2(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.1)


def test_a_stiffer_rubber_and_a_higher_pressure_have_theirs(whole):
    element = "mixed" if whole.disc.model.mixed else "quadratic"
    causes = {cause.name: np.array(cause.by[:6]) for cause in scatter_of(whole, Tolerances())["bend"].causes}
    at, step = whole.analysis.configurations["bend"], 1e-3

    def along(load):
        pressure = at.loads.pressure + 1e-3 * load * np.array([1.0, 0.0])
        return motion_at(whole, replace(at, loads=at.loads._replace(pressure=pressure)))

    by_pressure = (along(0.01) - along(-0.01)) / 0.02
    np.testing.assert_allclose(causes["pressure of A"], by_pressure, atol=1e-5 * np.abs(by_pressure).max())
    up, down = (np.array(scatter_of(solved(1 + t, element), Tolerances())["bend"].motion) for t in (step, -step))
    by_modulus = 0.01 * (up - down) / (2 * step)
    scale = np.abs(by_modulus).max()
    np.testing.assert_allclose(causes["modulus of the rubber"], by_modulus, atol=1e-3 * scale)


def test_motions_with_other_moduli_are_those_of_bodies_of_such_rubbers(whole):
    element = "mixed" if whole.disc.model.mixed else "quadratic"
    found = with_moduli(whole, "bend", (1.0, 1.5))
    for factor, motion in zip((1.0, 1.5), found, strict=True):
        other = whole if factor == 1.0 else solved(factor, element)
        np.testing.assert_allclose(motion, scatter_of(other, Tolerances())["bend"].motion, atol=1e-5)


def test_a_region_s_rubber_has_its_own_tolerance(whole):
    tolerances = Tolerances(rubber=0.1, rubbers={"": 0.3})
    modulus, *others = scatter_of(whole, tolerances)["bend"].causes
    assert modulus.tolerance == pytest.approx(30.0) and others[0].unit != "%"
    again, history, *_ = scatter_of(whole, replace(tolerances, histories={"": 0.05}))["bend"].causes
    assert again == modulus and history.by == modulus.by and history.tolerance == pytest.approx(5.0)


def test_a_body_that_grows_by_a_factor_under_pressure_alone_grows_its_motion(whole):
    """Without weight and forces, a body twice as large moves by twice as much and turns by as much.

    It takes eight times as much air.
    """
    text = problem_text(
        '[[task]]\nname = "bend"\npressure = { A = "12 kPa" }\nobjective = { motion = "bending_y" }\n',
        material=MATERIAL.format(0.3, 6.0), chambers=TWO_BESIDE, radius=10,
    )  # fmt: skip
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    scatter = scatter_of(analyse_near(problem, starting_body(problem.tubes), ()), Tolerances())["bend"]
    by = np.array(next(cause.by for cause in scatter.causes if cause.name == "size of the body"))
    np.testing.assert_allclose(by[:3], 0.01 * np.array(scatter.motion[:3]), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(by[3:6], 0.0, atol=1e-8)
    np.testing.assert_allclose(by[6:], 0.03 * np.array(scatter.values[6:]), rtol=1e-5)
    assert not any(cause.name in ("weight", "springs", "force and torque") for cause in scatter.causes)


def test_castings_off_by_one_deviation_are_solved(whole):
    """With small tolerances the first-order deviation is that of the solutions; they approach it with order 2.

    So does the deviation to second order, relative to it.
    """
    far, more = [], []
    for part in (0.2, 0.1):
        usual = {name: value for name, value in vars(Tolerances()).items() if name not in ("rubbers", "histories")}
        shares = {"rubbers": {"": 0.1 * part}, "histories": {"": 0.05 * part}}
        tolerances = Tolerances(**{name: part * value for name, value in usual.items()}, **shares)
        scatter = scatter_of(whole, tolerances)["bend"]
        found = one_deviation(whole, "bend", scatter, 4)
        middle, deviation = scatter.motion[4], scatter.deviations[4]
        far.append(max(abs(found.up - middle - deviation), abs(middle - found.down - deviation)))
        assert far[-1] < 0.1 * deviation
        more.append(second_order(whole, "bend", scatter, 4, found) / deviation - 1.0)
    assert far[1] < 0.35 * far[0]
    assert 0.0 < more[1] < 0.35 * more[0] < 0.1


def test_what_rubber_does_at_its_places_adds_up_to_what_a_layer_does(whole):
    """The change per volume, over the surface, is that by rubber on all of it; bending by rubber has both signs."""
    change = thickenings(whole.problem, whole.disc, whole.analysis)["bend"]["bending_y"]
    mesh = whole.disc.morph.mesh.at(whole.analysis.X)
    causes = {cause.name: cause.by[4] for cause in scatter_of(whole, Tolerances())["bend"].causes}
    for face, where in (("exterior", "the exterior"), ("chamber A", "chamber A"), ("chamber B", "chamber B")):
        corners = mesh.faces[face][:, :3]
        first, second, third = (mesh.points[corners[:, k]] for k in range(3))
        areas = 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1)
        assert (areas / 3) @ change[corners].sum(axis=1) == pytest.approx(causes[f"rubber at {where}"], rel=1e-9)
    assert change.min() < 0.0 < change.max()
