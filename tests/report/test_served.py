"""Runs as a server shows them in a browser: live, side by side, and at pressures that are set there."""

import json
import re
import shutil

import numpy as np
import pytest
from pages import differs, picture, serving, slide, solved, words
from runs import analysed, ended, line, waved, waving_run
from tiny import tiny

import pneumorph as pm
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads
from pneumorph.run import StoredDesign, create


@pytest.fixture(scope="module")
def served(run):
    """The address of the run with two tasks."""
    with serving(run.path) as address:
        yield address


def accept(run, number, pressures, fields):
    """Let a run accept one more design."""
    stored = StoredDesign.of(waved(starting_body(run.problem.tubes), 0.1 * number), pressures)
    run.record(line(run.problem, number, pressures), stored, fields, {})


def until(page, name, text):
    """Wait for an element to say something."""
    page.locator(f"#{name}", has_text=text).wait_for(state="attached")


def row(page, name) -> list[float]:
    """The numbers of a row of the state that is shown."""
    text = page.locator(f"#explored tr:has(th:text-is('{name}')) td").inner_text()
    return [float(number) for number in re.findall(r"-?\d+\.?\d*", text.replace("−", "-"))]


def test_it_opens_without_a_complaint_and_asks_its_server_alone(served, opened):
    page = opened(served)
    assert words(page, "title") == page.title() == "Tiny"
    assert words(page, "shown") == "extension: 3.00 mm at 60 kPa"
    assert (picture(page) < 0.97).any(axis=2).mean() > 0.03
    for _ in range(2):
        page.wait_for_event("response")  # it goes on asking what is new
    assert page.complaints == [] and all(request.startswith(served) for request in page.requests)
    assert not page.locator("#comparison").is_visible() and not page.locator("#runs").is_visible()
    assert not page.locator("#live").is_visible(), "the run has ended"


def test_a_run_appears_and_grows_without_a_reload(tmp_path, opened):
    problem = loads(tiny())
    fields, pressures = analysed(problem, 0.0), {"extend": {"A": 0.06}}
    run = create(tmp_path / "run", problem)
    with serving(run.path) as address:
        page = opened(address)
        assert "no design is finished yet" in words(page, "live") and not page.locator("main").is_visible()
        page.evaluate("window.before = 1")
        accept(run, 0, pressures, fields)
        until(page, "design-shown", "0 of 0")
        assert page.locator("#design").is_disabled()
        assert words(page, "live").startswith("Live")
        accept(run, 1, pressures, fields)
        until(page, "design-shown", "1 of 1")
        assert "2.00 mm" in words(page, "tasks")
        slide(page, "design", 0)
        accept(run, 2, pressures, fields)
        until(page, "design-shown", "0 of 2")
        assert "1.00 mm" in words(page, "tasks"), "who looks at another design keeps it"
        ended(run, "the computation failed: it is a test", completed=False)
        until(page, "reason", "failed")
        assert words(page, "reason") == "The run ended after design 2 because the computation failed: it is a test."
        assert not page.locator("#live").is_visible() and page.evaluate("window.before") == 1
        assert page.complaints == []


def test_a_damaged_run_is_said(tmp_path, opened):
    problem = loads(tiny())
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(problem, 0.0)})
    with serving(run.path) as address:
        page = opened(address)
        (run.path / "designs" / "0000.npz").write_bytes(b"no")
        (run.path / "history.jsonl").touch()
        until(page, "live", "is damaged")
        assert words(page, "shown") == "extension: 1.00 mm at 60 kPa", "what was there stays"


def test_a_server_that_is_gone_is_said(tmp_path, opened):
    problem = loads(tiny())
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(problem, 0.0)})
    with serving(run.path) as address:
        page = opened(address)
    until(page, "live", "cannot be reached")
    slide(page, "stop", 0)
    assert words(page, "shown") == "design 0 at 0 kPa"


def test_pressures_are_set_and_solved(run, served, opened):
    page = opened(served)
    stored = picture(page)
    page.select_option("#task", "*")
    solved(page, "A 60.000")
    first = picture(page)
    assert words(page, "shown") == "design 2 at 60 kPa" and not page.locator("#inflation").is_visible()
    assert differs(stored, first) < 1e-3, "the state of the task is what is stored of it"
    assert row(page, "tip moves, mm")[2] == 3.0 and not any(url.endswith("/state") for url in page.requests)
    slide(page, "chamber-0", 22.5)
    solved(page, "A 22.500")
    assert words(page, "shown") == "design 2 at 22.5 kPa" and differs(first, picture(page)) > 0.01
    (expected,) = pm.open_run(run.path).best.simulate({"A": "22.5 kPa"}).steps[:1]
    np.testing.assert_allclose(row(page, "tip moves, mm"), expected.translation, atol=0.005)
    np.testing.assert_allclose(row(page, "tip turns, °"), np.degrees(expected.rotation), atol=0.005)
    assert row(page, "largest stretch") == [pytest.approx(expected.max_stretch, abs=5e-4)]
    assert row(page, "chambers, mm³") == [pytest.approx(expected.volumes["A"], rel=1e-3)]
    assert page.locator("#explored").inner_text().endswith("yes") is expected.stable
    for mode in ("thickness", "limits", "displacement", "stretch"):
        page.select_option("#mode", mode)
        assert (picture(page) < 0.97).any(axis=2).mean() > 0.03
    page.select_option("#task", "extend")
    assert page.locator("#inflation").is_visible() and not page.locator("#explore").is_visible()
    assert differs(stored, picture(page)) < 1e-3
    assert page.complaints == []


def test_the_sweep_is_there_before_a_slider_moves(served, opened):
    page = opened(served)
    page.select_option("#task", "*")
    known = page.evaluate("""async () => { const headers = { "Content-Type": "application/json" };
        const given = { method: "POST", headers, body: "{}" };
        for (;;) {
            const told = await (await fetch("runs/0/designs/2/sweep", given)).json();
            if (told.left === 0) return told.known;
        } }""")
    found = sorted(each["A"] for each in known)
    assert set(np.round(found, 3)).issuperset([0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0])
    asked = len(page.requests)
    slide(page, "chamber-0", 40)
    solved(page, "A 40.000")
    assert words(page, "solving") == "" and len(page.requests) > asked


def test_the_last_of_many_positions_is_what_stays(served, opened):
    page = opened(served)
    page.select_option("#task", "*")
    solved(page, "A 60.000")
    asked = []
    for pressure in (5, 12, 31, 47, 66):
        with page.expect_request("**/state") as request:
            slide(page, "chamber-0", pressure)
        asked.append(request.value)
    solved(page, "A 66.000")
    for request in asked:
        request.response()  # the answers to the others have come, too
    picture(page)
    assert words(page, "shown") == "design 2 at 66 kPa" and row(page, "tip moves, mm")[2] > 0
    slide(page, "design", 0)
    solved(page, "A 66.000")
    assert words(page, "shown") == "design 0 at 66 kPa" and page.complaints == []


def test_where_nothing_is_found_the_reason_is_there(tmp_path, opened):
    problem = loads(tiny(pressure='{ A = "3000 kPa" }'))
    # Fields of a body that bears it, which this one does not.
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(loads(tiny()), 0.0)})
    with serving(run.path) as address:
        page = opened(address)
        page.select_option("#task", "*")
        # The task's own state is stored, and is not solved.
        solved(page, "A 3000.000")
        slide(page, "chamber-0", 3500)
        until(page, "explore-warnings", "no equilibrium found")
        assert "Nothing was found at 3500 kPa; shown is the state at 3000 kPa." in words(page, "solving")
        assert page.complaints == []


def test_sliders_are_those_of_the_run_that_is_shown(run, tmp_path, opened):
    """Another run's chamber of the same name has other bounds, and other pressures to begin at."""
    weaker = loads(tiny(pressure='{ A = "40 kPa" }'))
    other = waving_run(tmp_path / "other", weaker, 2, {0: analysed(weaker, 0.0)})
    with serving(run.path, other.path) as address:
        page = opened(address)
        slider = page.locator("#chamber-0")
        for tab, most in (("run", 60.0), ("other", 40.0), ("run", 60.0)):
            page.locator(f"#runs button:text-is('{tab}')").click()
            page.select_option("#task", "*")
            assert float(slider.input_value()) == pytest.approx(most)
            assert most < float(slider.get_attribute("max")) <= 1.3 * most
            slide(page, "chamber-0", most / 2)
        assert page.complaints == []


def test_two_runs_side_by_side(run, tmp_path, opened):
    other = waving_run(tmp_path / "other", loads(tiny(title='"Other"')), 2, {0: analysed(loads(tiny()), 0.0)})
    shutil.copytree(run.path, tmp_path / "run")
    with serving(tmp_path / "run", other.path) as address:
        page = opened(address)
        assert page.locator("#runs button").all_inner_texts() == ["run", "other"]
        captions = [figure.locator("span").inner_text() for figure in page.locator("#bodies figure").all()]
        assert captions[0].strip().startswith("design 2 of 2: extension 3.00 mm")
        assert any("design 1 of 1: extension 2.00 mm, at rest" in each for each in captions)
        drawn = "() => [...document.querySelectorAll('#bodies canvas')].map((canvas) => canvas.toDataURL().length)"
        page.wait_for_function(f"() => Math.min(...({drawn})()) > 3000")  # a picture of each
        rows = {
            each.locator("th").inner_text(): each.locator("td").all_inner_texts()
            for each in page.locator("#compared tbody tr").all()
        }
        assert rows["title"] == ["Tiny", "Other"] and rows["designs"] == ["2", "1"]
        assert rows["ended"] == ["it is a test", "not yet"]
        assert rows["task extend"] == ["extension 3.00 mm at 60 kPa", "extension 2.00 mm at 60 kPa"]
        assert rows["task half"][1] == "–"
        lines = page.locator("#compared-plots figure:has-text('Objective') path.line")
        assert lines.count() == 2
        # The other one into the large picture.
        before = picture(page)
        page.locator("#bodies figure").nth(1).click()
        assert words(page, "title") == page.title() == "Other" and words(page, "design-shown") == "1 of 1"
        assert differs(before, picture(page)) > 0.005
        accept(other, 2, {"extend": {"A": 0.06}}, analysed(loads(tiny()), 0.0))
        until(page, "design-shown", "2 of 2")
        assert page.locator("#compared tbody tr:has(th:text-is('designs')) td").all_inner_texts() == ["2", "2"]
        assert page.complaints == [] and json.dumps(page.requests).count("http://127.0.0.1") == len(page.requests)
