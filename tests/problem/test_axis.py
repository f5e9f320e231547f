"""Axes of arcs: where cross-sections are, the tubes that start along them, and what does not go together with them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube import build_design_space, build_linings, enclosed_volume, starting_body
from pneumorph.problem import Problem
from pneumorph.problem.axis import Arc, Axis

ARC = [{"length": "60 mm", "bend": "90 deg"}]
HOOK = [{"length": "20 mm"}, {"length": "30 mm", "bend": "80 deg", "towards": "90 deg"},
        {"length": "25 mm", "bend": "60 deg", "towards": "200 deg"}]  # fmt: skip
CHAMBER = {"name": "A", "radius": "4 mm", "center": ["1 mm", "0 mm"], "span": ["5 mm", "55 mm"]}


def table(axis=ARC, chamber=CHAMBER, limits=None, task=None, **body):
    return {
        "material": {"name": "Dragon Skin 20"},
        "body": {"radius": "8 mm", "axis": axis, "control_density": "0.5 /mm", "chamber": [chamber]} | body,
        "limits": limits or {},
        "task": [{"name": "bend", "pressure": {}, "objective": {"motion": "bending_y"}} | (task or {})],
    }


def tubes(**keys):
    return Problem.model_validate(table(**keys)).tubes


pieces = st.builds(
    lambda length, bend, towards: Arc.model_construct(length=length, bend=bend, towards=towards),
    st.floats(1.0, 50.0),
    st.one_of(st.just(0.0), st.floats(1e-6, 3.0)),
    st.floats(-7.0, 7.0),
)


@given(st.lists(pieces, min_size=1, max_size=4), st.floats(0.01, 0.99))
@settings(max_examples=50, deadline=None)
def test_an_axis_is_as_long_as_its_arcs_and_its_cross_sections_lie_across_it(arcs, share):
    axis = Axis(arcs)
    at, step = share * axis.length, 1e-5 * axis.length
    joints = np.cumsum([arc.length for arc in arcs])
    places, turns = axis.at([at - step, at, at + step])
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.tile(np.eye(3), (3, 1, 1)), atol=1e-12)
    if np.abs(joints - at).min() > 2 * step:
        along = (places[2] - places[0]) / (2 * step)
        np.testing.assert_allclose(along, turns[1, :, 2], atol=1e-5)
        # Carried along, a cross-section does not turn about the axis.
        change = (turns[2] - turns[0]) / (2 * step)
        assert abs(change[:, 0] @ turns[1, :, 1]) < 1e-5


@given(st.lists(pieces, min_size=1, max_size=3), st.floats(0.02, 0.98), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
@settings(max_examples=50, deadline=None)
def test_a_place_has_the_coordinates_that_it_was_made_of(arcs, share, x, y):
    axis = Axis(arcs)
    length = share * axis.length
    (place,), (turn,) = axis.at([length])
    found = np.array(list(axis.coordinates(place + turn @ [x, y, 0.0])))
    assert np.abs(found - [x, y, length]).max(axis=1).min() < 1e-6 * axis.length


def test_a_torus_piece_has_its_volume_and_lengths():
    body = starting_body(tubes())
    # By Pappus' theorem: the area times the way of its centroid, which for the chamber is shorter by 1 mm times 90°.
    assert enclosed_volume(body.exterior) == pytest.approx(math.pi * 64 * 60, rel=1e-6)
    assert enclosed_volume(body.chambers[0]) == pytest.approx(math.pi * 16 * 50 * (1 - math.radians(90) / 60), rel=1e-6)
    r = np.linspace(0.0, 1.0, 2001)
    inside, outside = (body.exterior.sample(np.array([q]), r)[:, 0] for q in (0.0, 0.5))
    for line, length in ((inside, 60 - 8 * math.pi / 2), (outside, 60 + 8 * math.pi / 2)):
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(length, rel=1e-5)
    (x, y, z), radius = body.exterior.end_centres[1], 60 / (math.pi / 2)
    assert (x, y, z) == pytest.approx((radius, 0.0, radius), abs=1e-9)


def test_other_sections_and_tapers_follow_the_axis():
    oblong = {"kind": "rectangle", "width": "14 mm", "depth": "20 mm", "corner": "3 mm"}
    body = {"section": oblong, "taper": 0.8, "axis": HOOK, "control_density": "0.5 /mm", "chamber": [CHAMBER]}
    spec = Problem.model_validate(table() | {"body": body}).tubes
    # Its centroid is on the axis.
    assert enclosed_volume(starting_body(spec).exterior) == pytest.approx(spec.area * spec.length, rel=3e-3)


@pytest.mark.parametrize("ends", ["flat", "pole"])
def test_tubes_along_several_arcs_end_across_them(ends):
    spec = tubes(axis=HOOK, chamber=CHAMBER | {"ends": ends, "span": ["5 mm", "70 mm"]})
    assert spec.length == pytest.approx(75.0)
    body = starting_body(spec)
    assert enclosed_volume(body.exterior) == pytest.approx(math.pi * 64 * 75, rel=1e-4)
    _, turns = spec.bent.at([0.0, 75.0, 5.0, 70.0])
    for surface, (base, tip) in zip(body.surfaces, ((0, 1), (2, 3)), strict=True):
        for row, beside, turn in ((0, 1, base), (-1, -2, tip)):
            across = surface.net[[row, beside]] @ turns[turn][:, 2]
            flat = across if any(surface.poles) else across[:1]
            assert np.ptp(flat) < 1e-9


@pytest.mark.parametrize(("ends", "mirror"), [("flat", []), ("pole", []), ("flat", ["xz"]), ("pole", ["xz"])])
def test_designs_keep_the_planes_of_their_ends(ends, mirror):
    axis = ARC if mirror else HOOK
    chamber = CHAMBER | {"ends": ends}
    problem = Problem.model_validate(table(axis=axis, chamber=chamber, symmetry={"mirror": mirror}))
    body = starting_body(problem.tubes)
    space = build_design_space(problem, body)
    assert np.abs(space.control_points(space.start) - body.control_points()).max() < 1e-6
    moved = space.body(space.start + np.random.default_rng(0).uniform(-0.2, 0.2, space.n))
    for surface, start in zip(moved.surfaces, body.surfaces, strict=True):
        for row, beside, direction in ((0, 1, surface.directions[0]), (-1, -2, surface.directions[1])):
            rows = [row] if not any(surface.poles) else [row, beside]
            heights = surface.net[rows] @ direction
            assert np.ptp(heights) < 1e-9
            assert surface.cavity or abs(heights[0, 0] - start.net[row, 0] @ direction) < 1e-9
    if mirror:
        net = moved.exterior.net
        np.testing.assert_allclose(net[:, -np.arange(net.shape[1])] * [1.0, -1.0, 1.0], net, atol=1e-9)


def test_a_layer_lies_as_deep_along_a_bent_axis():
    rubber = {"name": "Dragon Skin 30"}
    layer = {"name": "skin", "material": rubber, "layer": {"thickness": "1 mm"}}
    problem = Problem.model_validate(table(limits={"wall": "2.5 mm"}) | {"region": [layer]})
    (lining,) = build_linings(problem.tubes, problem.region)
    exterior = starting_body(problem.tubes).exterior
    copy = exterior.with_control_points(lining.offset.reshape(-1, 3)).sample([0.1, 0.6], [0.2, 0.7])
    np.testing.assert_allclose(np.linalg.norm(copy, axis=2), 1.0, rtol=1e-3)


U_TURN = [{"length": "60 mm", "bend": "200 deg"}]
SECTIONS = {"kind": "match_curve", "control_points": [["0 mm", "0 mm", f"{z} mm"] for z in (0, 10, 20, 30)]}


@pytest.mark.parametrize(
    ("key", "said", "changed"),
    [
        ("body.length", "60", {"length": "70 mm"}),
        ("body.axis[0].length", "missing", {"axis": [{"bend": "90 deg"}]}),
        ("body.axis", "shorter", {"axis": [{"length": "60 mm", "bend": "400 deg"}]}),
        ("body.axis", "crosses the plane", {"axis": U_TURN, "radius": "5 mm", "chamber": CHAMBER | {"radius": "2 mm"}}),
        ("body.symmetry", "axis", {"symmetry": {"mirror": ["yz"]}}),
        ("body.symmetry", "axis", {"symmetry": {"rotation": 2}, "chamber": CHAMBER | {"center": ["0 mm", "0 mm"]}}),
        ("body.chamber[0].span", "at an end", {"chamber": CHAMBER | {"span": ["3 mm", "57.4 mm"]},
                                               "limits": {"wall": "2.5 mm"}}),
        ("region[0].beyond", "straight",
         {"region": [{"name": "hard", "material": {"name": "Dragon Skin 30"}, "beyond": "30 mm"}]}),
        ("task[0].objective.sections", "straight", {"task": {"objective": SECTIONS}}),
        ("end_effector.kind", "plate",
         {"axis": [{"length": "100 mm", "bend": "180 deg"}], "end_effector": {"kind": "free"}}),
        ("limits.envelope", "tip", {"limits": {"envelope": {"radius": "12 mm"}}}),
        ("limits.curvature", "exterior",
         {"axis": [{"length": "34 mm", "bend": "150 deg"}], "chamber": CHAMBER | {"span": ["5 mm", "29 mm"]},
          "limits": {"curvature": "0.008 /mm^2"}}),
        ("obstacle[0].center", "rubber",
         {"obstacle": [{"name": "ball", "kind": "sphere", "center": ["31 mm", "0 mm", "31 mm"], "radius": "1 mm"}]}),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_its_key(key, said, changed):
    whole = {name: changed.pop(name) for name in ("region", "end_effector", "obstacle") if name in changed}
    with pytest.raises(ProblemError) as refused:
        Problem.model_validate(table(**changed) | whole)
    assert key in str(refused.value) and said in str(refused.value)


def test_a_straight_axis_is_none():
    problem = Problem.model_validate(
        table(axis=[{"length": "40 mm"}, {"length": "20 mm"}], symmetry={"mirror": ["xy"]})
    )
    plain = Problem.model_validate(table(axis=None, length="60 mm"))
    nets = [starting_body(each.tubes).exterior.net for each in (problem, plain)]
    np.testing.assert_array_equal(*nets)
    again = Problem.model_validate(problem.model_dump(exclude_none=True))
    assert again.tubes == problem.tubes
