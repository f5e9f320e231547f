"""Symmetric design spaces: exactly symmetric bodies for any variables, and nothing symmetric left out."""

import json
import re

import numpy as np
import pytest
from scipy.spatial import KDTree

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.problem import Problem
from pneumorph.problem.body import Symmetry
from pneumorph.problem.columns import adjusted_columns, columns_multiple
from pneumorph.symmetry.operations import operations

ONE = [{"center": ["0 mm", "0 mm"], "span": ["3 mm", "37 mm"], "radius": "4 mm"}]
POLE = [{"center": ["0 mm", "0 mm"], "span": ["3 mm", "37 mm"], "radius": "3 mm", "ends": "pole"}]
FOUR = [
    {"center": [f"{x} mm", f"{y} mm"], "span": ["3 mm", "37 mm"], "radius": "2 mm"}
    for x, y in ((4, 4), (-4, 4), (-4, -4), (4, -4))
]
THREE = [
    {"center": [f"{4.5 * np.cos(a)} mm", f"{4.5 * np.sin(a)} mm"], "span": ["3 mm", "37 mm"], "radius": "1.5 mm"}
    for a in 2 * np.pi * np.arange(3) / 3
]


def problem(symmetry, chambers=ONE, radius=9.0, lobes=0, motion="extension", pressure=None):
    named = [{"name": name} | chamber for name, chamber in zip("ABCD", chambers, strict=False)]
    return Problem.model_validate(
        {
            "material": {"name": "Hei-Cast 8400"},
            "body": {
                "length": "40 mm",
                "radius": f"{radius} mm",
                "control_density": "0.4 /mm",
                "ripple": {"amplitude": "0.1 mm", "period": "10 mm", "lobes": lobes},
                "symmetry": symmetry,
                "chamber": named,
            },
            "task": [
                {
                    "name": "one",
                    "pressure": pressure or {"A": "60 kPa"},
                    "objective": {"kind": "maximize", "motion": motion},
                }
            ],
        }
    )


CASES = [
    ({"mirror": ["xz"]}, ONE, 2),
    ({"mirror": ["xz", "yz"]}, FOUR, 4),
    ({"mirror": ["xz", "yz", "xy"]}, ONE, 8),
    ({"rotation": 3, "point": True}, ONE, 6),
    ({"rotation": 3}, THREE, 3),
    ({"rotation": 5, "mirror": ["xz"]}, POLE, 10),
    ({"point": True}, POLE, 2),
]


@pytest.mark.parametrize(("symmetry", "chambers", "order"), CASES)
def test_every_design_is_exactly_symmetric(symmetry, chambers, order):
    asked = problem(symmetry, chambers)
    group = operations(asked.body.symmetry)
    assert len(group) == order
    space = build_design_space(asked, starting_body(asked.tubes))
    phi = space.start + 0.3 * np.random.default_rng(0).normal(size=space.n)
    body = space.body(phi)
    centre = np.array([0.0, 0.0, 20.0])
    points = body.control_points()
    for matrix in group:
        distance, _ = KDTree(points).query((points - centre) @ matrix.T + centre)
        assert distance.max() < 1e-12


@pytest.mark.parametrize(("symmetry", "chambers", "order"), CASES)
def test_nothing_symmetric_is_left_out(symmetry, chambers, order):
    asked = problem(symmetry, chambers)
    space = build_design_space(asked, starting_body(asked.tubes))
    plain = build_design_space(problem({}, chambers), starting_body(asked.tubes))
    np.testing.assert_allclose(space.control_points(space.start), plain.control_points(plain.start), atol=1e-9)
    # The group's mean over an orbit of any change is symmetric; so the independent entries are its rank.
    assert space.n_shape >= plain.n_shape / order - 1e-9
    assert space.lower.shape == space.upper.shape == space.start.shape
    gram = (space.L.T @ space.L).toarray()
    np.testing.assert_allclose(gram, np.diag(np.diag(gram)), atol=1e-12)
    assert np.abs(np.diag(gram)).min() >= 1.0 - 1e-12
    # No control point moves farther than its variables do together.
    reach = np.sqrt(np.asarray(space.L.power(2).sum(axis=1)).reshape(-1, 3))
    assert reach.max() <= 1.0 + 1e-9


@pytest.mark.parametrize(("symmetry", "chambers", "order"), CASES)
def test_pullback_is_the_exact_transpose(symmetry, chambers, order):
    asked = problem(symmetry, chambers)
    space = build_design_space(asked, starting_body(asked.tubes))
    rng = np.random.default_rng(1)
    dphi, dP = rng.normal(size=space.n), rng.normal(size=(space.reference.n_points, 3))
    moved = space.control_points(space.start + dphi) - space.control_points(space.start)
    assert space.pullback(dP) @ dphi == pytest.approx(float(np.sum(dP * moved)), rel=1e-10)


def test_a_helix_keeps_rotation_and_half_turn():
    asked = problem({"rotation": 3, "half_turn": "x"}, lobes=3)
    group = operations(asked.body.symmetry)
    assert len(group) == 6
    space = build_design_space(asked, starting_body(asked.tubes))
    body = space.body(space.start)
    np.testing.assert_allclose(body.control_points(), starting_body(asked.tubes).control_points(), atol=1e-9)
    radius = np.hypot(*np.moveaxis(body.exterior.sample(np.arange(48) / 48, [0.5])[0, :, :2], -1, 0))
    assert np.ptp(radius) == pytest.approx(0.2, rel=0.15)
    assert np.argmax(radius) % 16 == 0


def faults(*args, **options):
    """Key and reason of what a problem is refused for; empty if it is not."""
    try:
        problem(*args, **options)
    except ProblemError as error:
        return [str(error).split(": ", 1)]
    return []


@pytest.mark.parametrize(
    ("symmetry", "options", "key"),
    [
        ({"point": True}, {"motion": "twist"}, "task[0].objective.motion"),
        ({"mirror": ["yz"]}, {"motion": "-twist"}, "task[0].objective.motion"),
        ({"mirror": ["xz"]}, {"lobes": 3}, "body.ripple.lobes"),
        ({"rotation": 3}, {"lobes": 4}, "body.ripple.lobes"),
        ({"half_turn": "y"}, {"lobes": 3}, "body.ripple.lobes"),
    ],
)
def test_symmetries_that_leave_nothing_to_find_are_refused(symmetry, options, key):
    assert [found for found, _ in faults(symmetry, **options)] == [key]


FREE = {"start": "30 kPa", "min": "0 kPa", "max": "60 kPa"}
BOTH = {"mirror": ["xz", "yz"]}


@pytest.mark.parametrize(
    ("symmetry", "chambers", "pressure", "allowed"),
    [
        (BOTH, FOUR, dict.fromkeys("ABCD", FREE), True),
        (BOTH, FOUR, {"A": "60 kPa", "C": "60 kPa"}, True),
        (BOTH, FOUR, dict.fromkeys("ABCD", "60 kPa"), False),
        # B is as A and C as D: still its own image across yz.
        (BOTH, FOUR, {"A": "60 kPa", "B": "60 kPa"}, False),
        ({"mirror": ["yz"]}, FOUR, {"A": FREE, "B": FREE, "C": "60 kPa", "D": "60 kPa"}, True),
        ({"mirror": ["yz"]}, FOUR, {"A": "60 kPa", "B": "60 kPa", "C": "20 kPa", "D": "20 kPa"}, False),
        ({"mirror": ["yz"]}, ONE, {"A": FREE}, False),
    ],
)
def test_a_mirrored_body_twists_under_pressures_that_are_not(symmetry, chambers, pressure, allowed):
    found = faults(symmetry, chambers, radius=10.0, motion="twist", pressure=pressure)
    assert [key for key, _ in found] == ([] if allowed else ["task[0].objective.motion"])


def rippled(*lobes, amplitude="0.1 mm"):
    ripples = [{"amplitude": amplitude, "period": "10 mm", "lobes": count} for count in lobes]
    return [chamber | {"ripple": ripple} for chamber, ripple in zip(FOUR, ripples, strict=True)]


def test_helices_of_chambers_wind_the_other_way_across_a_mirror():
    asked = problem(BOTH, rippled(2, -2, 2, -2, amplitude="0.3 mm"), radius=10.0)
    body = starting_body(asked.tubes)
    space = build_design_space(asked, body)
    np.testing.assert_allclose(space.control_points(space.start), body.control_points(), atol=1e-9)
    # They are helices: at one height the radius goes up and down twice on the way round.
    a, b = (chamber.sample(np.arange(48) / 48, [0.4])[0] for chamber in body.chambers[:2])
    radius = np.hypot(*(a - a.mean(axis=0))[:, :2].T)
    assert np.argmax(np.abs(np.fft.rfft(radius - radius.mean()))) == 2 and np.ptp(radius) > 0.3
    distance, _ = KDTree(b).query(a * [-1.0, 1.0, 1.0])
    assert distance.max() < 1e-9


@pytest.mark.parametrize("lobes", [(2, 2, 2, 2), (2, -2, -2, 2), (1, -1, 1, -1), (2, -2, 2, 0)])
def test_other_helices_are_no_images(lobes):
    ((key, reason), *_) = faults(BOTH, rippled(*lobes), radius=10.0)
    assert key.startswith("body.chamber[") and key.endswith("].ripple") and "is not the image of that of" in reason


def test_control_points_around_are_made_to_fit_and_it_is_said():
    asked = problem({"rotation": 5})
    assert columns_multiple(asked.body.symmetry) == 5
    body = starting_body(asked.tubes)
    assert [surface.net.shape[1] % 5 for surface in body.surfaces] == [0, 0]
    said = adjusted_columns(asked.body)
    assert said[0].startswith("the exterior has 25 control points around instead of 23: the symmetry needs a")
    assert adjusted_columns(problem({}).body) == []
    assert columns_multiple(Symmetry.model_validate({"mirror": ["xz", "yz"]})) == 2


def test_a_chamber_without_its_image_is_refused():
    ((key, reason), *_) = faults({"mirror": ["xz", "yz"]}, [FOUR[0], FOUR[3]])
    assert key == "body.chamber[0]"
    assert reason.startswith('"A" has no image under body.symmetry; put one like it at center = ["-4 mm", "4 mm"]')


def round_about(*chambers, **symmetry):
    """A problem of chambers of 1.5 mm in a body of 9 mm."""
    return problem(symmetry, [{"span": ["3 mm", "37 mm"], "radius": "1.5 mm"} | each for each in chambers])


def test_the_place_that_a_refusal_names_is_accepted_as_it_is_written():
    """Numbers in the sentence are rounded, and so are those in a file."""
    chambers = [{"center": ["6 mm", "0 mm"]}]
    with pytest.raises(ProblemError) as caught:
        round_about(*chambers, rotation=3)
    assert len(caught.value.faults) == 2 and all("or give it copies = 3" in fault for fault in caught.value.faults)
    for fault in caught.value.faults:
        center, span = re.findall(r"(?:center|span) = (\[[^]]*\])", fault)
        chambers.append({"center": json.loads(center), "span": json.loads(span)})
    assert chambers[1]["center"] == ["-3 mm", "5.19615 mm"]
    asked = round_about(*chambers, rotation=3)
    space = build_design_space(asked, starting_body(asked.tubes))
    points = space.body(space.start).control_points()
    for matrix in operations(asked.body.symmetry):
        assert KDTree(points).query(points @ matrix.T)[0].max() < 1e-9


def test_chambers_near_their_images_are_moved_to_them():
    asked = round_about({"center": ["5.004 mm", "0.003 mm"]}, {"center": ["-5 mm", "0 mm"]}, mirror=["xz", "yz"])
    assert [chamber.center for chamber in asked.body.chamber] == [(5.002, 0.0), (-5.002, 0.0)]
    exact = round_about({"center": ["5 mm", "0 mm"]}, {"center": ["-5 mm", "0 mm"]}, mirror=["xz", "yz"])
    assert [chamber.center for chamber in exact.body.chamber] == [(5.0, 0.0), (-5.0, 0.0)]
    with pytest.raises(ProblemError, match="has no image"):
        round_about({"center": ["5.02 mm", "0 mm"]}, {"center": ["-5 mm", "0 mm"]}, mirror=["yz"])


def test_copies_stand_around_the_axis():
    body = problem({"rotation": 3}, [THREE[0] | {"copies": 3}], pressure={"A2": "60 kPa"}).body
    assert [chamber.name for chamber in body.chamber] == ["A1", "A2", "A3"]
    np.testing.assert_allclose(
        [chamber.center for chamber in body.chamber],
        [problem({}, THREE).body.chamber[k].center for k in range(3)],
        atol=1e-12,
    )
    written = problem({}, [THREE[0] | {"copies": 3}], pressure={"A1": "60 kPa"})
    assert Problem.model_validate(written.model_dump()) == written


def test_copies_on_the_axis_are_refused():
    assert faults({}, [ONE[0] | {"copies": 2}])[0] == [
        "body.chamber[0].copies", "would all be in one place; move center away from the body's axis"
    ]  # fmt: skip
