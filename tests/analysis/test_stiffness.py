"""The stiffness of the tip: that of a beam, symmetric, that of small forces; energies and forces of a blocked tip."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

import pneumorph as pm
from pneumorph.analysis.stiffness import direction, stiffness_at, turns_by_vector
from pneumorph.errors import ProblemError
from pneumorph.mechanics import Equilibrium, rotation, solve
from pneumorph.problem import loads
from pneumorph.results import SweepStep, from_json, to_json

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

TASK = """
[[task]]
name = "bend"
pressure = { A = "30 kPa", B = "5 kPa" }
objective = { kind = "maximize", motion = "bending_y" }
[mesh]
size = "6 mm"
"""
BODY = 'control_density = "0.3 /mm"\nsymmetry = { mirror = ["xz"] }'
PLATE = '[end_effector]\nkind = "plate"\n'


def beside(plate=PLATE):
    """A body that bends, with chambers on both sides of its axis."""
    text = problem_text(plate + TASK, chambers=TWO_BESIDE, radius=11, body=BODY)
    return pm.starting_design(loads(text))


def solved(design):
    explorer, pressures = design.explorer(), {"A": 0.03, "B": 0.005}
    at, answer, tangent = explorer.solved(pressures, pressures)
    assert isinstance(answer, Equilibrium)
    return at, answer, tangent, explorer.whole(pressures)


def test_a_thin_rod_is_a_beam():
    """Shear and the clamped end change that by about (d/L)²."""
    length, radius, inner = 80.0, 4.0, 1.0
    text = problem_text(
        PLATE + TASK.replace('"6 mm"', '"4 mm"').replace(', B = "5 kPa"', ""),
        length=length,
        radius=radius,
        chambers=(("A", inner, "0 mm", "0 mm"),),
    )
    design = pm.starting_design(loads(text))
    simulated = design.simulate({"A": "0 kPa"}, stiffness=True)
    (step,) = simulated.steps
    mu = simulated.simulation.model.rubber.shear_modulus
    kappa = simulated.simulation.model.rubber.bulk_modulus
    young = 9 * kappa * mu / (3 * kappa + mu)
    area, second = math.pi * (radius**2 - inner**2), math.pi / 4 * (radius**4 - inner**4)
    soft = np.array(step.stiffness.compliance)
    bend = length / (young * second)
    expected = [
        (soft[0, 0], bend * length**2 / 3),
        (soft[1, 1], bend * length**2 / 3),
        (soft[2, 2], length / (young * area)),
        (soft[3, 3], bend),
        (soft[4, 4], bend),
        (soft[5, 5], length / (mu * 2 * second)),
        (soft[0, 4], bend * length / 2),
        (soft[1, 3], -bend * length / 2),
    ]
    for found, beam in expected:
        assert found == pytest.approx(beam, rel=0.08)
    assert step.stiffness.energy == pytest.approx(0.0, abs=1e-9)
    assert step.stiffness.air["A"] == pytest.approx(0.0, abs=1e-6)
    values, axes = step.stiffness.axes
    assert values[0] < values[2] and abs(axes[2, 2]) == pytest.approx(1.0, abs=1e-3)


def test_small_forces_do_what_it_says():
    design = beside()
    at, answer, tangent, whole = solved(design)
    stiff = np.array(stiffness_at(at, tangent, answer, whole).compliance)
    assert whole is not None and at.model is whole.part
    at, state, tangent = whole.configuration(at), whole.state(answer.state), whole.tangent
    np.testing.assert_allclose(stiff, stiff.T, rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(stiff).min() > 0.0
    moved = []
    for row in range(3):
        ends = []
        for sign in (1.0, -1.0):
            there = replace(at, loads=at.loads._replace(wrench=1e-3 * sign * np.eye(6)[row]))
            found = solve(there, tangent, since=(at, state), tolerance=1e-11)
            ends.append(np.array(found.plate))
        by = (ends[0] - ends[1]) / 2e-3
        by[3:] = turns_by_vector(answer.plate[3:]) @ by[3:]
        moved.append(by)
    np.testing.assert_allclose(np.array(moved).T, stiff[:, :3], rtol=1e-4, atol=1e-5 * np.abs(stiff[:, :3]).max())


def test_turns_of_rotation_vectors_are_those_in_space():
    rng = np.random.default_rng(0)
    for size in (0.0, 1e-5, 1e-3, 2.0):
        theta, change = size * rng.normal(size=3), 1e-6 * rng.normal(size=3)
        ends = [np.asarray(rotation(theta + sign * change)) for sign in (1.0, -1.0)]
        spin = (ends[0] - ends[1]) @ np.asarray(rotation(theta)).T / 2
        np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], turns_by_vector(theta) @ change, atol=1e-11)


def test_the_energy_is_the_work_of_the_air():
    design = beside()
    steps = design.simulate({"A": "0:30:3 kPa", "B": "0:30:3 kPa"}, stiffness=True).steps
    work = 0.0
    for before, step in pairwise(steps):
        for name in "AB":
            mean = (before.pressures[name] + step.pressures[name]) / 2
            work += mean * (step.volumes[name] - before.volumes[name])
    last = steps[-1]
    assert last.stiffness.energy == pytest.approx(work, rel=2e-3)
    expected = last.volumes["A"] * (1 + 0.03 / 0.101325) - steps[0].volumes["A"]
    assert last.stiffness.air["A"] == pytest.approx(expected, rel=1e-9)
    assert from_json(SweepStep, to_json(last)) == last


def test_a_blocked_tip_presses_as_one_that_is_held():
    design = beside()
    (free,) = design.simulate({"A": "30 kPa", "B": "5 kPa"}, along="x").steps
    (held,) = design.simulate({"A": "30 kPa", "B": "5 kPa"}, block="shift_x").steps
    assert abs(held.reaction["shift_x"]) > 0.01
    assert free.stiffness.blocked == pytest.approx(held.reaction["shift_x"], rel=1e-3)
    (stiff,) = design.simulate({"A": "30 kPa", "B": "5 kPa"}, block="shift_x", stiffness=True).steps
    assert np.abs(np.array(stiff.stiffness.compliance)[0]).max() == 0.0


def test_a_free_tip_is_little_softer_than_one_with_a_plate():
    """The plate keeps the face plane."""
    found = []
    for plate in (PLATE, '[end_effector]\nkind = "free"\n'):
        (step,) = beside(plate).simulate({"A": "30 kPa", "B": "5 kPa"}, stiffness=True).steps
        found.append(np.array(step.stiffness.compliance))
    np.testing.assert_allclose(found[1], found[1].T, atol=1e-9)
    assert np.linalg.eigvalsh(found[1]).min() > 0.0
    assert 1.0 < found[1][0, 0] / found[0][0, 0] < 1.2


@pytest.mark.parametrize("text", ["", "w", "1,0", "0,0,0", "1,nan,0", "1,0,0,0"])
def test_directions(text):
    assert direction("-z") == (0.0, 0.0, -1.0)
    assert direction("3,0,4") == pytest.approx((0.6, 0.0, 0.8))
    with pytest.raises(ProblemError, match="blocked-along"):
        direction(text)
