"""Pictures of a tiny run, and the numbers behind them."""

import json

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from records import entry, one_element, task_result
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation
from tiny import tiny

from pneumorph.analysis import analyse, collect_fields, discretise
from pneumorph.geometry.tube import build_design_space, starting_body
from pneumorph.mesh.tube import mesh_body
from pneumorph.objective.kinds import target_of
from pneumorph.output import history, pictures, render
from pneumorph.output.figures import PLOTS
from pneumorph.output.format import format_duration, format_pressures
from pneumorph.output.pictures import picture_names, run_pictures
from pneumorph.output.section import cut_open
from pneumorph.output.shape import achieved_centre_line
from pneumorph.output.tube.profile import radius_along_z
from pneumorph.output.view import Job, Panel, Shape, View
from pneumorph.problem import loads
from pneumorph.results import nodal_stretch
from pneumorph.run import StoredDesign, create


@pytest.fixture(scope="module")
def problem():
    return loads(tiny(title='""', objective='{ kind = "maximize", motion = "-bending_y" }').replace("extend", "bend"))


@pytest.fixture(scope="module")
def body(problem):
    return starting_body(problem.tubes)


@pytest.fixture(scope="module")
def mesh(body):
    return mesh_body(body, 6.0).mesh


PLAIN = [f"{name}.{suffix}" for name in ("history", "profile") for suffix in PLOTS]


def history_entry(iteration, **changes):
    task = task_result(rotation=(0.0, -0.1 * iteration, 0.0))
    return entry(iteration, **({"tasks": {"bend": task}, "remeshed": iteration == 1} | changes))


@pytest.fixture(scope="module")
def finished(problem, body, tmp_path_factory):
    """A run of two designs that are alike."""
    run = create(tmp_path_factory.mktemp("finished"), problem)
    space = build_design_space(problem, body)
    disc = discretise(problem, body)
    fields = collect_fields(disc, analyse(problem, space, disc, space.start))
    for iteration in (0, 1):
        run.record(history_entry(iteration), StoredDesign.of(body, {"bend": {"A": 0.06}}), fields, {})
    return run


def can_draw(mesh):
    view = View(np.array([0.0, 1.0, 0.0]))
    shape = Shape(mesh, np.zeros_like(mesh.points))
    try:
        render.images(Job([Panel(shape, view, np.array([-9.0, 9.0, -1.0, 26.0]))], (1.0, 1.1), 2.0))
    except render.NoPicture as reason:
        pytest.skip(str(reason))


def test_a_run_is_drawn(finished, mesh):
    can_draw(mesh)
    drawn = run_pictures(finished)
    assert drawn.missing == ()
    assert [path.name for path in drawn.paths] == [*PLAIN, "start.png", "final.png", "evolution.gif"]
    assert picture_names(drawn.paths) == "history.png|pdf|svg, profile.png|pdf|svg, start.png, final.png, evolution.gif"
    for path in (path for path in drawn.paths if path.suffix == ".png"):
        image = matplotlib.image.imread(path)
        assert min(image.shape[:2]) > 300
        assert image[..., :3].std() > 0.02, f"{path.name} is blank"


def test_a_machine_that_cannot_draw(finished, monkeypatch):
    engines = []
    monkeypatch.setattr(render, "CHILD", "import os; os.abort()")
    monkeypatch.setattr(pictures, "save", lambda figure, path: engines.append(figure.get_layout_engine()))
    drawn = run_pictures(finished)
    assert engines == [None] * len(PLAIN), "a figure with one is drawn twice for every format"
    assert [path.name for path in drawn.paths] == PLAIN
    (sentence,) = drawn.missing
    assert "start.png and other pictures of bodies could not be drawn: VTK cannot draw off-screen here" in sentence


FREE = '{ start = "30 kPa", min = "0 kPa", max = "60 kPa" }'
CURVE = """{ kind = "match_curve", degree = 2, sections = 4, control_points = [
["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "12 mm"], ["9 mm", "0 mm", "20 mm"]] }"""
TURNS = '{ kind = "match_sections", rotations = [["0 deg", "90 deg", "0 deg"], ["0 deg", "90 deg", "90 deg"]] }'
CODE = '{ kind = "custom", code = "def objective(f):\\n    return f.volume[\'A\']" }'


def task_text(name, objective, pressure="60 kPa"):
    pressure = pressure if pressure.startswith("{") else f'"{pressure}"'
    return f'[[task]]\nname = "{name}"\npressure = {{ A = {pressure} }}\nobjective = {objective}\n'


def arm(*tasks):
    """The tiny problem with other tasks."""
    head, tail = tiny().split("[[task]]")[0], tiny()[tiny().index("[mesh]") :]
    return loads(head + "".join(tasks) + tail)


def answer(sections, error, turn=0.0):
    z = 24.0 * (np.arange(sections) + 0.5) / sections
    return task_result(
        translation=(0.0, 0.0, 1.0),
        rotation=(0.0, turn, 0.0),
        pressures={"A": 0.03},
        objective=1500.0,
        errors={"orientation_rad": error, "position_mm": 10 * error},
        section_positions=tuple((0.0, 0.0, height) for height in z),
    )


def test_targets_and_designed_pressures_have_their_pictures(body, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "_bodies", lambda folder, run, history: ({}, []))
    both = arm(task_text("curve", CURVE, FREE), task_text("turns", TURNS, FREE), task_text("volume", CODE))
    for number, (asked, names) in enumerate(
        (
            (both, ["shape_curve", "shape_turns", "pressures"]),
            (arm(task_text("curve", CURVE)), ["shape"]),
        )
    ):
        run = create(tmp_path / str(number), asked)
        answers = {"curve": 4, "turns": 2, "volume": 0}
        for iteration in (0, 1):
            tasks = {task.name: answer(answers[task.name], 0.4 - 0.3 * iteration) for task in asked.task}
            pressures = {name: {"A": 0.03} for name in tasks}
            run.record(history_entry(iteration, tasks=tasks), StoredDesign.of(body, pressures), one_element(), {})
        drawn = run_pictures(run)
        assert [path.name for path in drawn.paths] == PLAIN + [f"{name}.{end}" for name in names for end in PLOTS]
        for path in (path for path in drawn.paths if path.suffix == ".png"):
            assert matplotlib.image.imread(path)[..., :3].std() > 0.02, f"{path.name} is blank"


def test_a_target_of_orientations_is_straight_pieces_along_them():
    target = target_of(arm(task_text("turns", TURNS)).task[0].objective, 24.0)
    # A quarter turn about y lays the first half along x; the rotation vector (0, 90°, 90°) turns z to this direction.
    turned = Rotation.from_rotvec([0.0, np.pi / 2, np.pi / 2]).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(target.line, [[0, 0, 0], [12, 0, 0], [12, 0, 0] + 12 * turned], atol=1e-12)
    np.testing.assert_allclose(target.sections, [[6, 0, 0], [12, 0, 0] + 6 * turned], atol=1e-12)


def test_curves_run_from_the_base_through_the_sections():
    asked = arm(task_text("curve", CURVE)).task[0].objective
    target = target_of(asked, 24.0)
    np.testing.assert_allclose(target.line[[0, -1]], [[0, 0, 0], [9, 0, 20]], atol=1e-9)
    achieved = achieved_centre_line(answer(4, 0.1), 24.0)
    np.testing.assert_allclose(achieved.points[[0, -1]], [[0, 0, 0], [0, 0, 25]], atol=1e-9)
    for line, sections in ((target.line, target.sections), achieved):
        distance, _ = KDTree(line).query(sections)
        assert len(sections) == 4 and distance.max() < 0.1


def test_three_units_have_three_scales():
    asked = arm(
        task_text("out", '{ kind = "maximize", motion = "extension" }'),
        task_text("turns", TURNS),
        task_text("volume", CODE),
    )
    lines = [history_entry(k, tasks={task.name: answer(2, 0.4 - 0.3 * k) for task in asked.task}) for k in (0, 1)]
    axes = Figure().subplots()
    history.draw_motions(axes, asked, lines)
    scales = axes.figure.axes
    assert [scale.get_ylabel() for scale in scales] == ["mm", "degrees", "objective"]
    assert scales[1].get_ylim()[0] == 0.0
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "out: extension (mm)", "turns: error of the sections (°)", "volume: objective", "remeshed",
    ]  # fmt: skip
    assert axes.get_title() == "results of the tasks"


def test_stretch_of_a_uniform_stretch(mesh):
    u = mesh.points * np.array([-0.1, 0.05, 0.3])
    np.testing.assert_allclose(nodal_stretch(mesh, u), 1.3, rtol=1e-9)


def test_the_halves_of_a_body(mesh):
    moved = Shape(mesh, np.tile([0.0, 5.0, 0.0], (len(mesh.points), 1)), mesh.points[:, 2])
    skin, face, rim = cut_open([moved], np.array([0.0, 1.0, 0.0]), 0.0)[0]
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
    seen = view.flat(mesh.points)
    assert 15 < np.ptp(seen[:, 0]) < 17 and 24 < np.ptp(seen[:, 1]) < 29


def test_the_profile_of_a_tube(body):
    heights, radii = radius_along_z(body.chambers[0])
    assert heights[[0, -1]] == pytest.approx([3.0, 21.0])
    np.testing.assert_allclose(radii, 4.0, rtol=1e-3)


def test_words(problem):
    motion = problem.task[0].objective.achieved(task_result(rotation=(0.0, -np.pi / 6, 0.0)))
    assert str(motion) == "30.00°" and motion.word == "bending about −y"
    assert format_pressures({"A": 0.06}) == "60 kPa"
    assert format_pressures({"A": 0.06, "B": 0.0}) == "A 60, B 0 kPa"
    assert [format_duration(s) for s in (5.2, 185, 3720)] == ["5 s", "3:05 min", "1:02 h"]
    json.dumps(motion)
