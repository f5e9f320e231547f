"""The page of a run in a browser: it draws, it listens, it is right, and it asks nobody for anything."""

import csv
import io
import json
import re

import numpy as np
import pytest
from pages import differs, picture, slide, words
from runs import analysed, waving_run
from tiny import tiny

from pneumorph.output.report import write_report
from pneumorph.output.study_page import write_study_page
from pneumorph.problem import loads


@pytest.fixture
def page(run, opened):
    return opened(run.path / "report.html")


def test_it_opens_without_a_complaint_or_a_network(page):
    for name in ("ghost", "cut-flip"):
        page.check(f"#{name}")
    page.select_option("#task", "half")
    picture(page)
    assert page.complaints == []
    assert len(page.requests) == 1 and page.requests[0].startswith("file:")


def test_every_colour_mode_draws(page):
    seen = {}
    for mode in ("thickness", "limits", "stretch", "displacement", "rubber", "plain"):
        page.select_option("#mode", mode)
        pixels = seen[mode] = picture(page)
        drawn = pixels[(pixels < 0.97).any(axis=2)]
        assert len(drawn) > 0.03 * pixels[..., 0].size, f"{mode} is blank"
        assert drawn.std(axis=0).max() > 0.05, f"{mode} has one colour"
        assert page.locator("#legend").is_visible() == (mode != "plain")
    modes = list(seen.values())
    assert min(differs(one, other) for k, one in enumerate(modes) for other in modes[:k]) > 0.01


def test_what_more_rubber_does_is_told_for_the_task(page):
    """In the motion that each is about; at rest of the first; not for a design of which it is not stored."""
    page.select_option("#mode", "rubber")
    assert words(page, "legend").splitlines()[0] == "Extension: change by 0.1 mm more rubber on 1 cm², mm"
    low, middle, high = map(float, page.locator("#legend .ticks span").all_inner_texts())
    assert low == -high < 0.0 == middle
    inflated = picture(page)
    page.select_option("#task", "half")
    assert "change by 0.1 mm more rubber on 1 cm², °" in words(page, "legend")
    page.select_option("#task", "")
    assert words(page, "legend").startswith("Extension") and differs(inflated, picture(page)) > 0.005
    slide(page, "design", 0)
    assert words(page, "legend").splitlines()[0] == "More rubber: not stored for this design"


def test_words_and_legend_are_clear_of_the_body_on_a_phone(page):
    page.set_viewport_size({"width": 390, "height": 844})
    pixels = picture(page)
    seen = page.locator("#view canvas").bounding_box()
    rows = np.flatnonzero((pixels < 0.97).any(axis=(1, 2))) * seen["height"] / len(pixels) + seen["y"]
    above, below = (page.locator(name).bounding_box() for name in ("#view .shown", "#legend"))
    assert above["y"] + above["height"] < rows[0] and rows[-1] < below["y"]
    assert above["x"] + above["width"] < seen["x"] + seen["width"] - 8


def test_the_nearest_limit_is_told_where_one_points(page):
    page.select_option("#mode", "limits")
    assert words(page, "legend").splitlines()[0] == "Share of the nearest limit, %"
    assert page.locator("#legend .ticks span").all_inner_texts() == ["0", "50", "100"]
    page.select_option("#cut-axis", "")
    for task in ("", "half"):
        page.select_option("#task", task)
        page.mouse.move(0, 0)
        box = page.locator("#view canvas").bounding_box()
        assert words(page, "here") == "point at the body for its name"
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        limits = "wall|fold|curvature|skew|stretch|relative area|envelope"
        assert re.fullmatch(rf"here ({limits}), \d+ %", words(page, "here"))
        page.mouse.move(box["x"] + 5, box["y"] + box["height"] / 2)
        assert words(page, "here") == "point at the body for its name"
    page.select_option("#mode", "plain")
    assert words(page, "here") == ""


def test_sliders_change_the_picture(page):
    full = picture(page)
    slide(page, "stop", 0)
    rest = picture(page)
    assert differs(full, rest) > 0.01 and words(page, "stop-shown") == "0 kPa"
    slide(page, "stop", 3)
    assert words(page, "stop-shown") == "30 kPa" and words(page, "shown") == "design 2 at 30 kPa"
    slide(page, "design", 1)
    assert differs(picture(page), rest) > 0.002
    assert "at rest" in words(page, "stored") and "designs 0 and 2" in words(page, "stored")
    assert page.locator("#stop").is_disabled()
    slide(page, "design", 2)
    assert not page.locator("#stop").is_disabled()
    page.select_option("#task", "half")
    assert words(page, "shown") == "bending about y: 11.46° at 30 kPa"


def test_a_cut_is_a_solid_face(page):
    page.select_option("#mode", "plain")
    cut = picture(page)
    page.select_option("#cut-axis", "")
    assert differs(cut, picture(page)) > 0.02
    page.select_option("#cut-axis", "z")
    across = picture(page)
    page.locator("#cut-at").fill("3.5")
    assert differs(across, picture(page)) > 0.02


def test_the_start_is_a_ghost(page):
    before = picture(page)
    page.check("#ghost")
    assert differs(before, picture(page)) > 0.005
    page.uncheck("#ghost")
    assert differs(before, picture(page)) < 1e-3


def test_numbers_are_those_of_the_result(run, page):
    result = json.loads((run.path / "result.json").read_text(encoding="utf-8"))
    assert words(page, "title") == page.title() == result["title"]
    assert result["reason"] in words(page, "reason")
    for name, motion in result["motions"].items():
        assert f"{motion['value']:.2f}" in words(page, "tasks"), name
    rows = [row.locator("th, td").all_inner_texts() for row in page.locator("#limits tbody tr").all()]
    found = {row[0]: float(row[2].split()[0]) for row in rows}
    assert found == {"wall": 2.5, "fold": 2.0, "curvature": 0.1, "skew": 0.01, "stretch": 0.01, "margin": 1.5}
    assert f"{result['objective']:g}".replace("-", "−") in words(page, "design-facts")
    for version in filter(None, result["versions"].values()):
        assert version in words(page, "run")
    assert "Hei-Cast 8400" in words(page, "material") and "Section VIII" in words(page, "material")
    slide(page, "design", 0)
    assert "1.00 mm" in words(page, "tasks") and words(page, "of-design") == "design 0"
    page.locator("details:has(#problem) summary").click()
    assert words(page, "problem").strip() == (run.path / "problem.toml").read_text(encoding="utf-8").strip()


def test_a_click_on_a_diagram_chooses_a_design(page):
    page.locator("#plots svg").first.click(position={"x": 60, "y": 60})
    assert words(page, "design-shown") == "0 of 2"
    reading = page.locator("#plots figure:has-text('Limit: wall') output")
    assert reading.inner_text() == "2.5 mm (≥ 2)"


def test_keys(page):
    page.keyboard.press("[")
    assert words(page, "design-shown") == "1 of 2"
    page.locator("#design").focus()
    page.keyboard.press("ArrowRight")
    assert words(page, "design-shown") == "2 of 2"
    page.keyboard.press(",")
    assert words(page, "stop-shown") == "50 kPa"
    page.locator("#view").focus()
    before = picture(page)
    page.keyboard.press("ArrowLeft")
    turned = picture(page)
    assert differs(before, turned) > 0.01
    page.keyboard.press("0")
    assert differs(before, picture(page)) < 1e-3


def test_playing_ends_at_the_last(page):
    # The page itself takes note, as a slow machine may look only when all is played.
    page.evaluate("""() => { const place = document.getElementById("design-shown"); window.seen = new Set();
        new MutationObserver(() => window.seen.add(place.textContent)).observe(place, { childList: true }); }""")
    page.locator("#play-designs").click()
    page.wait_for_selector("#play-designs[aria-pressed=false]")
    assert page.evaluate("[...window.seen]") == ["0 of 2", "1 of 2", "2 of 2"]
    assert words(page, "design-shown") == "2 of 2"


def test_nets_as_a_table(run, page):
    with page.expect_download() as saved:
        page.get_by_role("button", name="Control nets of this design").click()
    rows = list(csv.DictReader(io.StringIO(saved.value.path().read_text(encoding="utf-8"))))
    net = [[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows if row["surface"] == "chamber_A"]
    stored = run.load_design(2).chambers["A"]
    np.testing.assert_allclose(np.reshape(net, stored.shape), stored, atol=0.6e-3)


def test_on_a_phone_and_in_the_dark(run, opened):
    phone = opened(run.path / "report.html", color_scheme="dark", device_scale_factor=2)
    phone.set_viewport_size({"width": 360, "height": 740})
    assert phone.evaluate("document.documentElement.scrollWidth") <= 360
    assert phone.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(17, 22, 27)"
    assert (picture(phone) < 0.97).any(axis=2).mean() > 0.03


def test_without_a_graphics_system_the_numbers_are_there(run, plain_browser, opened):
    page = opened(run.path / "report.html", browser=plain_browser)
    assert "cannot draw in three dimensions" in words(page, "no-view")
    assert "3.00 mm" in words(page, "tasks")
    slide(page, "design", 1)
    assert "2.00 mm" in words(page, "tasks")


def test_a_failed_run_of_one_design_with_a_nasty_title(tmp_path, opened):
    title = "<img src=x onerror=alert(1)></title><script>alert(2)</script>"
    problem = loads(tiny(title=json.dumps(title)))
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(problem, 0.0)})
    page = opened(write_report(run))
    assert words(page, "title") == page.title() == title
    assert "has not come to its end" in words(page, "reason")
    assert page.locator("#design").is_disabled() and not page.locator("#stop").is_disabled()
    assert page.complaints == [] and len(page.requests) == 1


def test_names_that_every_object_of_javascript_has(tmp_path, opened):
    """Of the run and of a study of it, whose member is called so too."""
    ball = '[[obstacle]]\nname = "hasOwnProperty"\nkind = "sphere"\ncenter = ["0 mm", "22 mm", "8 mm"]\n'
    text = tiny().replace('name = "extend"', 'name = "toString"').replace('name = "A"', 'name = "__proto__"')
    text = text.replace("{ A =", "{ __proto__ =") + ball + 'radius = "6 mm"\n[contact]\nself = false\n'
    problem = loads(text)
    run = waving_run(tmp_path / "study" / "constructor", problem, 2, {0: analysed(problem, 0.0)})
    for path in (write_report(run), write_study_page(tmp_path / "study", [run])):
        page = opened(path)
        assert page.complaints == []
        assert "toString" in page.content() and picture(page).std() > 0.01
        assert page.complaints == []


def test_obstacles_are_where_the_task_has_moved_them(tmp_path, opened):
    ball = '[[obstacle]]\nname = "ball"\nkind = "sphere"\ncenter = ["0 mm", "22 mm", "8 mm"]\nradius = "6 mm"\n'
    text = tiny() + ball + "[contact]\nself = false\n"
    problem = loads(text.replace("[[task]]", '[[task]]\nmove = { ball = ["0 mm", "0 mm", "9 mm"] }', 1))
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(problem, 0.0)})
    page = opened(write_report(run))

    def places():
        drawn = []
        for shown in (True, False):
            page.set_checked("#marks", shown)
            drawn.append(picture(page))
        # The ball is beside the body, where nothing else is marked.
        there = np.argwhere(np.abs(drawn[0] - drawn[1]).max(axis=2) > 0.05)
        return there[:, 0].mean(), len(there)

    moved, seen = places()
    slide(page, "stop", 0)
    resting, before = places()
    assert min(seen, before) > 2000
    assert resting - moved > 20
    assert page.complaints == []
