"""What cannot be reached is refused before anything is computed; what can is not."""

import numpy as np
import pytest
from texts import problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import loads
from pneumorph.problem.checks.room import _largest_ball, _most_points
from pneumorph.problem.doubts import doubts

TASK = '[[task]]\nname = "t"\npressure = {{ {pressure} }}\nobjective = {{ {objective} }}\n'


def text(objective, symmetry="", pressure='A = "20 kPa"', rest="", body=""):
    task = TASK.format(pressure=pressure, objective=objective)
    return problem_text(task + rest, body=f"symmetry = {{ {symmetry} }}\n{body}")


def refused(given):
    with pytest.raises(ProblemError) as caught:
        loads(given)
    return caught.value.faults


@pytest.mark.parametrize(
    ("symmetry", "objective", "key", "named"),
    [
        ('mirror = ["yz"]', 'motion = "bending_y"', "motion", 'mirror "yz"'),
        ('mirror = ["xz", "yz"]', 'kind = "motion", bending_x = "9 deg"', "bending_x", 'mirror "xz"'),
        ("rotation = 3", 'motion = "-bending_x"', "motion", "rotation = 3"),
        ("rotation = 2", 'kind = "motion", shift_x = "2 mm"', "shift_x", "rotation = 2"),
        ('half_turn = "x"', 'motion = "bending_x"', "motion", 'half_turn = "x"'),
        ("point = true", 'kind = "motion", bending_y = "9 deg"', "bending_y", "point"),
        ('mirror = ["yz"]', 'kind = "motion", shift_x = "2 mm"', "shift_x", 'mirror "yz"'),
        ('mirror = ["xz"]', 'motion = "twist"', "motion", 'mirror "xz"'),
        ("point = true", 'kind = "motion", twist = "9 deg"', "twist", "point"),
    ],
)
def test_motions_that_a_symmetry_forbids(symmetry, objective, key, named):
    (fault,) = refused(text(objective, symmetry))
    assert fault.startswith(f"task[0].objective.{key}: ") and f"body.symmetry, {named}:" in fault


BESIDE = '[[obstacle]]\nname = "o"\nkind = "sphere"\nradius = "1 mm"\ncenter = ["9 mm", "9 mm", "12 mm"]\n'


@pytest.mark.parametrize(
    ("symmetry", "objective", "rest"),
    [
        ('mirror = ["yz"]', 'motion = "bending_x"', ""),
        ('mirror = ["xy"]', 'motion = "bending_x"', ""),
        ('half_turn = "x"', 'motion = "bending_y"', ""),
        ("rotation = 4", 'motion = "extension"', ""),
        ("rotation = 3", 'kind = "motion", extension = "2 mm", bending_x = "0 deg"', ""),
        # Loads without the symmetry allow it.
        ('mirror = ["yz"]', 'motion = "bending_y"', '[end_effector]\nforce = ["0.1 N", "0 N", "0 N"]\n'),
        ('half_turn = "x"', 'motion = "bending_x"', '[end_effector]\nspring = { shift_y = "1 N/mm" }\n'),
        ("rotation = 2", 'motion = "bending_x"', '[end_effector]\nhold = { bending_y = "30 deg" }\n'),
        ("rotation = 2", 'motion = "bending_x"', '[gravity]\ndirection = [0, 1, 0]\n'),
        ('mirror = ["xy"]', 'motion = "twist"', '[end_effector]\nforce = ["0 N", "0.1 N", "0 N"]\n'),
        ("rotation = 2", 'motion = "twist"', ""),
        ('mirror = ["xz"]', 'motion = "twist"', BESIDE),
    ],
)  # fmt: skip
def test_motions_that_it_allows(symmetry, objective, rest):
    loads(text(objective, symmetry, rest=rest))


EXTEND = 'motion = "extension"'


@pytest.mark.parametrize(
    ("envelope", "said"),
    [
        ('{ box = [["-20 mm", "-20 mm", "0 mm"], ["20 mm", "20 mm", "20 mm"]] }', "tip"),
        ('{ box = [["-20 mm", "-20 mm", "2 mm"], ["20 mm", "20 mm", "40 mm"]] }', "base"),
        ('{ box = [["-1.5 mm", "-20 mm", "-1 mm"], ["1.5 mm", "20 mm", "40 mm"]] }', "ball of radius 1.5 mm"),
    ],
)
def test_envelopes_without_room(envelope, said):
    faults = refused(text(EXTEND, rest=f"[limits]\nenvelope = {envelope}\n"))
    assert any(fault.startswith("limits.envelope: ") and said in fault for fault in faults), faults


def test_how_many_points_a_region_holds():
    """A square of side n d holds (n + 1)² points that are d apart, a triangle of side n d (n + 1)(n + 2)/2 of them."""
    normals = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    for n in (1, 2, 5):
        most = _most_points(normals, np.array([n, 0.0, n, 0.0]), 1.0)
        assert (n + 1) ** 2 <= most <= 1.2 * n**2 + 2 * n + 1
    half = np.sqrt(3.0) / 2.0
    sides = np.array([[0.0, -1.0], [half, 0.5], [-half, 0.5]])
    for n in (1, 3, 6):
        assert _most_points(sides, np.array([0.0, half * n, 0.0]), 1.0) == (n + 1) * (n + 2) / 2
    assert _largest_ball(sides, np.array([0.0, half, 0.0]))[0] == pytest.approx(np.sqrt(3.0) / 6.0)


def test_more_chambers_than_an_envelope_has_room_for():
    """Of a square of 6 mm with walls of 2 mm, a square of 2 mm is left, in which 4 points are 2 mm apart, and 9 not.

    Chambers may be as thin as needles.
    """
    few = problem_text(
        TASK.format(pressure='A1 = "20 kPa"', objective=EXTEND)
        + '[limits]\ncurvature = "5000 /mm^2"\n'
        + 'envelope = { box = [["-3 mm", "-3 mm", "-1 mm"], ["3 mm", "3 mm", "40 mm"]] }\n',
    )
    few = few.replace('radius = "8 mm"', 'radius = "3.7 mm"').replace('radius = "4 mm"', 'radius = "0.6 mm"')
    few = few.replace('center = ["0 mm", "0 mm"]', 'center = ["2 mm", "0 mm"]\ncopies = NUMBER')
    assert any("limits.envelope: has room for at most" in each for each in refused(few.replace("NUMBER", "9")))
    loads(few.replace("NUMBER", "4"))


BOX = '{{ box = [["-{0} mm", "-{1} mm", "-1 mm"], ["{0} mm", "{1} mm", "40 mm"]] }}'


def sized(rest, radius):
    """A body of a radius in mm, with a chamber of less than half of it."""
    given = text(EXTEND, rest=rest).replace('radius = "8 mm"', f'radius = "{radius} mm"')
    return given.replace('radius = "4 mm"', f'radius = "{0.45 * radius} mm"')


@pytest.mark.parametrize(("envelope", "refuses"), [(4.0, True), (5.9, True), (6.1, False), (12.0, False)])
def test_a_body_that_begins_far_outside_of_its_envelope(envelope, refuses):
    given = text(EXTEND, rest=f'[limits]\nenvelope = {{ radius = "{envelope} mm" }}\n')
    if refuses:
        (fault,) = refused(given)
        assert fault.startswith("limits.envelope: is left by the body") and f"{8 - envelope:.3g} mm" in fault
    else:
        loads(given)


def test_walls_and_curvature_need_room_together():
    """A section with a curvature of 1/r at most has a circle of radius r in it: r = 1 / sqrt(2 h)."""
    for curvature, circle in ((0.3, 1.291), (0.04, 3.5355)):
        rest = f'[limits]\nwall = "2 mm"\ncurvature = "{curvature} /mm^2"\nenvelope = '
        for envelope in ('{{ radius = "{0} mm" }}', BOX):
            with_room, without = (
                sized(rest + envelope.format(2.0 + f * circle, 20) + "\n", 1.2 * (2.0 + circle)) for f in (1.01, 0.99)
            )
            loads(with_room)
            (fault,) = refused(without)
            assert fault.startswith("limits.envelope: ") and f"needs {2 + circle:.3g} mm" in fault
    # A dome may be as short as it likes.
    short = sized('[limits]\ncurvature = "0.3 /mm^2"\nenvelope = { radius = "3.2 mm" }\n', 3.9)
    loads(short.replace('span = ["3 mm", "21 mm"]', 'span = ["3 mm", "7 mm"]'))


@pytest.mark.parametrize(("limits", "key"), [("margin = 1e6", "limits.margin"), ("strain = 0.2", "limits.strain")])
def test_limits_on_states_out_of_reach(limits, key):
    material = 'shear_modulus = "0.1 MPa"\nbulk_modulus = "10 MPa"\ndensity = "1 g/cm^3"\nvalid_stretch = 4.0'
    task = TASK.format(pressure='A = "20 kPa"', objective=EXTEND)
    faults = refused(problem_text(task + f"[limits]\n{limits}\n", material=material))
    assert [fault.partition(":")[0] for fault in faults] == [key]
    loads(problem_text(task + "[limits]\nmargin = 1.3\nstrain = 0.5\n", material=material))


BALL = '[[obstacle]]\nname = "o"\nkind = "sphere"\nradius = "0.5 mm"\ncenter = ["{} mm", "0 mm", "12 mm"]\n'


@pytest.mark.parametrize(("x", "where"), [(6, "the rubber"), (0, 'chamber "A"'), (20, None)])
def test_obstacles_in_the_body(x, where):
    given = text(EXTEND, rest=BALL.format(x))
    if where is None:
        loads(given)
    else:
        (fault,) = refused(given)
        assert fault.startswith(f"obstacle[0].center: is in {where}")


def test_a_body_of_another_unit():
    given = text(EXTEND)
    assert 'length = "24 mm"' in given
    for length, meant in (("24 um", "24 mm?"), ("24 m", "24 mm?")):
        faults = refused(given.replace('length = "24 mm"', f'length = "{length}"').replace("[[task]]", "[[task]]", 1))
        assert any(fault.startswith("body.length") and meant in fault for fault in faults), faults
    assert not list(doubts(loads(given)))
