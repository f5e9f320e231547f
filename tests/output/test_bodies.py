"""Pictures of bodies: their cuts, what is marked on them, and pictures that move. Only the last tests draw by VTK."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from records import entry, task_result
from runs import inflated, waved
from scipy.spatial.transform import Rotation
from tiny import tiny

from pneumorph.geometry.tube import enclosed_volume, starting_body
from pneumorph.mesh.tube import mesh_body
from pneumorph.output import render
from pneumorph.output.animation import MOST_FRAMES, evolution, filled_in, inflation, save_gif
from pneumorph.output.bodies import bodies_figure, draw_strip, strip_height
from pneumorph.output.cuts import asked_view, task_view, view_of
from pneumorph.output.figures import PAGE
from pneumorph.output.marks import Arrow, Marks, draw_marks
from pneumorph.output.scenes import Scene, scenes_of
from pneumorph.output.section import cut_open, outline
from pneumorph.output.sheet import sheet_figure
from pneumorph.output.shell import shell_of
from pneumorph.output.view import Job, Panel, Shape, Shell, View
from pneumorph.problem import loads
from pneumorph.problem.file import read
from pneumorph.problem.starts import text_of
from pneumorph.results import Fields


@pytest.mark.parametrize("gravity", [None, np.array([0.0, 0.0, -1.0])])
@pytest.mark.parametrize("wide", [0.48, 0.8, 1.3, 2.5])
def test_the_bar_of_the_scale_fits_panels_of_any_width(mesh, wide, gravity):
    scene = Scene("at rest", Shape(mesh, np.zeros_like(mesh.points)), View(np.array([0.0, 1.0, 0.0])), Marks(), gravity)
    tall, scale = strip_height(scene, wide), 0.03
    figure = Figure(figsize=(wide, tall))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_strip(axes, scene, (wide, tall), scale)
    (bar,) = (line for line in axes.lines if len(line.get_xdata()) == 2)
    (words,) = (text for text in axes.texts if text.get_text().endswith(" mm"))
    start, end = bar.get_xdata()
    assert end - start == pytest.approx(scale * float(words.get_text().removesuffix(" mm")))
    assert start >= 0.0 and end <= wide and end - start > 0.12
    figure.draw_without_rendering()
    box = words.get_window_extent().transformed(figure.dpi_scale_trans.inverted())
    assert box.x1 <= wide and box.y0 >= 0.0
    # Beside the letters of the axes, or below them.
    others = [text.get_window_extent() for text in axes.texts if text is not words and text.get_text()]
    assert not any(words.get_window_extent().overlaps(other) for other in others)


def problem_with(end_effector="", gravity="", **changes):
    text = tiny(**changes).replace("[end_effector]\n", f"[end_effector]\n{end_effector}\n")
    return loads(text + gravity)


GRAVITY = "\n[gravity]\ndirection = [0, 0, -1]\n"
FORCE = 'force = ["0 N", "0.5 N", "0 N"]'
MOMENT = 'moment = ["0 N*mm", "0 N*mm", "30 N*mm"]'


@pytest.fixture(scope="module")
def problem():
    return problem_with()


@pytest.fixture(scope="module")
def mesh(problem):
    return mesh_body(starting_body(problem.tubes), 6.0).mesh


@pytest.fixture
def fields(mesh):
    u = mesh.points * np.array([-0.05, 0.0, 0.2])
    return Fields(mesh, {"extend": u}, {"extend": 1.0 + 0.01 * mesh.points[:, 2]}, sag=np.zeros_like(u))


def objective(text, name="extend"):
    return loads(tiny(objective=text)).task[0]


def bent(problem, text, **result):
    return str(task_view(problem, objective(text), task_result(**result)))


def test_a_task_is_cut_in_the_plane_in_which_it_bends(problem):
    assert bent(problem, '{ kind = "maximize", motion = "bending_x" }') == "cut yz"
    assert bent(problem, '{ kind = "maximize", motion = "-bending_y" }') == "cut xz"
    turns = '{ kind = "match_sections", rotations = [["9 deg", "0 deg", "0 deg"], ["20 deg", "0 deg", "0 deg"]] }'
    assert bent(problem, turns) == "cut yz"
    # Bending about (−1, 1) moves the tip along (1, 1).
    assert bent(problem, '{ kind = "reach", rotation = ["-20 deg", "20 deg", "0 deg"] }') == "cut 45° from xz"
    assert bent(problem, '{ kind = "reach", position = ["-5 mm", "5 mm", "20 mm"] }') == "cut -45° from xz"
    points = '[["0 mm", "0 mm", "0 mm"], ["%s", "%s", "20 mm"]]'
    curve = f'{{ kind = "match_curve", degree = 1, sections = 4, control_points = {points} }}'
    assert bent(problem, curve % ("0 mm", "9 mm")) == "cut yz"
    assert bent(problem, curve % ("9 mm", "0.1 mm")) == "cut xz", "a degree is not worth a plane of its own"
    code = '{ kind = "custom", code = "def objective(f):\\n    return f.volume[\'A\']" }'
    assert bent(problem, code, rotation=(0.3, 0.0, 0.0)) == "cut yz"


def test_all_tasks_together_and_planes_by_name(problem):
    assert str(view_of(problem)) == "cut xz"
    assert str(asked_view(problem, "xy")) == "cut xy at z = 12 mm"
    assert str(asked_view(problem, "xz", 3.0)) == "cut xz at y = 3 mm"
    assert str(asked_view(problem, "yz", 3.0)) == "cut yz at x = 3 mm"
    assert str(asked_view(problem, "none")) == "not cut"


@pytest.mark.parametrize(
    ("copies", "motions", "cut"),
    [
        (3, ["extension"], "cut yz at x = -3 mm"),
        (3, ["bending_x", "bending_y"], "cut yz at x = -3 mm"),
        (3, ["bending_y"], "cut 30° from xz, 3 mm off the axis"),
        (4, ["extension"], "cut xz"),
        (6, ["bending_y"], "cut xz"),
    ],
)
def test_a_body_of_several_chambers_is_cut_through_as_many_as_can_be(copies, motions, cut):
    text = text_of("arm").split("[[task]]")[0].replace("copies = 3", f"copies = {copies}")
    text = text.replace("rotation = 3", f"rotation = {copies}").replace('"-6 mm"', '"6 mm"')
    pressures = ", ".join(f'A{number + 1} = "9 kPa"' for number in range(copies))
    for motion in motions:
        text += f'[[task]]\nname = "{motion}"\npressure = {{ {pressures} }}\n'
        text += f'objective = {{ kind = "maximize", motion = "{motion}" }}\n'
    assert str(view_of(loads(text + '[mesh]\nsize = "3 mm"\n'))) == cut


def test_an_arm_that_lifts_is_cut_through_two_of_its_chambers_and_seen_from_the_side():
    problem = loads(text_of("arm"))
    lift, aside = (task_view(problem, task, task_result()) for task in problem.task)
    assert problem.body.opened(lift.normal, lift.offset) > 1.9 * problem.body.opened(np.array([0.0, 1.0, 0.0]), 0.0)
    assert abs(lift.axes()[2] @ [0.0, 1.0, 0.0]) > 0.95, "the bending is seen across its plane"
    assert str(aside) == "cut yz at x = 3 mm"


@pytest.mark.parametrize(("example", "cut"), [("hand", "cut xz"), ("gripper", "cut yz")])
def test_fingers_are_cut_in_their_mirror_plane(example, cut):
    assert str(view_of(read(Path(__file__).parents[2] / "examples" / f"{example}.toml"))) == cut


@pytest.mark.parametrize(("cut", "axis", "sense"), [("yz", 0, -1), ("xz", 1, 1), ("xy", 2, -1)])
def test_a_cut_at_a_place_is_there_and_its_front_is_removed(problem, mesh, cut, axis, sense):
    view = asked_view(problem, cut, 2.0)
    skin, face, rim = cut_open([Shape(mesh, np.zeros_like(mesh.points))], view.normal, view.offset)[0]
    for part in (face, rim):
        np.testing.assert_allclose(part.points[:, axis], 2.0, atol=5e-3)
    assert (sense * (skin.points[:, axis] - 2.0)).min() > -5e-3
    right, up, camera = view.axes()
    np.testing.assert_allclose(np.cross(right, up), camera, atol=1e-12)
    assert camera[axis] * sense < -0.9, "the camera is on the side that is removed"


def test_states_of_a_mesh_are_cut_together_as_each_alone(mesh):
    normal = np.array([0.0, 1.0, 0.0])
    states = [Shape(mesh, part * mesh.points, 1.0 + part * mesh.points[:, 2]) for part in (0.0, 0.2)]
    for together, shape in zip(cut_open(states, normal, 0.0), states, strict=True):
        for one, other in zip(together, cut_open([shape], normal, 0.0)[0], strict=True):
            np.testing.assert_array_equal(one.points, other.points)
            np.testing.assert_array_equal(one.point_data["field"], other.point_data["field"])
            assert one.n_cells == other.n_cells > 0


def test_a_body_that_is_not_cut_is_whole(mesh):
    shape = Shape(mesh, np.zeros_like(mesh.points))
    skin, face, rim = cut_open([shape], np.array([0.0, 1.0, 0.0]), None)[0]
    assert face.n_points == rim.n_points == 0 == len(outline(shape, np.array([0.0, 1.0, 0.0]), None))
    assert skin.points[:, 1].min() == pytest.approx(-8.0, abs=1e-2) and skin.points[:, 1].max() == pytest.approx(
        8, abs=1e-2
    )


def test_the_outline_is_that_of_the_exterior(mesh):
    pieces = outline(Shape(mesh, np.zeros_like(mesh.points)), np.array([0.0, 1.0, 0.0]), 0.0)
    length = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * (24.0 + 16.0), rel=2e-3)


@pytest.mark.parametrize("ends", ["flat", "pole"])
def test_a_shell_is_closed_and_encloses_the_rubber(ends):
    text = tiny().replace('name = "A"', f'name = "A"\nends = "{ends}"', 1)
    body = waved(starting_body(loads(text).body), 0.1)
    shell = shell_of(body)
    edges = np.concatenate([shell.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    assert len(np.unique(edges, axis=0)) == len(edges), "every edge once in each sense"
    assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}
    a, b, c = np.moveaxis(shell.points[shell.triangles], 1, 0)
    volume = np.einsum("ni,ni->", a, np.cross(b, c)) / 6.0
    exact = enclosed_volume(body.exterior) - sum(enclosed_volume(chamber) for chamber in body.chambers)
    assert volume == pytest.approx(exact, rel=1e-2)


def test_a_shell_is_cut_like_a_mesh(problem):
    shell = shell_of(starting_body(problem.tubes))
    skin, face, rim = cut_open([shell], np.array([0.0, 1.0, 0.0]), 0.0)[0]
    assert np.abs(face.points[:, 1]).max() < 2e-3 and skin.points[:, 1].min() > -1e-6
    assert face.area == pytest.approx(24.0 * 16.0 - 18.0 * 8.0, rel=1e-2)
    assert rim.compute_cell_sizes()["Length"].sum() == pytest.approx(2 * (24 + 16) + 2 * (18 + 8), rel=1e-2)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (problem_with(gravity=GRAVITY), "under its weight, not inflated"),
        (problem_with(FORCE), "under the force on its tip, not inflated"),
        (problem_with(MOMENT), "under the moment on its tip, not inflated"),
        (
            problem_with(f"{FORCE}\n{MOMENT}", GRAVITY),
            "under its weight and the force and moment on its tip, not inflated",
        ),
    ],
)
def test_a_body_that_is_not_inflated_is_named_by_its_loads(asked, words, fields):
    scenes = scenes_of(asked, fields, {"extend": task_result()})
    assert [scene.title for scene in scenes] == ["at rest", words, "60 kPa: extension 0.10 mm"]
    assert all((scene.gravity is None) == (asked.gravity is None) for scene in scenes)
    without = scenes_of(asked, replace(fields, sag=None), {"extend": task_result()})
    assert len(without) == 2


def texts_of(figure):
    FigureCanvasAgg(figure).draw()
    return [text.get_text() for axes in figure.axes for text in (*axes.texts, axes.title) if text.get_text()]


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_loads_axes_and_scale_are_marked(fields, drawn):
    asked = problem_with(f"{FORCE}\n{MOMENT}", GRAVITY)
    figure = bodies_figure(scenes_of(asked, fields, {"extend": task_result()}), (1.0, 1.3), "Title")
    texts = texts_of(figure)
    for word in ("x", "y", "z", "g"):
        assert texts.count(word) == 3, "in each of three pictures"
    assert texts.count("0.5 N") == texts.count("30 N·mm") == 2, "not at rest"
    assert legend_of(figure) == ["clamped base", "exterior at rest", "force on the tip", "moment on the tip"]
    (bar,) = [text for text in texts if text.endswith(" mm") and "extension" not in text]
    lines = [line for axes in figure.axes for line in axes.get_lines() if line.get_linewidth() == 1.5]
    assert len(lines) == 1
    # The bar is as long as it says: its axes are in inches, those of the pictures in mm.
    picture = figure.axes[0]
    per_mm = picture.get_position().width * figure.get_figwidth() / np.ptp(picture.get_xlim())
    assert np.ptp(lines[0].get_xdata()) == pytest.approx(float(bar.split()[0]) * per_mm)


@pytest.mark.parametrize("at", [(-0.2, 0.1), (0.2, 0.1), (0.2, -0.1), (-0.2, -0.1)])
def test_the_word_of_a_load_keeps_clear_of_a_target(at):
    """Wherever a target is beside the end of an arrow, one of the four sides of that end has space for the word."""
    figure = Figure(figsize=(2, 2), dpi=200)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-1, 1), ylim=(-1, 1))
    force = Arrow(np.zeros(3), np.array([1e-3, 0.0, 0.0]), "0.49 N")
    draw_marks(
        axes,
        View(np.array([0.0, 1.0, 0.0]), elevation=0.0, turn=0.0),
        Marks((force,), place=np.array([[at[0], 0.0, at[1]]])),
    )
    FigureCanvasAgg(figure).draw()
    (word,) = [text for text in axes.texts if text.get_text()]
    (cross,) = [line for line in axes.get_lines() if line.get_marker() == "+"]
    place = axes.transData.transform(cross.get_xydata())[0]
    box = word.get_window_extent()
    assert not box.padded(4.0 * 200 / 72).contains(*place)


def test_without_loads_nothing_says_so(problem, fields, drawn):
    figure = bodies_figure(scenes_of(problem, replace(fields, sag=None), {"extend": task_result()}), (1.0, 1.3), "")
    texts = texts_of(figure)
    assert "g" not in texts and not any("weight" in text or " N" in text for text in texts)
    assert legend_of(figure) == ["clamped base", "exterior at rest"]


def test_targets_are_marked_where_they_are(fields, drawn):
    asked = loads(
        tiny(
            objective='{ kind = "reach", position = ["9 mm", "0 mm", "20 mm"], '
            'rotation = ["0 deg", "40 deg", "0 deg"] }'
        )
    )
    result = task_result(errors={"position_mm": 2.0, "orientation_rad": 0.1})
    scenes = scenes_of(asked, replace(fields, sag=None), {"extend": result})
    figure = bodies_figure(scenes, (1.0, 1.3), "Reach")
    assert legend_of(figure)[2:] == ["target of the tip", "target of its direction"]
    moved = figure.axes[2]
    (cross,) = [line for line in moved.get_lines() if line.get_marker() == "+"]
    np.testing.assert_allclose(np.ravel(cross.get_data()), scenes[1].view.flat(np.array([9.0, 0.0, 20.0])))
    left, right = moved.get_xlim()
    assert left < cross.get_xdata()[0] < right


@pytest.mark.parametrize(
    ("objective", "place", "turn"),
    [
        ('shift_x = "9 mm", extension = "-4 mm"', (9.0, 2.0, 20.0), None),
        ('bending_y = "40 deg"', None, (0.1, 40.0, -0.2)),
        ('bending_y = "40 deg", twist = "-9 deg", shift_y = "0 mm"', (1.0, 0.0, 27.0), (0.1, 40.0, -9.0)),
        ('twist = "20 deg"', None, None),
    ],
)
def test_motions_that_are_asked_for_are_marked_and_free_ones_as_reached(fields, drawn, objective, place, turn):
    asked = loads(tiny(objective=f'{{ kind = "motion", {objective} }}'))
    result = task_result(
        translation=(1.0, 2.0, 3.0),
        rotation=tuple(np.radians([0.1, 10.0, -0.2])),
        errors={"position_mm": 2.0, "orientation_rad": 0.1},
    )
    *_, scene = scenes_of(asked, replace(fields, sag=None), {"extend": result})
    np.testing.assert_allclose(scene.marks.place, np.zeros((0, 3)) if place is None else [place])
    if turn is None:
        assert not len(scene.marks.looks)
    else:
        tail, head = scene.marks.looks
        np.testing.assert_allclose(tail, place or (1.0, 2.0, 27.0))
        axis = Rotation.from_rotvec(np.radians(turn)).as_matrix()[:, 2]
        np.testing.assert_allclose((head - tail) / np.linalg.norm(head - tail), axis, atol=1e-12)
    words = ["target of the tip"] * (place is not None) + ["target of its direction"] * (turn is not None)
    assert legend_of(bodies_figure([scene], (1.0, 1.3), "Motion"))[2:] == words


def test_tasks_that_bend_in_different_planes_are_seen_in_different_planes(mesh, drawn):
    second = """[[task]]
name = "other"
pressure = { A = "20 kPa" }
objective = { kind = "maximize", motion = "bending_x" }
[mesh]"""
    asked = loads(tiny(objective='{ kind = "maximize", motion = "bending_y" }').replace("[mesh]", second))
    u = np.zeros_like(mesh.points)
    both = Fields(mesh, {"extend": u, "other": u}, {"extend": u[:, 0] + 1.1, "other": u[:, 0] + 1.1})
    results = {"extend": task_result(), "other": task_result()}
    scenes = scenes_of(asked, both, results)
    assert [str(scene.view) for scene in scenes] == ["cut xz", "cut xz", "cut yz"]
    bodies_figure(scenes, (1.0, 1.2), "Two")
    assert [str(panel.view) for panel in drawn[0].panels] == ["cut xz", "cut xz", "cut yz"]
    asked_for = scenes_of(asked, both, results, asked_view(asked, "xy"))
    assert {str(scene.view) for scene in asked_for} == {"cut xy at z = 12 mm"}
    assert [scene.title[:5] for scene in scenes_of(asked, both, results, only="other")] == ["at re", "other"]


@pytest.mark.parametrize("count", [1, 4, 7])
def test_pictures_side_by_side_fit_a_page_to_one_scale(problem, fields, drawn, count):
    scene = scenes_of(problem, fields, {"extend": task_result()})[-1]
    figure = bodies_figure([scene] * count, (1.0, 1.3), "A title that is much longer than one narrow picture is wide")
    assert figure.get_figwidth() <= PAGE + 1e-9
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    parts = [figure._suptitle, figure.legends[0], *(axes.title for axes in figure.axes)]
    for part in parts:
        box = part.get_window_extent(renderer)
        assert box.x0 >= -1 and box.x1 <= figure.bbox.width + 1 and box.y0 >= -1 and box.y1 <= figure.bbox.height + 1
    sizes = np.array([panel.extent for panel in drawn[0].panels])
    assert np.ptp(sizes[:, 1] - sizes[:, 0]) < 1e-9 and np.ptp(sizes[:, 3] - sizes[:, 2]) < 1e-9


def test_a_sheet_has_colours_and_a_scale(problem, fields, drawn):
    scenes = scenes_of(problem, fields, {"extend": task_result()})
    figure = sheet_figure("Five", [f"member {k}" for k in range(5)], [scenes] * 5)
    texts = texts_of(figure)
    assert "largest principal stretch" in [axes.get_ylabel() for axes in figure.axes]
    assert sum(text.endswith(" mm") for text in texts) == 1
    assert [text.get_text() for text in figure.texts if text.get_text().startswith("member")] == [
        f"member {k}" for k in range(5)
    ]
    box = figure.legends[0].get_window_extent()
    assert box.x0 >= 0 and box.x1 <= figure.bbox.width
    assert len(drawn[0].panels) == 15 and drawn[0].range[1] > 1.2


def test_what_is_filled_in_keeps_to_the_surfaces(mesh, fields):
    skin = fields.skin
    exact = mesh.points * np.array([-0.05, 0.02, 0.2])
    np.testing.assert_allclose(filled_in(mesh, skin, exact[skin], exact), exact, atol=1e-12)
    rough = filled_in(mesh, skin, exact[skin], np.zeros_like(exact))
    np.testing.assert_array_equal(rough[skin], exact[skin])
    # A mean of neighbours is within the extremes at the surfaces, and for a smooth field near it.
    low, high = exact[skin].min(axis=0), exact[skin].max(axis=0)
    assert (rough > low - 1e-3).all() and (rough < high + 1e-3).all()
    assert np.abs(rough - exact).max() < 0.15 * np.abs(exact).max()


def frames_of(path):
    with Image.open(path) as picture:
        frames = []
        for number in range(picture.n_frames):
            picture.seek(number)
            frames.append((np.asarray(picture.convert("RGB")), picture.info["duration"]))
        return frames


def test_an_evolution_has_a_frame_for_every_design_up_to_a_number(problem, drawn):
    body = starting_body(problem.tubes)
    designs = [(entry(k), waved(body, 0.01 * k)) for k in range(150)]
    assert len(evolution(problem, designs[:7]).drawn()) == 7
    assert all(isinstance(panel.shape, Shell) for panel in drawn[0].panels)
    many = evolution(problem, designs).drawn()
    assert len(many) == MOST_FRAMES and sum(seconds for _, seconds in many) < 12
    first, last = drawn[1].panels[0].shape, drawn[1].panels[-1].shape
    np.testing.assert_array_equal(first.points, shell_of(body).points)
    np.testing.assert_array_equal(last.points, shell_of(designs[-1][1]).points)


def test_an_inflation_goes_through_the_stored_pressures_and_back(problem, fields, drawn, tmp_path):
    frames = inflation(problem, inflated(fields), task_result(), "extend").drawn()
    assert len(frames) == 2 * 7 - 2
    heights = [panel.shape.points[:, 2].max() for panel in drawn[0].panels]
    np.testing.assert_allclose(heights, 24.0 * (1 + 0.2 * np.arange(7) / 6), rtol=1e-5)
    assert not any(panel.shape.inside for panel in drawn[0].panels), "inside, nothing is stored"
    save_gif(tmp_path / "inflation.gif", frames)
    seen = frames_of(tmp_path / "inflation.gif")
    assert len(seen) == 12 and [wait for _, wait in seen] == [300] * 6 + [1500] + [300] * 5
    assert len({frame.shape for frame, _ in seen}) == 1
    assert (seen[0][0][0, 0] == 255).all(), "paper is white"


def test_moving_pictures_are_drawn(problem, fields, tmp_path):
    view = View(np.array([0.0, 1.0, 0.0]))
    shape = Shape(fields.mesh, np.zeros_like(fields.mesh.points))
    try:
        (picture,) = render.images(Job([Panel(shape, view, np.array([-20.0, 20.0, -1.0, 26.0]))], (1.0, 1.1), 4.0))
    except render.NoPicture as reason:
        pytest.skip(str(reason))
    assert picture.shape[2] == 4 and picture[0, 0, 3] == 0 and picture[54, 80, 3] == 255, "clear beside the body"
    body = starting_body(problem.tubes)
    film = evolution(problem, [(entry(k), waved(body, 0.1 * k)) for k in range(3)])
    save_gif(tmp_path / "evolution.gif", film.drawn())
    frames = [frame.astype(float) for frame, _ in frames_of(tmp_path / "evolution.gif")]
    assert len(frames) == 3
    for one, other in pairwise(frames):
        assert np.abs(one - other).max() > 50, "the shape changes"
    save_gif(tmp_path / "inflation.gif", inflation(problem, inflated(fields, 2), task_result(), "extend").drawn())
    assert len(frames_of(tmp_path / "inflation.gif")) == 6
