"""What a study prints where there is no terminal, and what its summary says of designed pressures."""

import contextlib
import csv

import pytest
from records import entry, task_result
from runs import analysed, line, waving_run
from tiny import tiny

from pneumorph.cli import study as module
from pneumorph.study import load_study, write_summary
from pneumorph.study.members import MemberEnd
from pneumorph.study.summary import motions, summary

FREE = '{ A = { start = "20 kPa", min = "0 kPa", max = "60 kPa" } }'


@pytest.fixture
def study(tmp_path):
    """A study file of two members, beside its base problem."""
    (tmp_path / "base.toml").write_text(tiny(pressure=FREE))
    path = tmp_path / "study.toml"
    path.write_text('base = "base.toml"\n[grid]\n"end_effector.spring.axial" = ["0 N/mm", "1 N/mm"]\n')
    return path


@pytest.fixture
def no_cluster(monkeypatch):
    """Members that end after one design without any computation; the second fails."""

    def members(client, asked, folder, accepted):
        for number, (member, _) in enumerate(asked):
            accepted(member.name, line(member.problem, 1, {"extend": {"A": 0.02}}))
            yield MemberEnd(member.name, number == 0, "it was enough" if number == 0 else "it balloons")

    monkeypatch.setattr(module, "connected", lambda *_: contextlib.nullcontext())
    monkeypatch.setattr(module, "run_members", members)
    monkeypatch.setattr(module, "write_sheet", lambda asked, folder, names: folder / "sheet.png")


def test_progress_without_a_terminal(study, no_cluster, tmp_path, run):
    result = run("study", study, "--out", tmp_path / "out")
    assert result.exit_code == 1 and result.stderr.endswith("axial-1-N-mm: it balloons\n")
    lines = result.stdout.splitlines()
    assert lines[:4] == [
        "axial-0-N-mm: design 1, 2.00 mm, limits satisfied",
        "axial-0-N-mm: done: it was enough",
        "axial-1-N-mm: design 1, 2.00 mm, limits satisfied",
        "axial-1-N-mm: failed: it balloons",
    ]
    # A heading may take two lines.
    assert all(any(word in text for text in lines[4:]) for word in ("member", "extend extension", "(mm)", "time (s)"))
    assert not any("it was enough" in text for text in lines[4:]), "sentences are not in the table"
    assert result.stdout.endswith("sheet.png\n")


def test_a_quiet_study(study, no_cluster, tmp_path, run):
    result = run("study", study, "--out", tmp_path / "out", "--quiet")
    assert [text.split(" in ")[0] for text in result.stdout.splitlines()] == ["summary", "sheet"]


def test_changes_are_columns_of_numbers_with_units_in_the_headings(tmp_path):
    (tmp_path / "base.toml").write_text(tiny())
    (tmp_path / "study.toml").write_text(
        'base = "base.toml"\n[grid]\n"end_effector.spring.axial" = ["0 N/mm", "2.5 N/mm"]\n'
        '"end_effector.force" = [["0 N", "0 N", "1 N"]]\n"mesh.element" = ["auto"]\n'
    )
    rows = summary(load_study(tmp_path / "study.toml"), tmp_path / "out")
    assert [row["end_effector.spring.axial (N/mm)"] for row in rows] == [0.0, 2.5]
    assert [rows[0][f"end_effector.force[{k}] (N)"] for k in range(3)] == [0.0, 0.0, 1.0]
    assert rows[0]["mesh.element"] == "auto"


def test_the_summary_has_designed_pressures_and_stretch(study, tmp_path):
    asked = load_study(study)
    problem = asked.members[0].problem
    run = waving_run(tmp_path / "out" / "axial-0-N-mm", problem, 2, {0: analysed(problem, 0.0)})
    with write_summary(asked, tmp_path / "out").open() as file:
        first, second = csv.DictReader(file)
    last = run.history()[-1].tasks["extend"]
    assert float(first["extend pressure A (kPa)"]) == pytest.approx(1e3 * last.pressures["A"])
    assert float(first["extend stretch"]) == pytest.approx(last.max_stretch)
    assert second["extend stretch"] == ""


def test_motions_that_are_held_are_columns_beside_what_is_minimised(study, no_cluster, tmp_path, run):
    held = tiny(pressure=FREE, objective='{ kind = "minimize", of = "pressure" }')
    (tmp_path / "base.toml").write_text(held.replace("[mesh]", '[limits]\nat_least = { extension = "1 mm" }\n[mesh]'))
    result = run("study", study, "--out", tmp_path / "out")
    first = result.stdout.splitlines()[0]
    assert first.startswith("axial-0-N-mm: design 1, ") and ", extension 2.00 mm (at least 1 mm), limits" in first
    problem = load_study(study).members[0].problem
    own = {"extend": task_result(translation=(0.0, 0.0, 1.5), objective=40.0)}
    assert motions(problem, entry(1, tasks=own)) == {"extend pressure (kPa)": 40.0, "extend extension (mm)": 1.5}
