"""Bodies drawn for a target fit into its space, keep the least wall, and have the symmetry that the tasks allow."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.proposals import Target, draw_candidates
from pneumorph.proposals.candidates import suited


def target(*motions, length=60.0, radius=11.0, wall=2.0, **more):
    """A target with a task for every motion."""
    return Target.model_validate(
        {
            "material": {"name": "Dragon Skin 30"},
            "space": {"length": f"{length} mm", "radius": f"{radius} mm"},
            "pressure": {"max": "50 kPa"},
            "limits": {"wall": f"{wall} mm"},
            "task": [{"name": f"t{k}", "objective": {"motion": motion}} for k, motion in enumerate(motions)],
        }
        | more
    )


MOTIONS = ("extension", "bending_y", "-bending_x", "twist")


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.sampled_from(MOTIONS), min_size=1, max_size=3, unique=True),
    st.floats(20, 200),
    st.floats(6, 25),
    st.floats(0.8, 3),
)
def test_walls_are_kept_and_the_space_is_not_left(motions, length, radius, wall):
    asked = target(*motions, length=length, radius=radius, wall=wall, reinforcement=True)
    for drawn in draw_candidates(asked, 8):
        if drawn.problem is None:
            assert drawn.reason
            continue
        body = drawn.problem.body
        assert body.length == pytest.approx(length, rel=1e-3) and body.radius <= radius
        for one in body.chamber:
            away = np.hypot(*one.center)
            assert body.radius - away - one.radius >= wall * (1 - 1e-3)
            assert one.span[0] >= wall and one.span[1] <= length - wall * (1 - 1e-3)
        for one, other in itertools.combinations(body.chamber, 2):
            beside = np.hypot(*np.subtract(one.center, other.center)) - one.radius - other.radius
            apart = max(one.span[0] - other.span[1], other.span[0] - one.span[1])
            assert max(beside, apart) >= wall * (1 - 1e-3)
        for task in drawn.problem.task:
            assert all(0.0 <= each.start <= each.max == pytest.approx(0.05) for each in task.pressure.values())


def test_a_candidate_depends_on_the_seed_and_its_number_alone():
    asked = target("bending_y")
    few, many = list(draw_candidates(asked, 3, seed=5)), list(draw_candidates(asked, 9, seed=5))
    assert few == many[:3]
    assert few != list(draw_candidates(asked, 3, seed=6))


@pytest.mark.parametrize(
    "motions, layout, mirror",
    [(["extension"], "central", ("xz", "yz")), (["bending_y"], "beside", ("xz",)), (["bending_x"], "beside", ("yz",))],
)
def test_symmetry_is_as_much_as_tasks_allow(motions, layout, mirror):
    found = [each for each in draw_candidates(target(*motions), 12) if each.layout == layout]
    assert found
    assert all(each.posed.body.symmetry.mirror == mirror for each in found)


def test_threads_have_turns_and_twist_to_the_side_that_is_asked():
    for motion, sign in (("twist", 1), ("-twist", -1)):
        found = [each.posed.body for each in draw_candidates(target(motion), 6) if each.layout == "threads"]
        assert found
        assert all(np.sign(body.ripple.lobes) == sign for body in found)
        assert all(body.symmetry.rotation == abs(body.ripple.lobes) for body in found)


def test_what_cannot_work_is_ruled_out():
    def names(asked):
        return {layout.name for layout in suited(asked)[0]}

    assert names(target("bending_y", "bending_x")) == {"around3", "around4"}
    assert "around2" in names(target("bending_y", "-bending_y"))
    assert "central" not in names(target("twist"))
    assert "wound" not in names(target("bending_y"))
    assert "wound" in names(target("bending_y", reinforcement=True))


def test_a_space_without_room_says_so():
    found = list(draw_candidates(target("bending_y", radius=3.0), 3))
    assert all(each.problem is None and "wall" in each.reason for each in found)
