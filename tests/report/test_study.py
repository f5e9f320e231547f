"""The page of a study in a browser: sorted, filtered, one member in the large picture; and a body of ten chambers."""

import math

import pytest
from pages import differs, picture, words
from runs import analysed, ended, waving_run
from tiny import tiny

from pneumorph.output.report import write_report
from pneumorph.output.study_page import write_study_page
from pneumorph.problem import loads

TEN = "".join(
    f'[[body.chamber]]\nname = "C{number}"\nradius = "1 mm"\nspan = ["3 mm", "21 mm"]\n'
    f'center = ["{5 * math.cos(0.2 * math.pi * number):g} mm", "{5 * math.sin(0.2 * math.pi * number):g} mm"]\n'
    for number in range(10)
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studies") / "pressures"
    runs = []
    for name, pressure, designs in (("low", "30 kPa", 2), ("middle", "45 kPa", 4), ("high", "60 kPa", 3)):
        problem = loads(tiny(pressure=f'{{ A = "{pressure}" }}'))
        runs.append(waving_run(folder / name, problem, designs, {0: analysed(problem, 0.0)}))
    ended(runs[0])
    return write_study_page(folder, runs)


def members(page) -> list[str]:
    return page.locator("#member-table tbody th").all_inner_texts()


def test_members_are_sorted_filtered_and_chosen(study, opened):
    page = opened(study)
    assert page.title() == words(page, "title") == "pressures"
    assert members(page) == ["high", "low", "middle"] and words(page, "filtered") == "3 of 3"
    page.locator("#member-table thead button:text-is('designs')").click()
    assert members(page) == ["low", "high", "middle"]
    page.locator("#member-table thead button:text-is('designs')").click()
    assert members(page) == ["middle", "high", "low"]
    assert page.locator("#member-table th[aria-sort=descending]").inner_text().startswith("designs")
    assert [each.strip() for each in page.locator("#bodies figure b").all_inner_texts()] == members(page)
    before = picture(page)
    page.locator("#member-table tbody tr").first.click()
    assert words(page, "design-shown") == "3 of 3" and differs(before, picture(page)) > 0.002
    page.fill("#filter", "45 kPa")
    assert members(page) == ["middle"] and words(page, "filtered") == "1 of 3"
    assert page.locator("#bodies figure:visible").count() == 1
    page.fill("#filter", "nothing of this name")
    assert members(page) == [] and page.locator("#bodies figure:visible").count() == 0
    assert page.complaints == [] and len(page.requests) == 1


def test_every_member_is_drawn_also_on_a_phone(study, opened):
    page = opened(study, color_scheme="dark")
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    pictures = "[...document.querySelectorAll('#bodies canvas')].map((each) => each.toDataURL())"
    drawn = [page.evaluate(pictures)]
    # The page begins with the thickness, which may be drawn already.
    for mode in ("limits", "thickness"):
        page.select_option("#mode", mode)
        anew = f"(before) => {pictures}.every((each) => each.length > 3000 && !before.includes(each))"
        page.wait_for_function(anew, arg=drawn[-1], polling=200)
        drawn.append(page.evaluate(pictures))
    assert len({*drawn[1], *drawn[2]}) == 6


def test_ten_chambers(tmp_path, opened):
    pressures = ", ".join(f'C{number} = "{number + 1} kPa"' for number in range(10))
    head, tail = tiny(pressure=f"{{ {pressures} }}").split("[[body.chamber]]")
    rest = tail[tail.index("\n[") :]
    problem = loads(f"{head}{TEN}{rest}")
    assert len(problem.body.chamber) == 10
    run = waving_run(tmp_path / "ten", problem, 2, {0: analysed(problem, 0.0)})
    page = opened(write_report(run))
    assert words(page, "shown").startswith("design 1 at rest")
    page.locator("#design").fill("0")
    page.select_option("#task", "extend")
    assert "C0 1, C1 2, C2 3, C3 4, … kPa" in words(page, "stop-shown")
    for mode in ("thickness", "limits", "stretch", "plain"):
        page.select_option("#mode", mode)
        assert (picture(page) < 0.97).any(axis=2).mean() > 0.03
    assert page.complaints == []
    assert run.path.joinpath("report.html").stat().st_size < 5e6
