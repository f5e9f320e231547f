"""Pictures of a tiny run, and the numbers behind them."""

import json

import matplotlib.image
import numpy as np
import pytest
from tiny import tiny

from pneumorph.geometry import design_space, starting_body
from pneumorph.mesh import mesh_body
from pneumorph.optimize import checkpoint
from pneumorph.optimize.analysis import analyse, discretise
from pneumorph.output import render, run_pictures
from pneumorph.output.bodies import nodal_stretch
from pneumorph.output.profile import radius_along_z
from pneumorph.output.section import cut_open
from pneumorph.output.view import Job, Shape, View
from pneumorph.output.words import duration, motion_of, pressures
from pneumorph.problem import loads
from pneumorph.run import Design, create


@pytest.fixture(scope="module")
def problem():
    return loads(tiny(title='""', objective='{ kind = "maximize", motion = "-bending_y" }').replace("extend", "bend"))


@pytest.fixture(scope="module")
def body(problem):
    return starting_body(problem.body)


@pytest.fixture(scope="module")
def mesh(body):
    return mesh_body(body, 6.0).mesh


def history_line(iteration):
    task = {"translation_mm": [0.0, 0.0, 0.1], "rotation_rad": [0.0, -0.1 * iteration, 0.0]}
    limits = {"wall_mm": 3.0, "fold_mm": 2.0, "curvature": 0.1, "skew": 0.0, "stretch": 0.01, "envelope_mm": None}
    seconds = {"geometry": 1.0, "equilibrium": 2.0, "gradient": 0.5, "subproblem": 1.0, "total": 4.5}
    return {
        "iteration": iteration,
        "tasks": {"bend": task},
        "limits": limits,
        "seconds": seconds,
        "remeshed": iteration == 1,
    }


@pytest.fixture(scope="module")
def finished(problem, body, tmp_path_factory):
    """A run of two designs that are alike."""
    run = create(tmp_path_factory.mktemp("finished"), problem)
    space = design_space(problem, body)
    disc = discretise(problem, body)
    state = checkpoint.pack(analyse(problem, space, disc, space.start), disc)
    for iteration in (0, 1):
        run.record(history_line(iteration), Design.of(body, {"bend": {"A": 0.06}}), state)
    return run


def can_draw(mesh):
    view = View(np.array([0.0, 1.0, 0.0]))
    shape = Shape(mesh, np.zeros_like(mesh.points))
    try:
        render.images(Job([shape], view, view.extent([shape]), (1.0, 1.1)))
    except render.NoPicture as reason:
        pytest.skip(str(reason))


def test_a_run_is_drawn(finished, mesh):
    can_draw(mesh)
    pictures = run_pictures(finished)
    assert pictures.missing == ()
    assert [path.name for path in pictures.paths] == ["history.png", "profile.png", "start.png", "final.png"]
    for path in pictures.paths:
        image = matplotlib.image.imread(path)
        assert min(image.shape[:2]) > 300
        assert image[..., :3].std() > 0.02, f"{path.name} is blank"


def test_a_machine_that_cannot_draw(finished, monkeypatch):
    monkeypatch.setattr(render, "CHILD", "import os; os.abort()")
    pictures = run_pictures(finished)
    assert [path.name for path in pictures.paths] == ["history.png", "profile.png"]
    assert len(pictures.missing) == 2
    assert all("could not be drawn: VTK cannot draw off-screen here" in sentence for sentence in pictures.missing)


def test_stretch_of_a_uniform_stretch(mesh):
    u = mesh.points * np.array([-0.1, 0.05, 0.3])
    np.testing.assert_allclose(nodal_stretch(mesh, u), 1.3, rtol=1e-9)


def test_the_halves_of_a_body(mesh):
    moved = Shape(mesh, np.tile([0.0, 5.0, 0.0], (len(mesh.points), 1)), mesh.points[:, 2])
    skin, face, rim = cut_open(moved, np.array([0.0, 1.0, 0.0]))
    assert skin.points[:, 1].min() == pytest.approx(5.0, abs=2e-3)
    assert np.abs(face.points[:, 1] - 5.0).max() < 2e-3
    assert face.area == pytest.approx(24.0 * 16.0 - 18.0 * 8.0, rel=2e-3)
    assert rim.compute_cell_sizes()["Length"].sum() == pytest.approx(2 * (24 + 16) + 2 * (18 + 8), rel=2e-3)
    np.testing.assert_allclose(face.point_data["field"], face.points[:, 2], atol=1e-4)


def test_the_view_holds_the_body(mesh):
    view = View(np.array([0.0, 1.0, 0.0]))
    right, up, camera = view.axes()
    np.testing.assert_allclose(np.cross(right, up), camera, atol=1e-12)
    assert camera[1] < 0 < up[2]
    left, end, bottom, top = view.extent([Shape(mesh, np.zeros_like(mesh.points))])
    assert 15 < end - left < 17 and 24 < top - bottom < 29


def test_the_profile_of_a_tube(body):
    heights, radii = radius_along_z(body.chambers[0])
    assert heights[[0, -1]] == pytest.approx([3.0, 21.0])
    np.testing.assert_allclose(radii, 4.0, rtol=1e-3)


def test_words(problem):
    motion = motion_of(problem.task[0], {"translation_mm": [0, 0, 1], "rotation_rad": [0.0, -np.pi / 6, 0.0]})
    assert str(motion) == "30.00°" and motion.word == "−bending about y"
    assert pressures({"A": 0.06}) == "60 kPa"
    assert pressures({"A": 0.06, "B": 0.0}) == "A 60, B 0 kPa"
    assert [duration(s) for s in (5.2, 185, 3720)] == ["5 s", "3:05 min", "1:02 h"]
    json.dumps(motion)
