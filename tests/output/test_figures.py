"""Diagrams for papers: their width, colours and letters, and that nothing on them is hidden or cut off."""

import re
import xml.etree.ElementTree
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from records import entry, task_result
from runs import waved
from tiny import tiny

from pneumorph.geometry.tube.start import starting_body
from pneumorph.output.figures import COLOURS, COLUMN, DOTS, PAGE, PLOTS, line_style, save
from pneumorph.output.history import OVER, draw_limits, history_figure
from pneumorph.output.pressures import pressures_figure
from pneumorph.output.shape import shape_figure
from pneumorph.output.tube.profile import profile_figure, radius_along_z
from pneumorph.problem import loads
from pneumorph.results import FineResult

CURVE = """{ kind = "match_curve", degree = 2, sections = 4, control_points = [
["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "12 mm"], ["9 mm", "0 mm", "20 mm"]] }"""


def chambers(count):
    """The tiny problem with chambers above each other."""
    spans = np.linspace(2.0, 22.0, count + 1)
    tables = "".join(
        f'[[body.chamber]]\nname = "{"ABCDE"[k]}"\nradius = "4 mm"\ncenter = ["0 mm", "0 mm"]\n'
        f'span = ["{spans[k] + 1} mm", "{spans[k + 1] - 1} mm"]\n'
        for k in range(count)
    )
    head, tail = tiny().split("[[body.chamber]]")[0], tiny()[tiny().index("[end_effector]") :]
    pressures = ", ".join(f'{"ABCDE"[k]} = "60 kPa"' for k in range(count))
    return loads(head + tables + tail.replace('A = "60 kPa"', pressures))


@pytest.fixture(scope="module")
def problem():
    return loads(tiny())


def story(count, used=lambda k: 0.5, **changes):
    """A history; `used` is the fraction of its curvature limit that each design uses."""
    limits = {"wall_mm": 2.5, "fold_mm": 2.0, "skew": 0.01, "stretch": 0.01, "envelope_mm": 9.5}
    return [
        entry(
            k, tasks={"extend": task_result(translation=(0, 0, 1.0 + k))}, limits=limits | {"curvature": 0.3 * used(k)}
        )
        for k in range(count)
    ]


def laid_out(figure: Figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


def assert_nothing_is_cut_off(figure: Figure):
    """Every text and legend lies within the figure."""
    renderer = laid_out(figure)
    width, height = figure.bbox.size
    parts = [text for axes in figure.axes for text in axes.texts if text.get_text()]
    parts += [axes.get_legend() for axes in figure.axes if axes.get_legend()] + figure.legends
    for axes in figure.axes:
        parts += [axes.title, axes.xaxis.label, axes.yaxis.label]
    for part in parts:
        box = part.get_window_extent(renderer)
        assert box.x0 >= -1 and box.y0 >= -1 and box.x1 <= width + 1 and box.y1 <= height + 1, part
    # Axes have white grounds, which would hide what is below them.
    for axes in figure.axes:
        labels = [axis.label.get_window_extent(renderer) for axis in axes._axis_map.values()]
        for other in figure.axes:
            assert other is axes or not any(other.bbox.overlaps(box) for box in labels), "a label is hidden"


def figures(problem):
    body = starting_body(problem.tubes)
    curve = loads(tiny(objective=CURVE, pressure='{ A = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }'))
    first, last = (
        task_result(errors={"orientation_rad": error}, section_positions=tuple((0.0, 0.0, z) for z in (3, 9, 15, 21)))
        for error in (0.3, 0.1)
    )
    yield history_figure(problem, story(5))
    yield profile_figure(body, waved(body, 0.3), 9.0, ("start", "final"))
    yield pressures_figure(curve, [replace(line, tasks={"extend": last}) for line in story(3)])
    yield shape_figure(curve.task[0], 24.0, first, last)


def test_every_diagram_is_a_column_wide_and_nothing_is_cut_off(problem):
    for figure in figures(problem):
        assert figure.get_figwidth() == COLUMN
        assert_nothing_is_cut_off(figure)


@pytest.mark.parametrize("bend", [0.0, 0.3, 1.0, 2.5])
@pytest.mark.parametrize("about", [0, 1])
def test_no_label_of_a_target_is_hidden_however_it_bends(bend, about):
    """From a body that is straight to one that is as wide as it is high."""
    asked = loads(tiny(objective=CURVE, pressure='{ A = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }'))
    heights = np.array([3, 9, 15, 21])
    places = np.zeros((4, 3))
    places[:, 2], places[:, about] = heights * np.sinc(bend * heights / 48), -bend * heights**2 / 48
    found = task_result(errors={"orientation_rad": 0.1}, section_positions=tuple(map(tuple, places)))
    assert_nothing_is_cut_off(shape_figure(asked.task[0], 24.0, found, found))


@pytest.mark.parametrize("count", [1, 3, 5])
def test_the_legend_of_a_profile_is_whole_whatever_the_number_of_chambers(count):
    body = starting_body(chambers(count).body)
    figure = profile_figure(body, waved(body, 0.2), 12.0, ("start", "final"))
    assert_nothing_is_cut_off(figure)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    names = [f"chamber {name}" for name in "ABCDE"[:count]]
    assert words == ["exterior", *names, "least to largest", "envelope"]


def test_the_mean_of_a_profile_does_not_jump_where_a_wall_ends():
    """Of a wall that is drawn up on one side, the mean stops where the first line does."""
    body = starting_body(loads(tiny()).body)
    tube = body.exterior
    net = tube.net.copy()
    # One end of the wall is slanted, and wide where it is long.
    slope = net[-1, :, 0] / 8.0
    net[-6:, :, 2] += np.linspace(0, 3, 6)[:, None] * slope
    net[-6:, :, :2] *= 1 + 0.04 * np.arange(6)[:, None, None] * slope[:, None]
    heights, (least, mean, largest) = radius_along_z(replace(tube, net=net))
    there = ~np.isnan(mean)
    reached = heights[there]
    assert reached[-1] < heights[-1] - 4.0 and not np.isnan(largest[-1])
    assert np.abs(np.diff(mean[there])).max() < 0.1
    assert ((least <= mean + 1e-12) & (mean <= largest + 1e-12))[there].all()


def test_diagrams_are_saved_for_papers(problem, tmp_path):
    figure = history_figure(problem, story(5))
    for suffix in PLOTS:
        save(figure, tmp_path / f"history.{suffix}")
    image = matplotlib.image.imread(tmp_path / "history.png")
    assert image.shape[1] == pytest.approx(COLUMN * DOTS, abs=1)
    pdf = (tmp_path / "history.pdf").read_bytes()
    assert pdf.startswith(b"%PDF") and b"/FontFile2" in pdf and b"/Type3" not in pdf, "TrueType letters are embedded"
    (width,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ", pdf)
    assert float(width) == pytest.approx(72 * COLUMN)
    svg = (tmp_path / "history.svg").read_text(encoding="utf-8")
    root = xml.etree.ElementTree.fromstring(svg)
    assert root.get("width") == f"{72 * COLUMN:g}pt"
    assert "<text" not in svg and "font-family" not in svg, "outlines need no font"
    for words in ("motion of the tip", "limits, worst value of the body", "time of each design", "curvature"):
        assert f"<!-- {words} -->" in svg


def test_the_same_figure_gives_the_same_file(problem, tmp_path):
    for suffix in PLOTS:
        for name in ("one", "two"):
            save(history_figure(problem, story(3)), tmp_path / f"{name}.{suffix}")
        assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()


def test_a_motion_with_a_target_is_shown_beside_it():
    """The title is the motion, the target is a line, and the axis is not cut at zero."""
    asked = loads(tiny(objective='{ kind = "motion", bending_y = "-60 deg" }'))
    turned = [np.radians([0.0, -12.0 * k, 0.0]) for k in range(5)]
    lines = [replace(line, tasks={"extend": task_result(rotation=tuple(turned[k]))}) for k, line in enumerate(story(5))]
    figure = history_figure(asked, lines)
    axes = figure.axes[0]
    assert axes.get_title() == "bending about y" and axes.get_ylabel() == "degrees"
    target = next(line for line in axes.get_lines() if line.get_label() == "target")
    np.testing.assert_allclose(target.get_ydata(), -60.0)
    low, high = axes.get_ylim()
    assert low < -60.0 and high > 0.0
    assert "target" in [text.get_text() for text in axes.get_legend().get_texts()]
    assert_nothing_is_cut_off(figure)


def test_values_on_fine_meshes_are_beside_the_curve(problem):
    finer = {"extend": FineResult(-9.0, {}, (0.0, 0.0, 9.0), (0.0, 0.0, 0.0), {})}
    lines = [replace(line, finer=finer if line.iteration == 0 else {}) for line in story(5)]
    axes = history_figure(problem, lines).axes[0]
    (stroke,) = [line for line in axes.get_lines() if line.get_label() == "error of the mesh"]
    np.testing.assert_allclose(stroke.get_xdata(), 0.0)
    here = problem.task[0].objective.achieved(lines[0].tasks["extend"]).value
    np.testing.assert_allclose(stroke.get_ydata(), [here, 9.0])


def test_an_overshoot_is_told_and_does_not_flatten_the_limits(problem):
    axes = Figure().subplots()
    draw_limits(axes, problem, story(6, lambda k: 40.0 if k == 2 else 0.5))
    assert axes.get_ylim() == (0.0, OVER)
    (note,) = [text for text in axes.texts if text.get_text()]
    assert note.get_text() == "↑ 40" and note.xy == (2, OVER)
    axes = Figure().subplots()
    draw_limits(axes, problem, story(6))
    assert not axes.texts


def test_limits_that_coincide_are_all_seen(problem):
    """Each of two equal lines has colours of its own in the picture: a wider line, and marks at other designs."""
    problem = problem.with_changes({"limits.margin": 1})
    both = [
        replace(line, limits=line.limits | {"wall_mm": problem.limits.wall, "curvature": problem.limits.curvature})
        for line in story(12)
    ]
    figure = history_figure(problem, both)
    axes = figure.axes[1]
    lines = {line.get_label(): line for line in axes.get_lines()}
    wall, curvature = lines["wall"], lines["curvature"]
    np.testing.assert_allclose(wall.get_ydata(), curvature.get_ydata())
    marked = [set(range(12)[line.get_markevery()[0] :: line.get_markevery()[1]]) for line in (wall, curvature)]
    assert marked[0] and marked[1] and not marked[0] & marked[1]
    laid_out(figure)
    picture = np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255.0
    left, bottom = axes.transData.transform((0, 0.97)).astype(int)
    right, top = axes.transData.transform((11, 1.03)).astype(int)
    band = picture[picture.shape[0] - top : picture.shape[0] - bottom, left:right]
    for line in (wall, curvature):
        near = np.abs(band - to_rgb(line.get_color())).max(axis=-1) < 0.1
        assert near.sum() > 10, line.get_label()


DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
"""Machado, Oliveira and Fernandes 2009, full severity, of linear RGB."""


@pytest.mark.parametrize("seen", [np.eye(3), DEUTERANOPIA, PROTANOPIA])
def test_colours_differ_with_every_kind_of_colour_vision(seen):
    linear = np.array(
        [[c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(name)] for name in COLOURS]
    )
    xyz = np.clip(linear @ seen.T, 0, 1) @ np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    ).T / [0.9505, 1.0, 1.089]  # fmt: skip
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    lab = np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1)[np.triu_indices(len(COLOURS), 1)]
    assert apart.min() > 9.0, "five times what an eye just notices"


def test_a_page_holds_two_columns():
    assert 2 * COLUMN < PAGE < 2 * COLUMN + 0.25


def test_a_motion_that_is_held_has_a_curve_and_a_line(tmp_path):
    held = tiny(objective='{ kind = "minimize", of = "mass" }').replace(
        "[mesh]", '[limits]\nat_least = { bending_y = "-2 deg" }\n[mesh]'
    )
    turned = [np.radians([0.0, -1.0 - k, 0.0]) for k in range(5)]
    finer = {"extend": FineResult(3.0, {}, (0.0, 0.0, 0.0), (0.0, np.radians(-1.2), 0.0), {})}
    lines = [
        replace(line, tasks={"extend": task_result(rotation=tuple(turned[k]))}, finer={} if k else finer)
        for k, line in enumerate(story(5))
    ]
    figure = history_figure(loads(held), lines)
    words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert words == ["mass of the rubber (g)", "bending about y (-2° or farther)", "error of the mesh", "least motion"]
    (degrees,) = [axes for axes in figure.axes if axes.get_ylabel() == "degrees"]
    curve, stroke, least = degrees.get_lines()
    np.testing.assert_allclose(curve.get_ydata(), [-1.0, -2.0, -3.0, -4.0, -5.0])
    np.testing.assert_allclose(stroke.get_ydata(), [-1.0, -1.2])
    np.testing.assert_allclose(least.get_ydata(), -2.0)
    assert_nothing_is_cut_off(figure)


def test_no_two_of_many_lines_look_alike():
    styles = [line_style(number, 20) for number in range(20)]
    assert len({(style["color"], style["marker"]) for style in styles}) == 20
    assert all(style["linestyle"] == "-" for style in styles[:7])
    assert all(style["linestyle"] != "-" and style["markerfacecolor"] == "white" for style in styles[7:])
