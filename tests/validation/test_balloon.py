"""Balloons of rubbers that were measured as sheets: their rubbers, the air in them, and what is compared."""

import numpy as np
import pytest

from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.mechanics.material.judge import fit_all
from pneumorph.validation import balloon
from pneumorph.validation.balloon import RADIUS, SHEETS, WALL, filled, spread, tension, volumes_at
from pneumorph.validation.tables import problem_of, table_of


def thin(problem, stretch):
    """p = 2 (t/r) S/λ² in MPa of a thin balloon."""
    rubber = rubber_of(problem.material)
    return (
        2
        * WALL
        / RADIUS
        * nominal_stress(rubber.isochoric, np.array(rubber.parameters[:-1]), stretch, balloon.MODE)
        / stretch**2
    )


def test_a_balloon_of_elements_has_the_pressure_of_a_thin_one():
    problem, stretch = problem_of("balloon", "natural_moderate", 6.0), np.array([1.05, 1.38, 1.7])
    pressures, reason = filled(problem, volumes_at(stretch))
    assert not reason and pressures[1] > pressures[2] > pressures[0]
    np.testing.assert_allclose(pressures, thin(problem, stretch), rtol=0.01)


@pytest.mark.parametrize("rubber", SHEETS)
def test_frozen_rubbers_are_the_best_of_the_tension_test_alone(rubber):
    problem = problem_of("balloon", rubber, 8.0)
    best = fit_all([tension(problem, SHEETS[rubber])])[0]
    assert best.form.model == problem.material.model and best.reach == problem.material.valid_stretch
    np.testing.assert_allclose(best.parameters, rubber_of(problem.material).parameters[:-1], rtol=1e-3)


def test_the_wall_within_its_middle_keeps_its_volume():
    inner, stretch = RADIUS - WALL / 2, np.array([1.0, 1.5, 2.0])
    widened = np.cbrt(volumes_at(stretch) / (4 / 3 * np.pi) + inner**3)
    np.testing.assert_allclose((stretch * RADIUS) ** 3 - widened**3, RADIUS**3 - inner**3)


def test_models_that_fit_tension_alike_differ_most_beyond_its_end():
    test = tension(problem_of("balloon", "silicone", 8.0), "silicone")
    inside, beyond = spread(test, np.array([1.5, 2.0]))
    assert 0 < inside < 0.02 < 0.25 < beyond


def pressed(problem, volumes):
    """Pressures without a solution, 1 % higher for every 5 mm of elements."""
    return 1e-2 * (1 + 2e-3 * problem.mesh.size) * np.ones(len(volumes)), ""


def test_points_beyond_the_tension_test_are_told_apart(monkeypatch):
    monkeypatch.setattr(balloon, "filled", pressed)
    found = {(one.rubber, one.case): one for one in balloon.balloons()}
    assert [len(one.at) for one in found.values()] == [7, 6, 16, 10]
    inside, beyond = list(found.values())[:2]
    # Ī₁ of a stretch λ in tension, λ² + 2/λ, and in a balloon, 2 λ² + λ⁻⁴.
    assert np.all(2 * inside.at**2 + inside.at**-4 <= 2.17**2 + 2 / 2.17)
    assert np.all(2 * beyond.at**2 + beyond.at**-4 > 2.17**2 + 2 / 2.17)
    own = table_of("balloon")
    np.testing.assert_allclose(inside.measured[0], 1e3 * 2 / 20 * own["nominal_stress_MPa"][1] / own["stretch"][1] ** 2)
    mesh = 10 * 2e-3 * balloon.SIZE / 2
    parts = 0.1 * inside.predicted, spread(tension(problem_of("balloon", "silicone", 8.0), "silicone"), inside.at)
    np.testing.assert_allclose(inside.error, np.sqrt(parts[0] ** 2 + (parts[1] * inside.predicted) ** 2 + mesh**2))


def test_a_balloon_without_a_state_says_why(monkeypatch):
    monkeypatch.setattr(balloon, "filled", lambda problem, volumes: (pressed(problem, volumes[:3])[0], "it bursts"))
    ended = next(balloon.balloons())
    assert len(ended.at) == 3 and ended.missing == "it bursts"
    monkeypatch.setattr(balloon, "filled", lambda problem, volumes: (np.zeros(0), "it bursts"))
    none = next(balloon.balloons())
    assert none.rms is None and none.missing == "it bursts"
