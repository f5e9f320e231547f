"""Sections of imposed motions, and objectives that compare them with targets."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.mechanics import build_model, neo_hookean_rubber
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.objective import Features, build_objectives, equidistant, match, measure_features, reach
from pneumorph.objective.kinds import KINDS
from pneumorph.problem import Reach, loads
from pneumorph.problem.objectives import KINDS as problem_kinds
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.verify.solids import tube

LENGTH, COUNT = 40.0, 5
SLABS = equidistant(COUNT, LENGTH)
MESH = tube(4, 8, LENGTH, (1, 12, 10))
MODEL = build_model(MESH, neo_hookean_rubber(0.49, 4.80, 1.1e-9), plate=False)


def _below(table):
    return [each for own in table.__subclasses__() for each in (own, *_below(own))]


def test_every_kind_in_problem_files_has_an_objective():
    assert set(KINDS) == {each for each in _below(ObjectiveTable) if not each.__subclasses__()}
    assert len(KINDS) == len(problem_kinds)


def sections(moved):
    """Centres and rotations of the sections of the tube whose nodes have gone to these places."""
    state = State(moved - MESH.points, np.zeros(6))
    found = measure_features(MODEL, MESH.points, state, SLABS)
    return np.array(found.section_position), np.array(found.section_rotation)


def on_arc(points, rate):
    """Cross-sections set upright on a circle in the plane xz with this curvature, 1/mm."""
    x, y, z = points.T
    turns = Rotation.from_rotvec(np.outer(rate * z, [0.0, 1.0, 0.0]))
    line = np.column_stack([(1 - np.cos(rate * z)) / rate, 0 * z, np.sin(rate * z) / rate])
    return line + turns.apply(np.column_stack([x, y, 0 * z]))


def test_sections_at_rest_are_where_they_were():
    position, rotation = sections(MESH.points)
    np.testing.assert_allclose(rotation, np.broadcast_to(np.eye(3), rotation.shape), atol=1e-12)
    np.testing.assert_allclose(position, np.outer(SLABS.middle, [0, 0, 1]), atol=0.06)
    np.testing.assert_allclose(np.diff(position[:, 2]), LENGTH / COUNT, atol=1e-9)


@pytest.mark.parametrize("turn", [[0.3, -0.2, 0.9], [0.0, 2.9, 0.0]])
def test_sections_go_with_a_rigid_motion(turn):
    turned, shift = Rotation.from_rotvec(turn), np.array([1.0, -2.0, 3.0])
    rest, _ = sections(MESH.points)
    position, rotation = sections(turned.apply(MESH.points) + shift)
    np.testing.assert_allclose(position, turned.apply(rest) + shift, atol=1e-9)
    np.testing.assert_allclose(rotation, np.broadcast_to(turned.as_matrix(), rotation.shape), atol=1e-9)


def test_sections_of_a_circular_arc():
    rate = 0.04
    position, rotation = sections(on_arc(MESH.points, rate))
    step = Rotation.from_rotvec([0.0, rate * LENGTH / COUNT, 0.0])
    # The mesh repeats from section to section, so each is the last one carried along the arc, to rounding.
    relative = rotation[1:] @ rotation[:-1].transpose(0, 2, 1)
    np.testing.assert_allclose(relative, np.broadcast_to(step.as_matrix(), relative.shape), atol=1e-9)
    centre = np.array([1 / rate, 0.0, 0.0])
    np.testing.assert_allclose(position[1:] - centre, step.apply(position[:-1] - centre), atol=1e-9)
    wanted = Rotation.from_rotvec(np.outer(rate * SLABS.middle, [0.0, 1.0, 0.0])).as_matrix()
    np.testing.assert_allclose(rotation, wanted, atol=5e-3)


def test_sections_of_a_twisted_tube():
    rate = 0.03
    turns = Rotation.from_rotvec(np.outer(rate * MESH.points[:, 2], [0.0, 0.0, 1.0]))
    _, rotation = sections(turns.apply(MESH.points))
    vectors = Rotation.from_matrix(rotation).as_rotvec()
    np.testing.assert_allclose(np.diff(vectors[:, 2]), rate * LENGTH / COUNT, atol=1e-9)
    np.testing.assert_allclose(vectors[:, 2], rate * SLABS.middle, atol=5e-3)


def test_a_stretch_turns_nothing():
    _, rotation = sections(MESH.points * [0.8, 1.1, 1.7])
    np.testing.assert_allclose(rotation, np.broadcast_to(np.eye(3), rotation.shape), atol=1e-12)


NONE = (np.zeros((0, 3)), np.zeros((0, 3, 3)))


def features(position, rotation, translation=(0, 0, 0), vector=(0, 0, 0)):
    moved, turned, places, turns = (jnp.array(part, float) for part in (translation, vector, position, rotation))
    return Features(moved, turned, {"A": jnp.array(100.0)}, places, turns)


def test_a_shape_that_matches_itself():
    position, rotation = sections(on_arc(MESH.points, 0.04))
    found = match(SLABS, position, rotation, 2.0, 0.3)
    own = features(position, rotation)
    assert float(found.value(own)) == pytest.approx(0.0, abs=1e-20)
    assert {name: float(error(own)) for name, error in found.errors.items()} == pytest.approx(
        {"orientation_rad": 0.0, "position_mm": 0.0}, abs=1e-9
    )


def test_a_shape_off_its_target():
    angle, far = 0.1, np.array([1.0, -2.0, 2.0])
    straight = np.outer(SLABS.middle, [0.0, 0.0, 1.0])
    upright = np.broadcast_to(np.eye(3), (COUNT, 3, 3))
    bent = Rotation.from_rotvec(np.outer(np.arange(1, COUNT + 1), [0.0, angle, 0.0])).as_matrix()
    found = match(SLABS, straight, upright, 2.0, 0.3)
    off = features(straight + far, bent)
    # Every section is off by the angle relative to the one before, the first to the base; (10) counts it twice.
    assert float(found.value(off)) == pytest.approx(2.0 * 2 * COUNT * angle**2 + 0.3 * COUNT * 9.0, rel=1e-10)
    assert float(found.errors["orientation_rad"](off)) == pytest.approx(angle)
    assert float(found.errors["position_mm"](off)) == pytest.approx(3.0)
    # A fault in one section alone is one in its step and in the next.
    one = np.array(upright)
    one[2] = Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix()
    assert float(match(SLABS, None, upright).value(features(straight, one))) == pytest.approx(4 * angle**2, rel=1e-10)


def test_orientations_of_the_file_are_matched():
    (found,) = build_objectives(
        arm('{ kind = "match_sections", rotations = [["0 deg", "20 deg", "0 deg"], ["0 deg", "50 deg", "0 deg"]] }')
    ).values()
    turns = Rotation.from_euler("y", [[20], [50]], degrees=True).as_matrix()
    assert found.slabs.middle.tolist() == [6.0, 18.0] and found.slabs.half == 6.0
    assert set(found.errors) == {"orientation_rad"}
    assert float(found.value(features(np.zeros((2, 3)), turns))) == pytest.approx(0.0, abs=1e-20)
    still = features(np.zeros((2, 3)), np.broadcast_to(np.eye(3), (2, 3, 3)))
    assert float(found.value(still)) == pytest.approx(2 * np.radians(20) ** 2 + 2 * np.radians(30) ** 2)


def test_the_plate_reaches_a_place_and_an_orientation():
    asked = Reach.model_validate(
        {
            "kind": "reach",
            "position": ["10 mm", "0 mm", "70 mm"],
            "rotation": ["0 deg", "40 deg", "0 deg"],
            "position_weight": 0.5,
            "rotation_weight": 3.0,
        }
    )
    found = reach(asked, np.array([0.0, 0.0, 80.0]))
    there = features(*NONE, [10, 0, -10], np.radians([0, 40, 0]))
    assert float(found.value(there)) == pytest.approx(0.0, abs=1e-20)
    off = features(*NONE, [13, 4, -10], np.radians([0, 10, 0]))
    assert float(found.value(off)) == pytest.approx(0.5 * 25 + 3.0 * 2 * np.radians(30) ** 2)
    assert float(found.errors["position_mm"](off)) == pytest.approx(5.0)
    assert float(found.errors["orientation_rad"](off)) == pytest.approx(np.radians(30))


def test_the_plate_reaches_one_of_them_alone():
    only = Reach.model_validate({"kind": "reach", "position": ["0 mm", "3 mm", "80 mm"]})
    found = reach(only, np.array([0.0, 0.0, 80.0]))
    turned = features(*NONE, [0, 0, 0], [0.5, 0, 0])
    assert float(found.value(turned)) == pytest.approx(0.01 * 9) and set(found.errors) == {"position_mm"}
    only = Reach.model_validate({"kind": "reach", "rotation": ["0 deg", "0 deg", "90 deg"]})
    found = reach(only, np.array([0.0, 0.0, 80.0]))
    far = features(*NONE, [9, 9, 9], [0, 0, 0])
    assert float(found.value(far)) == pytest.approx(np.pi**2 / 2) and set(found.errors) == {"orientation_rad"}


def arm(objective):
    return loads(tiny(objective=objective))


@pytest.mark.parametrize(
    ("points", "degree", "said"),
    [
        ([0, 20, 10], 1, "the curve reverses its direction"),
        ([0, 20, 5, 10], 3, "the curve reverses its direction"),
        ([0, 10, 10, 24], 1, "the curve has no direction"),
    ],
)
def test_a_curve_without_direction_is_refused(points, degree, said):
    places = ", ".join(f'["0 mm", "0 mm", "{z} mm"]' for z in points)
    asked = arm(f'{{ kind = "match_curve", sections = 4, degree = {degree}, control_points = [{places}] }}')
    with pytest.raises(ProblemError) as caught:
        build_objectives(asked)
    assert str(caught.value).startswith(f"task[0].objective.control_points: {said}")
