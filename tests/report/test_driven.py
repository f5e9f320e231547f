"""Pressures and targets on the page of a run with a fast model: the body follows at once, as the model says."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from pages import blocks_of, differs, picture, serving, slide, solved, words
from runs import analysed, ended, waving_run
from texts import problem_text
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.cli import app
from pneumorph.output.report import write_report
from pneumorph.problem import loads
from pneumorph.surrogate.reader import MOTIONS, Model
from pneumorph.surrogate.workspace import workspace

TWO = problem_text(
    """[end_effector]
kind = "plate"
[[task]]
name = "bend"
pressure = { A = "40 kPa", B = "20 kPa" }
objective = { kind = "maximize", motion = "bending_y" }
[mesh]
size = "5 mm"
""",
    length=40,
    radius=5,
    chambers=(("A", 1.5, "2.3 mm", "0 mm"), ("B", 1.5, "-2.3 mm", "0 mm")),
    body='control_density = "0.3 /mm"',
    head='title = "Two"',
    material='model = "neo-hookean"\nshear_modulus = "0.1 MPa"\nbulk_modulus = "1 MPa"\ndensity = "1.1 g/cm^3"',
)
TIP = np.array([0.0, 0.0, 40.0])
RED = np.array([0xD1, 0x49, 0x5B]) / 255
KNOBS = {"x": (0x1F, 0x7A, 0x8C), "y": (0x4F, 0x77, 0x2D), "z": (0x7B, 0x4F, 0xA3)}


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A run of two designs with the model of its last one, and its page."""
    problem = loads(TWO)
    run = waving_run(tmp_path_factory.mktemp("driven") / "two", problem, 2, {1: analysed(problem, 0.1)})
    ended(run)
    pm.open_run(run.path).best.model(run.path / "model.npz", {"A": "0:40 kPa", "B": "0:40 kPa"}, tolerance=0.02)
    write_report(run)
    return run


@pytest.fixture
def page(driven, opened):
    page = opened(driven.path / "report.html")
    # All of it is seen, so that nothing scrolls.
    page.set_viewport_size({"width": 1100, "height": 1300})
    page.select_option("#task", "*")
    return page


def pressures(page) -> np.ndarray:
    """MPa, as they are shown."""
    texts = [page.locator(f"#chambers .row:nth-child({k}) output").inner_text() for k in (1, 2)]
    return np.array([float(text.removesuffix(" kPa")) for text in texts]) / 1e3


def cell(page, name) -> str:
    return page.locator(f"#explored tr:has(th:text-is('{name}')) td").inner_text().replace("−", "-")


def row(page, name) -> np.ndarray:
    text = cell(page, name)
    return np.array([float(number) for number in re.findall(r"-?\d+\.\d+", text.partition("±")[0])])


def target(page) -> np.ndarray:
    return np.array([float(page.locator(f"#target-{axis}").input_value()) for axis in "xyz"])


def turned(page) -> np.ndarray:
    """The target's rotation vector, rad."""
    return np.radians([float(page.locator(f"#turn-{axis}").input_value()) for axis in "xyz"])


def pixels_of(page, chosen) -> np.ndarray:
    """Where in the window chosen pixels of the picture (height, width) are."""
    box = page.locator("#view canvas").bounding_box()
    rows, columns = np.nonzero(chosen)
    assert len(rows), "nothing of it is in the picture"
    return np.column_stack([columns, rows]) * box["height"] / len(chosen) + [box["x"], box["y"]]


def ball_of(page) -> np.ndarray:
    return pixels_of(page, np.abs(picture(page) - RED).max(axis=2) < 0.12).mean(axis=0)


def test_the_drawn_body_is_the_exact_one_within_the_error_that_is_told(driven, tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no Node.js here")
    (tmp_path / "block").write_bytes(blocks_of(driven.path / "report.html")[0])
    script = Path(__file__).with_name("modelled.mjs")
    asked = json.dumps({"A": 32.0, "B": 11.0})
    if not (script.parents[2] / "web" / "node_modules" / "three").is_dir():
        pytest.skip("three.js is not installed in web/")
    told = json.loads(subprocess.check_output([node, script, tmp_path / "block", asked], text=True))
    model = Model(driven.path / "model.npz")
    exact = pm.open_run(driven.path).best.explorer().at({"A": 0.032, "B": 0.011}).fields.whole()
    rest, drawn = (np.reshape(told[name], (-1, 3)) for name in ("rest", "positions"))
    away = np.linalg.norm(rest[:, None] - exact.mesh.points[exact.skin], axis=2)
    nodes = exact.skin[away.argmin(axis=1)]
    assert away.min(axis=1).max() < 2e-3 and told["inside"]
    off = np.linalg.norm(drawn - rest - exact.u["bend"][nodes], axis=1)
    assert off.max() < 2 * model.errors["shape_mm"] + 1e-4 < 0.05 * np.abs(exact.u["bend"]).max()
    assert np.abs(told["stretch"] - exact.stretch["bend"][nodes]).max() < 2 * model.errors["stretch"] + 1e-4
    pose = model.pose([0.032, 0.011])
    np.testing.assert_allclose(told["tip"], TIP + pose.translation, atol=1e-3)


def test_sliders_move_the_body_at_once_and_without_a_network(driven, page):
    before = picture(page)
    slide(page, "chamber-1", 35)
    assert differs(before, picture(page)) > 0.01
    assert words(page, "shown").endswith("A 40, B 35 kPa, by the fast model")
    model = Model(driven.path / "model.npz")
    pose = model.pose([0.04, 0.035])
    np.testing.assert_allclose(row(page, "tip moves, mm"), pose.translation, atol=0.005)
    np.testing.assert_allclose(row(page, "tip turns, °"), np.degrees(pose.rotation), atol=0.005)
    assert "on the surfaces at 16 exact states" in words(page, "solving")
    for mode in ("thickness", "limits", "displacement", "rubber", "stretch"):
        page.select_option("#mode", mode)
        assert (picture(page) < 0.97).any(axis=2).mean() > 0.03
    assert page.complaints == [] and len(page.requests) == 1
    assert (driven.path / "report.html").stat().st_size < 5e6


def test_a_target_that_is_typed_is_reached_or_told_to_be_out_of_reach(driven, page):
    model = Model(driven.path / "model.npz")
    there = model.pose([0.02, 0.03]).translation + TIP
    for axis, value in zip("xyz", there, strict=True):
        page.locator(f"#target-{axis}").evaluate("(field, value) => { field.value = value }", str(value))
    page.locator("#target-z").dispatch_event("change")
    assert words(page, "reached") == "The target is reached."
    np.testing.assert_allclose(pressures(page), [0.02, 0.03], atol=2e-4)
    page.locator("#target-y").fill("7")
    page.locator("#target-y").press("Enter")
    missed = float(re.search(r"out of reach by ([\d.]+) mm", words(page, "reached"))[1])
    found = model.pressures_for(dict(zip(("shift_x", "shift_y", "extension"), target(page) - TIP, strict=True)))
    assert missed == pytest.approx(found.missed, rel=0.05) and missed > 6
    np.testing.assert_allclose(pressures(page), list(found.pressures.values()), atol=1e-3)


def test_the_ball_is_dragged_and_the_pressures_follow(driven, page):
    page.uncheck("#marks")
    page.select_option("#mode", "plain")
    slide(page, "chamber-0", 30)
    before, start, seen = pressures(page), target(page), picture(page)
    x, y = ball_of(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y - 12, steps=4)
    assert np.abs(pressures(page) - before).max() > 1e-3
    page.mouse.up()
    assert np.abs(target(page) - start).max() > 0.5 and differs(seen, picture(page)) > 0.001
    ball = ball_of(page)
    assert np.hypot(ball[0] - x - 20, ball[1] - y + 12) < 8, "the picture has not been turned, and the ball is there"
    model = Model(driven.path / "model.npz")
    np.testing.assert_allclose(row(page, "tip moves, mm"), model.pose(pressures(page)).translation, atol=0.01)
    missed = re.search(r"out of reach by ([\d.]+) mm", words(page, "reached"))
    place = model.pose(pressures(page)).translation + TIP
    assert float(missed[1]) == pytest.approx(np.linalg.norm(place - target(page)), abs=0.06)
    assert page.complaints == []


def test_a_target_is_turned_too(driven, page):
    model = Model(driven.path / "model.npz")
    pose = model.pose([0.02, 0.03])
    page.check("#turned")
    for axis, place, angle in zip("xyz", pose.translation + TIP, np.degrees(pose.rotation), strict=True):
        for name, value in ((f"#target-{axis}", place), (f"#turn-{axis}", angle)):
            page.locator(name).evaluate("(field, value) => { field.value = value }", str(value))
    page.locator("#turn-z").dispatch_event("change")
    assert words(page, "reached") == "The target is reached."
    np.testing.assert_allclose(pressures(page), [0.02, 0.03], atol=2e-4)
    page.locator("#turn-y").fill("25")
    page.locator("#turn-y").press("Enter")
    said = re.search(r"out of reach by ([\d.]+) mm, where 1° counts as 1 mm", words(page, "reached"))
    found = model.pressures_for(dict(zip(MOTIONS, [*(target(page) - TIP), *turned(page)], strict=True)))
    assert float(said[1]) == pytest.approx(found.missed, rel=0.05) and found.missed > 2
    np.testing.assert_allclose(pressures(page), list(found.pressures.values()), atol=1e-3)
    page.uncheck("#turned")
    assert "1°" not in words(page, "reached") and not page.locator("#turn-x").is_visible()
    assert page.complaints == []


def test_a_target_is_turned_by_its_knobs(driven, page):
    page.uncheck("#marks")
    page.select_option("#mode", "plain")
    page.check("#turned")
    place, ball = target(page), ball_of(page)
    for axis, drag in (("x", np.array([14, -25])), ("z", np.array([22, 6]))):
        color = np.array(KNOBS[axis]) / 255
        knob = pixels_of(page, np.abs(picture(page) - color).max(axis=2) < 0.1).mean(axis=0)
        before = turned(page)
        page.mouse.move(*knob)
        page.mouse.down()
        page.mouse.move(*(knob + drag), steps=5)
        assert np.abs(turned(page) - before).max() > 0.05
        page.mouse.up()
        np.testing.assert_allclose(target(page), place, atol=0.011)
        there = pixels_of(page, np.abs(picture(page) - color).max(axis=2) < 0.1).mean(axis=0) - ball
        towards = knob + drag - ball
        assert there @ towards > 0.95 * np.linalg.norm(there) * np.linalg.norm(towards)
    model = Model(driven.path / "model.npz")
    wanted = dict(zip(MOTIONS, [*(target(page) - TIP), *turned(page)], strict=True))
    missed = float(re.search(r"out of reach by ([\d.]+) mm", words(page, "reached"))[1])
    assert missed == pytest.approx(model.pressures_for(wanted).missed, rel=0.05)
    assert page.complaints == []


def test_places_are_coloured_by_dexterity_and_stiffness(driven, page):
    page.uncheck("#marks")
    page.select_option("#mode", "plain")
    page.check("#places")
    plain = picture(page)
    assert not page.locator("#places-scale").is_visible()
    model = Model(driven.path / "model.npz")
    every = workspace(model, model.bounds, 4000)
    for by, values in (("finest", 1e-3 * every.finest), ("softest", every.stiffness[:, 0])):
        page.select_option("#places-by", by)
        assert differs(plain, picture(page)) > 1e-3
        ends = [float(text) for text in page.locator("#places-scale span").all_inner_texts()]
        np.testing.assert_allclose(ends, [values.min(), values.max()], rtol=0.1)
    own = [float(number) for number in re.findall(r"[\d.]+", cell(page, "stiffness of the tip, N/mm"))]
    soft = model.compliance(pressures(page))[:3, :3]
    np.testing.assert_allclose(own, 1 / np.linalg.eigvalsh(soft)[[2, 0]], rtol=0.01)
    own = [float(number) for number in re.findall(r"[\d.]+", cell(page, "1 kPa moves it, mm"))]
    sizes = np.linalg.svd(model.jacobian(pressures(page))[:3], compute_uv=False)
    np.testing.assert_allclose(own, 1e-3 * sizes[[-1, 0]], rtol=0.06)
    page.check("#soft")
    force = float(re.search(r"where ([\d.]+) N", words(page, "soft-words"))[1])
    assert force == pytest.approx(0.9 * 5 * every.stiffness[:, 0].min(), rel=0.4), "the longest half axis is 0.9 radii"
    assert (np.abs(picture(page) - np.array([0xB5, 0x65, 0x1D]) / 255).max(axis=2) < 0.3).sum() > 100
    page.uncheck("#soft")
    page.select_option("#places-by", "")
    assert differs(plain, picture(page)) < 1e-4 and page.complaints == []


def test_a_place_that_is_clicked_has_its_pressures(driven, page):
    page.uncheck("#marks")
    page.select_option("#mode", "plain")
    page.select_option("#cut-axis", "")
    slide(page, "chamber-1", 0)
    without = picture(page)
    page.check("#places")
    places = pixels_of(page, np.abs(without - picture(page)).max(axis=2) > 0.05)
    before, ball = pressures(page), ball_of(page)
    there = places[np.argmax(np.linalg.norm(places - ball, axis=1))]
    page.mouse.click(*there)
    assert np.abs(pressures(page) - before).max() > 1e-3
    assert words(page, "reached").startswith("Drag the ball")
    assert np.linalg.norm(ball_of(page) - there) < 12 < np.linalg.norm(ball - there)
    assert page.complaints == []


def test_other_designs_have_no_model(page):
    slide(page, "design", 0)
    assert words(page, "solving") == "The fast model is that of design 1: choose that design to set pressures."
    assert not page.locator("#driving").is_visible()
    slide(page, "design", 1)
    assert page.locator("#driving").is_visible() and page.complaints == []


def test_in_view_the_exact_state_takes_the_place_of_the_drawn_one(driven, opened):
    with serving(driven.path) as address:
        page = opened(address)
        page.select_option("#task", "*")
        solved(page, "A 40.000, B 20.000")
        # Before an answer can be there.
        drawn = page.evaluate("""() => { const slider = document.getElementById("chamber-0"); slider.value = 36;
            slider.dispatchEvent(new Event("input")); return document.getElementById("explore").dataset.drawn; }""")
        assert drawn == "A 36.000, B 20.000"
        solved(page, drawn)
        assert words(page, "shown") == "design 1 at A 36, B 20 kPa"
        off = re.fullmatch(
            r"This is the exact state\. The tip of the fast model is at most (\S+) mm from it\.", words(page, "solving")
        )
        assert float(off[1]) < 3 * Model(driven.path / "model.npz").errors["translation_mm"] + 2e-3
        (expected,) = pm.open_run(driven.path).best.simulate({"A": "36 kPa", "B": "20 kPa"}).steps[:1]
        np.testing.assert_allclose(row(page, "tip moves, mm"), expected.translation, atol=0.02)
        # Beyond the model the sliders go on to what the server solves.
        slide(page, "chamber-0", 45)
        assert "fast model" not in words(page, "solving")
        solved(page, "A 45.000, B 20.000")
        page.locator("#target-x").wait_for(state="attached")
        assert page.complaints == []


def test_a_model_that_is_not_of_the_run_is_told(driven, run, tmp_path):
    shutil.copytree(run.path, tmp_path / "run")
    shutil.copy(driven.path / "model.npz", tmp_path / "run")
    arguments = ["report", str(tmp_path / "run"), "--model", str(driven.path / "model.npz")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2 and "another body" in result.stderr and result.stderr.count("\n") == 1
    result = CliRunner().invoke(app, arguments[:2])
    assert result.exit_code == 0 and "another body" in result.stdout.splitlines()[-1]
    result = CliRunner().invoke(app, ["report", str(driven.path), "--out", str(tmp_path / "page.html")])
    assert "model.npz is on it: design 1 follows sliders" in result.stdout.splitlines()[-1]
    written = pm.open_run(tmp_path / "run")
    assert "another body" in json.dumps(facts(written.report())["notes"]) and "model" not in facts(written.report())


def facts(path) -> dict:
    from pneumorph.output.packed import unpack

    return unpack(blocks_of(path)[0])[0]
