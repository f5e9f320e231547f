"""Bodies drawn for a target fit into its space, keep the least wall, and have the symmetry that the tasks allow."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem
from pneumorph.problem.beam import column_load
from pneumorph.proposals import Plan, Target, draw_candidates, propose
from pneumorph.proposals.candidates import draw_candidate, suited
from pneumorph.proposals.estimates import BUCKLED, ballooning, impossible
from pneumorph.proposals.layouts import LAYOUTS
from pneumorph.symmetry.operations import operations


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


def numbers(seed):
    """Numbers by which choices are made."""
    return iter(np.random.default_rng(seed).random, None)


def drawn_as(asked, name, count):
    """Bodies of a layout that were found for a target."""
    [layout] = [each for each in LAYOUTS if each.name == name]
    found = [draw_candidate(asked, layout, "one", numbers([seed, 3])) for seed in range(count)]
    return [each for each in found if each.problem is not None]


MOTIONS = ("extension", "bending_y", "-bending_x", "twist")


@settings(max_examples=12, deadline=None)
@given(
    st.lists(st.sampled_from(MOTIONS), min_size=1, max_size=3, unique=True),
    st.floats(20, 200),
    st.floats(6, 25),
    st.floats(0.8, 3),
)
def test_walls_are_kept_and_the_space_is_not_left(motions, length, radius, wall):
    asked = target(*motions, length=length, radius=radius, wall=wall, reinforcement=True)
    layouts = [each for each in suited(asked)[0] if each.name not in ("profile", "sheet", "pneunet", "bellows")]
    for number, layout in enumerate(layouts):
        drawn = draw_candidate(asked, layout, "one", numbers(number))
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
    asked = target("twist")
    few, many = list(draw_candidates(asked, 3, seed=5)), list(draw_candidates(asked, 9, seed=5))
    assert few == many[:3]
    assert few != list(draw_candidates(asked, 3, seed=6))


@pytest.mark.parametrize(
    "motions, layout, mirror",
    [(["extension"], "central", ("xz", "yz")), (["bending_y"], "beside", ("xz",)), (["bending_x"], "beside", ("yz",))],
)
def test_symmetry_is_as_much_as_tasks_allow(motions, layout, mirror):
    found = drawn_as(target(*motions), layout, 2)
    assert found
    assert all(each.posed.body.symmetry.mirror == mirror for each in found)


@pytest.mark.parametrize("layout", ["central", "around2", "around4"])
def test_walls_on_both_sides_may_differ_where_a_body_goes_one_way(layout):
    """Loads and unlike pressures bend a symmetric body too, but its walls then stay as stiff on both sides."""
    load = {"end_effector": {"force": ["-0.2 N", "0 N", "0 N"]}}
    for motions, mirror in (
        (["shift_x"], ("xz",)),
        (["shift_x", "extension"], ("xz",)),
    ):
        for each in drawn_as(target(*motions, **load), layout, 2):
            assert each.posed.body.symmetry.mirror == mirror and each.posed.body.symmetry.rotation == 1
    both_ways = drawn_as(target("shift_x", "-shift_x", **load), layout, 2)
    assert all(len(operations(each.posed.body.symmetry)) > 1 for each in both_ways)


def test_threads_have_turns_and_are_wound_against_the_twist_that_is_asked():
    for motion, sign in (("twist", -1), ("-twist", 1)):
        found = [each.posed.body for each in drawn_as(target(motion), "threads", 3)]
        assert found
        assert all(np.sign(body.ripple.lobes) == sign for body in found)
        assert all(body.symmetry.rotation == abs(body.ripple.lobes) for body in found)


def test_what_cannot_work_is_ruled_out():
    def names(asked):
        return {layout.name for layout in suited(asked)[0]}

    assert names(target("bending_y", "bending_x")) == {"around3", "around4"}
    assert {"profile", "pneunet", "bellows"} <= names(target("bending_y"))
    assert not {"profile", "pneunet", "bellows"} & names(target("extension"))
    assert not {"pneunet", "bellows"} & names(target("bending_y", made="one piece"))
    assert "profile" in names(target("bending_y", made="one piece"))
    assert "pneunet" not in names(target("bending_y", limits={"curvature": "0.2 /mm^2"}))
    assert "around2" in names(target("bending_y", "-bending_y"))
    assert names(target("twist")) == {"threads"}
    assert names(target("twist", reinforcement=True)) == {"threads", "helix"}
    assert "wound" not in names(target("bending_y"))
    assert "wound" in names(target("bending_y", reinforcement=True))


def test_a_space_without_room_says_so():
    found = list(draw_candidates(target("bending_y", radius=3.0), 8))
    assert all(each.problem is None and each.reason for each in found)
    assert any("wall" in each.reason for each in found)


BOX = {"length": "60 mm", "width": "26 mm", "depth": "18 mm"}


@pytest.mark.parametrize(
    "name, motion, towards",
    [("profile", "bending_y", (1, 0)), ("sheet", "bending_x", (0, -1)), ("profile", "-bending_y", (-1, 0))],
)
def test_sections_keep_walls_at_both_ends_and_the_thick_one_inside_the_bend(name, motion, towards):
    asked = target(motion, space=BOX, wall=1.6, reinforcement=True)
    found = drawn_as(asked, name, 2)
    assert found
    for each in found:
        body = each.posed.body
        [chamber] = body.chamber
        start, stop = chamber.span
        outer, inner = body.outline.points, chamber.outline.points
        assert (np.abs(outer) <= np.array([13.0, 9.0]) + 1e-3).all()
        for height, size in ((start, 1.0), (stop, chamber.taper)):
            scale = 1.0 + (body.taper - 1.0) * height / body.length
            placed, around = size * inner + np.array(chamber.center), scale * body.outline.at(np.linspace(0, 1, 4000))
            assert np.linalg.norm(placed[:, None] - around, axis=2).min() >= 1.6 * (1 - 1e-3)
        placed = inner + np.array(chamber.center)
        inside = (outer @ towards).max() - (placed @ towards).max()
        outside = (placed @ towards).min() - (outer @ towards).min()
        assert inside >= outside - 0.3
        assert bool(each.posed.membrane) == (name == "sheet")


@pytest.mark.parametrize("name", ["pneunet", "bellows"])
def test_rows_fill_a_box_with_their_floor_inside_the_bend(name):
    asked = target("bending_x", space=BOX, wall=1.6)
    [first] = drawn_as(asked, name, 1)
    [again] = drawn_as(asked, name, 1)
    # The same numbers give the same file, so that a search finds its runs again.
    assert first == again
    solid = first.posed.solid
    points = solid.outline.points
    assert (points.min(axis=0) >= [-13, -9, -1e-6]).all() and (points.max(axis=0) <= [13, 9, 60 + 1e-6]).all()
    assert solid.symmetry.mirror == ("yz",) and len(solid.chamber) == 1
    low, high = solid.across(np.array([0.0, 1.0, 0.0]))[0]
    # Bending about x takes the tip to -y: there is the floor.
    assert low - points[:, 1].min() >= points[:, 1].max() - high - 1e-6


def test_chambers_start_below_the_pressure_at_which_they_would_balloon():
    soft = {"material": {"name": "Ecoflex 00-30"}, "pressure": {"max": "200 kPa"}}
    for each in draw_candidates(target("extension", **soft), 3):
        [chamber] = each.posed.body.chamber[:1]
        limit = ballooning({"body": each.posed.body.model_dump(mode="json")}, each.posed.material)
        thin = np.log(each.posed.body.radius / chamber.radius)
        assert limit <= each.posed.material.initial_shear_modulus * thin * (1 + 1e-6)
        assert all(one.start <= limit < one.max for one in each.posed.task[0].pressure.values())


def test_the_column_is_eulers():
    [one] = [each for each in draw_candidates(target("extension"), 9) if each.layout == "central"][:1]
    text = one.posed.model_dump(mode="json")
    text["body"] |= {"radius": "8 mm", "taper": 1.0, "ripple": None}
    text["body"]["chamber"] = [text["body"]["chamber"][0] | {"radius": "5 mm", "span": ["0.001 mm", "59.999 mm"]}]
    text["limits"]["wall"] = "0.0005 mm"
    problem = Problem.model_validate(text)
    euler = np.pi**2 * 3 * problem.material.initial_shear_modulus * np.pi / 4 * (8.0**4 - 5.0**4) / (4 * 60.0**2)
    assert column_load(problem) == pytest.approx(euler, rel=2e-3)


def test_a_body_that_would_buckle_is_not_tried():
    spring = {"end_effector": {"spring": {"axial": "5 N/mm"}}}
    asked = target("extension", **spring)
    strong = asked.model_copy(update={"task": Target.model_validate(stated(extension="30 mm") | spring).task})
    assert all(each.problem is not None for each in draw_candidates(asked, 2))
    for each in draw_candidates(strong, 2):
        assert each.problem is None and "column" in each.reason
    assert BUCKLED >= 1.0


def stated(**motions):
    """The tables of a target that states how far the tip is to go."""
    return target("extension").model_dump(mode="json", exclude_unset=True) | {
        "task": [{"name": "go", "objective": {"kind": "motion", **motions}}]
    }


@pytest.mark.parametrize(
    "motions, spring, key",
    [
        ({"extension": "-70 mm"}, {}, "extension"),
        ({"extension": "10 mm"}, {"axial": "1000 N/mm"}, "extension"),
        ({"twist": "30 deg"}, {"torsion": "1000 N*m/rad"}, "twist"),
        ({"extension": "10 mm"}, {"axial": "1 N/mm"}, ""),
        ({"shift_x": "20 mm"}, {}, ""),
    ],
)
def test_what_no_pressure_in_the_space_can_do_is_refused_with_its_key(motions, spring, key):
    words = impossible(Target.model_validate(stated(**motions) | {"end_effector": {"spring": spring}}))
    assert words.startswith(f"task[0].objective.{key}") if key else words == ""


@pytest.mark.parametrize(
    "motions, helping",
    [
        ({"extension": "10 mm"}, {"force": ["0 N", "0 N", "3000 N"]}),
        ({"extension": "-10 mm"}, {"moment": ["0 N*m", "90 N*m", "0 N*m"]}),
        ({"bending_y": "30 deg"}, {"moment": ["0 N*m", "90 N*m", "0 N*m"]}),
        ({"bending_y": "30 deg"}, {"force": ["3000 N", "0 N", "0 N"]}),
        ({"twist": "30 deg"}, {"moment": ["0 N*m", "0 N*m", "900 N*m"]}),
        ({"shift_x": "10 mm"}, {"force": ["9000 N", "0 N", "0 N"]}),
    ],
)
def test_a_load_that_helps_makes_a_stiff_spring_no_reason_to_refuse(motions, helping):
    spring = {"axial": "100 N/mm", "bending_y": "90 N*m/rad", "torsion": "90 N*m/rad", "shift_x": "100 N/mm"}
    alone = impossible(Target.model_validate(stated(**motions) | {"end_effector": {"spring": spring}}))
    assert "against springs and loads" in alone
    assert impossible(Target.model_validate(stated(**motions) | {"end_effector": {"spring": spring} | helping})) == ""


@pytest.mark.parametrize("motion", ["extension", "shift_x", "bending_y", "twist"])
def test_a_load_against_a_motion_is_no_help(motion):
    turns = motion in ("bending_y", "twist")
    key, at = ("moment", ["bending_x", "bending_y", "twist"]) if turns else ("force", ["shift_x", "", "extension"])
    amount = "900 N*m" if turns else "9000 N"
    load = {key: [f"-{amount}" if each == motion else "0 N*m" if turns else "0 N" for each in at]}
    words = impossible(Target.model_validate(stated(**{motion: "9 deg" if turns else "9 mm"}) | {"end_effector": load}))
    assert words.startswith(f"task[0].objective.{motion}: needs 9")


@pytest.mark.parametrize("motion, sign", [("twist", -1), ("-twist", 1)])
def test_thread_in_one_sense_is_wound_against_the_twist_that_is_asked(motion, sign):
    for each in drawn_as(target(motion, reinforcement=True), "helix", 2):
        [thread] = each.posed.fibres
        assert thread.families == 1 and np.sign(thread.winding.start) == sign
        assert each.posed.body.symmetry.rotation == 3


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (target("bending_y", radius=2.0), r"^space: no body was found .*walls of 2 mm leave no chamber"),
        (
            target("bending_y", task=[{"name": "go", "objective": {"kind": "workspace", "axes": ["x", "z"]}}]),
            r"^task\[0\]\.objective\.kind: has 1 task",
        ),
    ],
)
def test_a_target_for_which_no_body_is_found_is_refused_before_any_is_designed(tmp_path, asked, words):
    with pytest.raises(ProblemError, match=words):
        propose(asked, tmp_path, Plan(candidates=4), lambda *_: pytest.fail("nothing is designed"), 1)


S_CURVE = ((0, 0), (0, 20), (8, 40), (16, 60), (16, 80))
CURVE = {"kind": "match_curve", "sections": 4, "control_points": [[f"{x} mm", "0 mm", f"{z} mm"] for x, z in S_CURVE]}


def test_rows_of_chambers_around_the_axis_are_for_curves():
    said = suited(target("bending_y", "-bending_x"))[1]
    assert "curves and poses" in said["segments"]
    asked = target(length=80.0, radius=16.0, task=[{"name": "shape", "objective": CURVE}])
    found = drawn_as(asked, "segments", 6)
    assert {len(each.problem.body.chamber) for each in found} == {4, 6}
    for candidate in found:
        chambers = candidate.problem.body.chamber
        lower, upper = chambers[: len(chambers) // 2], chambers[len(chambers) // 2 :]
        assert [each.center for each in lower] == [each.center for each in upper]
        assert max(each.span[1] for each in lower) + asked.limits.wall <= min(each.span[0] for each in upper)
        assert set(candidate.problem.task[0].pressure) == {each.name for each in chambers}


def test_bodies_for_a_curve_are_no_more_symmetric_than_it():
    asked = target(length=80.0, radius=16.0, task=[{"name": "shape", "objective": CURVE}])
    [found] = drawn_as(asked, "central", 1)
    assert found.problem.body.symmetry.mirror == ("xz",)
