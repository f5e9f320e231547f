"""Amounts by which the tip is to move: "bend by 60°" and several at once."""

import jax.numpy as jnp
import numpy as np
import pytest
from records import task_result
from tiny import tiny

from pneumorph.analysis import analyse_body, run_gradient_check
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import mirrors_of
from pneumorph.objective import Features, build_objectives
from pneumorph.problem import TargetMotion, loads

SEVERAL = '{ kind = "motion", shift_y = "1 mm", axial = "3 mm", bending_y = "60 deg", torsion = "-9 deg" }'


def problem(objective, symmetry=""):
    head = f"symmetry = {symmetry}\n[[body.chamber]]" if symmetry else "[[body.chamber]]"
    return loads(tiny(objective=objective).replace("[[body.chamber]]", head))


def features(translation, rotation):
    moved, turned = (jnp.array(part, float) for part in (translation, rotation))
    return Features(moved, turned, {}, jnp.zeros((0, 3)), jnp.zeros((0, 3, 3)))


def test_only_what_is_given_counts():
    found = build_objectives(problem(SEVERAL))["extend"]
    there = np.radians([0.0, 60.0, -9.0])
    # x and the rotation about x are free.
    assert float(found.value(features((7, 1, 3), (0.4, *there[1:])))) == pytest.approx(0.0, abs=1e-12)
    off = features((7, 1 + 2, 3 - 1), (0.4, there[1] + 0.1, there[2] - 0.2))
    assert float(found.value(off)) == pytest.approx(0.01 * (4 + 1) + 0.01 + 0.04)
    assert {name: float(error(off)) for name, error in found.errors.items()} == pytest.approx(
        {"position_mm": 5**0.5, "orientation_rad": 0.05**0.5}
    )
    # Gauss-Newton needs residuals.
    assert found.residuals is not None and found.residuals(off).shape == (4,)
    only = build_objectives(problem('{ kind = "motion", bending_y = "60 deg" }'))["extend"]
    assert set(only.errors) == {"orientation_rad"} and only.residuals(off).shape == (1,)


def test_the_gradient_is_exact():
    check = run_gradient_check(
        analyse_body(found := problem(SEVERAL.replace("60", "6").replace("3 mm", "0.5 mm")), starting_body(found.tubes))
    )
    assert check.passed and len(check.tests) == 2
    assert all(check.tests[name].passed for name in check.tests), check


@pytest.mark.parametrize(
    ("objective", "planes"),
    [
        ('bending_y = "60 deg"', ["xz"]),
        ('bending_x = "60 deg"', ["yz"]),
        ('bending_y = "60 deg", twist = "0 deg", shift_y = "0 mm"', ["xz"]),
        ('twist = "0 deg"', ["xz", "yz"]),
        ('extension = "2 mm"', ["xz", "yz"]),
    ],
)
def test_part_of_a_body_is_enough_where_the_target_is_symmetric(objective, planes):
    asked = problem(f'{{ kind = "motion", {objective} }}', f"{{ mirror = {planes} }}")
    assert mirrors_of(asked) == tuple(planes)


def test_a_target_that_is_not_symmetric_is_refused():
    with pytest.raises(ProblemError, match=r'objective\.bending_x: .* mirror "xz"'):
        problem('{ kind = "motion", bending_y = "60 deg", bending_x = "5 deg" }', '{ mirror = ["xz"] }')


def test_a_mirrored_body_cannot_be_asked_to_twist():
    with pytest.raises(ProblemError, match=r'objective\.twist: .* mirror "xz"'):
        problem('{ kind = "motion", twist = "9 deg" }', '{ mirror = ["xz"] }')


def test_what_is_shown():
    found = task_result(
        translation=(1.0, 2.0, 3.0), rotation=tuple(np.radians([1.0, 45.0, 2.0])),
        errors={"position_mm": 2.5, "orientation_rad": np.radians(15.0)},
    )  # fmt: skip
    bend = problem('{ kind = "motion", bending_y = "60 deg" }').task[0].objective.achieved(found)
    assert (bend.word, bend.beside_target) == ("bending about y", "45.00° (target 60°)")
    shift = problem('{ kind = "motion", shift_x = "4 mm" }').task[0].objective.achieved(found)
    assert (shift.word, shift.beside_target) == ("shift along x", "1.00 mm (target 4 mm)")
    assert problem(SEVERAL).task[0].objective.achieved(found)[:3] == (2.5, "mm", "distance from the target")
    turns = problem('{ kind = "motion", bending_x = "0 deg", bending_y = "60 deg" }').task[0]
    both = turns.objective.achieved(task_result(errors={"orientation_rad": np.radians(15.0)}))
    assert (str(both), both.word) == ("15.00°", "angle from the target")


def test_it_is_written_and_read_again():
    asked = problem(SEVERAL)
    assert loads(asked.to_toml()) == asked
    assert isinstance(asked.task[0].objective, TargetMotion)
    assert asked.task[0].objective.targets == pytest.approx(
        {"shift_y": 1.0, "extension": 3.0, "bending_y": np.radians(60), "twist": np.radians(-9)}
    )


def test_bodies_are_cut_where_they_shall_bend():
    asked = problem('{ kind = "motion", bending_y = "60 deg" }')
    np.testing.assert_allclose(asked.task[0].objective.bends(asked.body.length) / np.radians(60), [0.0, 1.0])
    asked = problem('{ kind = "motion", shift_x = "20 mm" }')
    np.testing.assert_allclose(asked.task[0].objective.bends(asked.body.length), [0.0, 20.0])
