"""The page of a study: which runs are members, what they change, and how much of them is in the page."""

import pytest
from pages import blocks_of
from runs import analysed, ended, waving_run
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.output import study_page
from pneumorph.output.packed import unpack
from pneumorph.output.study_page import changed, member_paths, write_study_page
from pneumorph.problem import loads
from pneumorph.run import create, open_run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study of two members with designs and one that has not begun."""
    folder = tmp_path_factory.mktemp("studies") / "pressures"
    for name, pressure in (("low", "30 kPa"), ("high", "60 kPa")):
        problem = loads(tiny(pressure=f'{{ A = "{pressure}" }}'))
        ended(waving_run(folder / name, problem, 3, {0: analysed(problem, 0.0)}))
    create(folder / "waiting", loads(tiny()))
    return folder


def packed(path):
    return [unpack(block) for block in blocks_of(path)]


def test_every_member_is_in_the_page_with_what_it_changes(folder):
    members = [open_run(path) for path in member_paths(folder)]
    path = write_study_page(folder, members)
    found = {facts["member"]["name"]: facts for facts, _ in packed(path)}
    assert path == folder / "report.html" and list(found) == ["high", "low"]
    assert found["low"]["member"]["changes"] == {"task[0].pressure.A": "30 kPa"}
    assert found["low"]["member"]["without"] == ["waiting has no finished design."]
    assert len(found["high"]["history"]) == 3 and path.stat().st_size < 5e6
    assert found["low"]["member"]["title"] == folder.name
    titled = packed(write_study_page(folder, members, folder / "titled.html", title="Finger"))
    assert [facts["member"]["title"] for facts, _ in titled] == ["Finger", "Finger"]


def test_of_many_members_the_first_and_the_last_design_are_kept(folder, monkeypatch, tmp_path):
    monkeypatch.setattr(study_page, "MOST_WHOLE", 1)
    members = [open_run(path) for path in member_paths(folder)]
    path = write_study_page(folder, members, tmp_path / "page.html")
    for facts, arrays in packed(path):
        assert [entry["iteration"] for entry in facts["history"]] == [0, 2]
        assert len(arrays["net exterior"]) == 2


def test_a_study_without_designs_is_refused(tmp_path):
    run = create(tmp_path / "one", loads(tiny()))
    with pytest.raises(ProblemError, match="no member has a finished design yet"):
        write_study_page(tmp_path, [run])
    assert member_paths(run.path) == [] and member_paths(tmp_path / "none") == []


def test_only_what_differs_is_a_column():
    problems = [{"body.radius": "8 mm", "mesh.size": size, "title": size} for size in ("2 mm", "3 mm")]
    assert changed([*problems, {"body.radius": "8 mm"}]) == [{"mesh.size": "2 mm"}, {"mesh.size": "3 mm"}, {}]
