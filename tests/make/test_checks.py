"""The checks pass on sound files and fail on every other."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.geometry.tube import starting_body
from pneumorph.problem import Problem

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")


def failing(checks):
    return [check.what for check in checks if not check.passed]


def test_everything_of_a_body(body, tmp_path):
    made = make.make(body, tmp_path / "deep" / "folder", chord=0.05)
    assert not made.failed
    cores = [f"chamber_{chamber.name}.step" for chamber in body.chambers]
    assert [path.name for path in made.files] == ["body.step", *cores, "body.3mf", "body.stl", "checks.json"]
    assert all(path.stat().st_size for path in made.files)
    written = json.loads(made.files[-1].read_text(encoding="utf-8"))["checks"]
    assert {check["file"] for check in written} == {"body.step", *cores, "body.3mf", "body.stl"}
    assert all(check["passed"] and check["value"] <= check["limit"] for check in written)
    volumes = [check["value"] for check in written if "relative" in check["what"]]
    assert max(volumes) < 1e-8
    again = make.make(body, tmp_path / "deep" / "folder", chord=0.05)
    assert again.files == made.files


def test_another_design_is_told(bodies, tmp_path):
    body = bodies("flat")
    path = tmp_path / "body.step"
    make.write_body_step(body, path)
    net = body.exterior.net.copy()
    net[5, 3, 0] += 1e-4
    assert failing(make.check_step(path, [replace(body.exterior, net=net), *body.chambers])) == [
        "distance of the design's points from the surfaces"
    ]
    net[5] *= [1.01, 1.01, 1.0]
    assert len(failing(make.check_step(path, [replace(body.exterior, net=net), *body.chambers]))) == 2


def test_an_end_elsewhere_is_told(bodies, tmp_path):
    """The disc of an end is a plane of its own, which no sampled patch sees."""
    body = bodies("several")
    path = tmp_path / "body.step"
    make.write_body_step(body, path)
    (left, *others) = body.chambers
    lower = replace(left, net=left.net - np.array([0.0, 0.0, 1e-4]))
    assert failing(make.check_step(path, [body.exterior, lower, *others])) == [
        "distance of the design's points from the surfaces"
    ]


def test_a_chamber_that_is_not_there_is_told(bodies, tmp_path):
    body = bodies("flat")
    make.write_body_step(Body(body.exterior, ()), tmp_path / "body.step")
    assert failing(make.check_step(tmp_path / "body.step", body.surfaces)) == ["open, missing or surplus shells"]


def test_chambers_out_of_place_are_told(bodies, tmp_path):
    body = bodies("several")
    left = body.chambers[0]
    inner = replace(left, net=0.5 * (left.net + np.array([-4.0, 0.0, 15.0])))
    for net, files in (
        (left.net + np.array([40.0, 0.0, 0.0]), {"body.step"}),
        (left.net + np.array([1.0, 0.0, 0.0]), {"body.3mf", "body.stl"}),
        (inner.net, {"body.step"}),
    ):
        wrong = Body(body.exterior, (left, replace(left, name="wrong", net=net)))
        assert {check.file for check in make.make(wrong, tmp_path, chord=0.1).failed} == files


@pytest.mark.parametrize("form", ["3mf", "stl"])
def test_triangles_that_are_amiss_are_told(bodies, tmp_path, form):
    body = bodies("flat")
    part, path = make.triangulate(body.surfaces, 0.05), tmp_path / f"body.{form}"

    def written(part):
        if form == "stl":
            make.write_stl(path, part)
        else:
            make.write_3mf(path, {"body": part})
        return failing(make.check_mesh(path, body.surfaces, 0.05))

    assert written(part) == []
    assert written(make.triangulate(body.surfaces, 0.3)) == ["chord error"]
    assert written(make.Triangles(part.points, part.corners[1:])) == ["open or inconsistently oriented edges"]
    assert written(make.Triangles(part.points, part.corners[:, ::-1])) == ["volume error"]


def test_results_computed_by_numpy_can_be_stored():
    check = make.Check("core-A", "deflection", np.float64(0.1), 0.2)
    assert json.loads(json.dumps({"value": check.value, "passed": check.passed})) == {"value": 0.1, "passed": True}


@pytest.mark.parametrize("ends", ["flat", "pole"])
def test_files_of_a_body_with_a_bent_axis_pass_and_it_gets_no_mould(ends, tmp_path):
    chamber = {"name": "A", "radius": "4 mm", "center": ["1 mm", "0 mm"], "span": ["4 mm", "36 mm"], "ends": ends}
    axis = [{"length": "10 mm"}, {"length": "30 mm", "bend": "100 deg", "towards": "40 deg"}]
    problem = Problem.model_validate(
        {
            "material": {"name": "Dragon Skin 20"},
            "body": {"radius": "8 mm", "axis": axis, "control_density": "0.4 /mm", "chamber": [chamber]},
            "task": [{"name": "bend", "pressure": {}, "objective": {"motion": "bending_y"}}],
        }
    )
    body = starting_body(problem.tubes)
    made = make.make(body, tmp_path / "alone", chord=0.1)
    assert made.checks and not made.failed
    with pytest.raises(ComputationError, match="straight axis"):
        make.make(body, tmp_path / "mould", chord=0.1, problem=problem)
    assert (tmp_path / "mould" / "body.step").is_file()
