"""Cross-sections other than circles: their outlines, what is refused, and the tubes that start from them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube import build_covers, build_design_space, enclosed_volume, starting_body
from pneumorph.problem import Problem
from pneumorph.problem.section import Section

RECTANGLE = {"kind": "rectangle", "width": "20 mm", "depth": "26 mm", "corner": "4 mm"}
CHAMBER = {"name": "A", "radius": "4 mm", "center": ["1 mm", "0 mm"], "span": ["5 mm", "55 mm"]}


def outline(**table):
    return TypeAdapter(Section).validate_python(table).outline


def table(chamber=CHAMBER, **body):
    chambers = chamber if isinstance(chamber, list) else [chamber]
    return {
        "material": {"name": "Dragon Skin 20"},
        "body": {"length": "60 mm", "section": RECTANGLE, "control_density": "0.5 /mm", "chamber": chambers} | body,
        "task": [{"name": "extend", "pressure": {}, "objective": {"motion": "extension"}}],
    }


def without_radius(**chamber):
    return {key: value for key, value in (CHAMBER | chamber).items() if key != "radius"}


CORNERS = {
    "rectangle": ({"width": "20 mm", "depth": "10 mm"}, [(10, -5), (10, 5), (-10, 5), (-10, -5)]),
    "polygon": (
        {"sides": 6, "inner_radius": "9 mm"},
        [(18 / 3**0.5 * math.cos(k * math.pi / 3), 18 / 3**0.5 * math.sin(k * math.pi / 3)) for k in range(6)],
    ),
    "points": ({"points": [["-5 mm", "-4 mm"], ["0 mm", "8 mm"], ["5 mm", "-4 mm"]]}, [(-5, -4), (5, -4), (0, 8)]),
}


@pytest.mark.parametrize("kind", CORNERS)
@given(corner=st.floats(0.1, 2.0))
@settings(max_examples=10, deadline=None)
def test_rounded_polygons_have_their_area_length_and_curvature(kind, corner):
    keys, corners = CORNERS[kind]
    points = np.array(corners, float)
    sides = np.roll(points, -1, axis=0) - points
    before = np.roll(sides, 1, axis=0)
    turns = np.arccos((sides * before).sum(1) / np.linalg.norm(sides, axis=1) / np.linalg.norm(before, axis=1))
    cut = np.tan(turns / 2).sum()
    area = 0.5 * (points[:, 0] * np.roll(points[:, 1], -1) - points[:, 1] * np.roll(points[:, 0], -1)).sum()
    found = outline(kind=kind, corner=f"{corner} mm", **keys)
    assert found.area == pytest.approx(area - (cut - math.pi) * corner**2, rel=1e-4)
    length = np.linalg.norm(sides, axis=1).sum() - 2 * (cut - math.pi) * corner
    assert found.length == pytest.approx(length, rel=1e-4)
    assert found.curvature == pytest.approx(1 / corner, rel=1e-3)


def test_an_ellipse_and_half_a_disc():
    ellipse = outline(kind="ellipse", width="20 mm", depth="10 mm")
    assert ellipse.area == pytest.approx(50 * math.pi, rel=1e-4)
    assert ellipse.curvature == pytest.approx(10 / 25, rel=1e-3)
    half = outline(kind="half-round", round_radius="10 mm", corner="0.001 mm")
    assert half.area == pytest.approx(50 * math.pi, rel=1e-3)
    assert half.points[:, 0].min() == pytest.approx(-40 / (3 * math.pi), rel=1e-3)  # the flat side, from the centroid
    assert half.reach == pytest.approx(math.hypot(10, 40 / (3 * math.pi)), rel=1e-3)


def test_tubes_have_the_volumes_of_their_sections():
    problem = Problem.model_validate(table(taper=0.7))
    body = starting_body(problem.tubes)
    area = outline(**RECTANGLE).area
    assert enclosed_volume(body.exterior) == pytest.approx(60 * area * (1 + 0.7 + 0.49) / 3, rel=2e-3)
    assert problem.body.area == pytest.approx(area * (1 + 0.7 + 0.49) / 3)


def test_an_ellipse_of_equal_axes_is_a_cylinder():
    circle = Problem.model_validate(table(section=None, radius="10 mm"))
    ellipse = Problem.model_validate(table(section={"kind": "ellipse", "width": "20 mm", "depth": "20 mm"}))
    nets = [starting_body(each.tubes).exterior.net for each in (circle, ellipse)]
    assert np.abs(nets[0] - nets[1]).max() < 1e-3


def test_a_dome_on_a_section_closes_in_a_point():
    oval = {"kind": "ellipse", "width": "10 mm", "depth": "6 mm"}
    chamber = without_radius(section=oval, ends="pole")
    surface = starting_body(Problem.model_validate(table(chamber)).body).chambers[0]
    points = surface.sample(np.arange(40) / 40, [0.0, 0.5, 1.0]) - [1.0, 0.0, 0.0]
    assert np.ptp(points[[0, 2]], axis=1).max() < 1e-9
    # Its ends are rounded off a little, so that they are bent no more than those of the ellipse.
    assert np.abs(points[1, :, 0]).max() == pytest.approx(5.0, rel=6e-3)
    assert np.abs(points[1, :, 1]).max() == pytest.approx(3.0, rel=6e-3)


@pytest.mark.parametrize(
    ("symmetry", "section", "chamber"),
    [
        ({"mirror": ["xz"]}, {"kind": "half-round", "round_radius": "14 mm", "corner": "3 mm"}, CHAMBER),
        ({"mirror": ["yz"]}, {"kind": "half-round", "round_radius": "14 mm", "corner": "3 mm", "turn": "90 deg"},
         CHAMBER | {"center": ["0 mm", "1 mm"]}),
        ({"mirror": ["xz", "yz", "xy"]}, RECTANGLE, CHAMBER | {"center": ["0 mm", "0 mm"]}),
        ({"rotation": 3}, {"kind": "polygon", "sides": 6, "inner_radius": "14 mm", "corner": "3 mm"},
         without_radius(center=["7 mm", "1 mm"], copies=3,
                        section={"kind": "ellipse", "width": "4 mm", "depth": "8 mm", "turn": "20 deg"})),
    ],
)  # fmt: skip
def test_symmetric_sections_have_symmetric_control_points(symmetry, section, chamber):
    problem = Problem.model_validate(table(chamber, section=section, symmetry=symmetry, control_density="0.6 /mm"))
    body = starting_body(problem.tubes)
    space = build_design_space(problem, body)
    assert np.abs(space.control_points(space.start) - body.control_points()).max() < 1e-6


def test_angles_around_a_section_are_directions_from_its_axis():
    half = {"kind": "half-round", "round_radius": "12 mm", "corner": "2 mm"}
    sheet = {"name": "cloth", "stiffness": "10 N/mm", "angles": ["120 deg", "240 deg"]}
    problem = Problem.model_validate(table(section=half) | {"membrane": [sheet]})
    (cover,) = build_covers(problem.tubes, problem.membrane)
    exterior = starting_body(problem.tubes).exterior
    assert cover.q is not None
    ends = exterior.points(np.array(cover.q) % 1.0, np.full(2, 0.5))
    assert np.degrees(np.arctan2(ends[:, 1], ends[:, 0])) % 360 == pytest.approx([120, 240], abs=0.5)


@pytest.mark.parametrize(
    ("key", "said", "changed"),
    [
        ("body.section.kind", "half-round", {"section": {"kind": "square"}}),
        ("body.section.corner", "10", {"section": RECTANGLE | {"corner": "11 mm"}}),
        ("body.radius", "14.8", {"radius": "12 mm"}),
        ("body.section.points", "cross",
         {"section": {"kind": "points", "corner": "1 mm",
                      "points": [["-9 mm", "-9 mm"], ["9 mm", "9 mm"], ["9 mm", "-9 mm"], ["-9 mm", "9 mm"]]}}),
        ("body.section.points", "surround",
         {"section": {"kind": "points", "corner": "1 mm",
                      "points": [["5 mm", "-9 mm"], ["20 mm", "-9 mm"], ["20 mm", "9 mm"], ["5 mm", "9 mm"]]}}),
        ("body.chamber[0].center", "outside",
         {"chamber": [without_radius(section={"kind": "ellipse", "width": "8 mm", "depth": "27 mm"})]}),
        ("body.section", "image", {"symmetry": {"mirror": ["xz"]}, "section": RECTANGLE | {"turn": "20 deg"}}),
        ("body.taper", "symmetry", {"symmetry": {"mirror": ["xy"]}, "taper": 0.8}),
        ("limits.curvature", "exterior", {"section": RECTANGLE | {"corner": "0.3 mm"}}),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_its_key(key, said, changed):
    with pytest.raises(ProblemError) as caught:
        Problem.model_validate(table(**changed))
    faults = [line.partition(": ") for line in caught.value.faults]
    assert any(where == key and said in reason for where, _, reason in faults), faults


def test_two_narrow_chambers_may_lie_side_by_side():
    slot = {"kind": "rectangle", "width": "3 mm", "depth": "16 mm", "corner": "1.4 mm"}
    both = [without_radius(name=name, section=slot, center=[f"{x} mm", "0 mm"]) for name, x in (("A", 4), ("B", -4))]
    assert len(Problem.model_validate(table(both)).body.chamber) == 2
