"""`pneumorph make`: the files of a run's design, and one line for whatever is wrong."""

import json
import os
import sys

import pytest
from records import entry, one_element

from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import load
from pneumorph.run import StoredDesign, create


@pytest.fixture
def designs(tiny, tmp_path):
    """A run directory with designs 0 and 1, the second a millimetre wider."""
    problem = load(tiny)
    directory = create(tmp_path / "run", problem)
    start = starting_body(problem.tubes)
    pressures = {task.name: {"A": 0.06} for task in problem.task}
    for number, factor in enumerate((1.0, 9.0 / 8.0)):
        body = start.with_control_points(start.control_points() * [factor, factor, 1.0])
        directory.record(entry(number), StoredDesign.of(body, pressures), one_element(), {})
    return directory.path


def test_the_last_design_is_made(run, designs):
    pytest.importorskip("pneumorph.make", reason="needs the extra cad")
    result = run("make", designs)
    assert result.exit_code == 0, result.output
    assert "FAILED" not in result.output and "volume error" in result.output
    names = {"body.step", "chamber_A.step", "body.3mf", "body.stl", "checks.json", "mould"}
    assert {path.name for path in (designs / "make").iterdir()} == names
    checks = json.loads((designs / "make" / "checks.json").read_text(encoding="utf-8"))["checks"]
    (effect,) = (check for check in checks if "tubes in the ports" in check["what"])
    assert 0.0 < effect["value"] < 0.05


def test_another_design_elsewhere(run, designs, tmp_path, monkeypatch):
    make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")
    # It takes most of the time, and is made for every design alike.
    monkeypatch.setattr("pneumorph.make.files.make_mould", lambda *_: ((), ()))
    result = run("make", designs, "--design", 0, "--out", tmp_path / "there", "--chord", "0.1 mm")
    assert result.exit_code == 0, result.output
    part = make.read_stl(tmp_path / "there" / "body.stl")
    assert part.points[:, 0].max() == pytest.approx(8.0, abs=0.1)
    assert not (designs / "make").exists()


def refused(result, words):
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("pneumorph: ") and result.stderr.count("\n") == 1
    assert words in result.stderr


def test_bad_input(run, designs, tiny, tmp_path):
    refused(run("make", tmp_path / "none"), "is not a run directory")
    refused(run("make", tiny), "is not a run directory")
    refused(run("make", designs, "--design", 2), "has designs 0 to 1 only")
    refused(run("make", designs, "--chord", "0.02"), "--chord")
    refused(run("make", designs, "--chord", "0 mm"), "--chord")
    refused(run("make", create(tmp_path / "new", load(tiny)).path), "no finished design")


def test_a_folder_that_cannot_be(run, designs, tmp_path, monkeypatch):
    pytest.importorskip("pneumorph.make", reason="needs the extra cad")
    from pneumorph.make.files import MadeFiles

    def quick(body, folder, *rest):
        (folder / "body.step").write_bytes(b"")
        return MadeFiles((folder / "body.step",), ())

    monkeypatch.setattr("pneumorph.make.files._make", quick)
    (tmp_path / "file").write_text("in the way")
    refused(run("make", designs, "--out", tmp_path / "file"), "cannot be written")
    refused(run("make", designs, "--out", tmp_path / "file" / "below"), "cannot be written")
    folder = tmp_path / "taken"
    (folder / "body.step").mkdir(parents=True)
    refused(run("make", designs, "--out", folder), "cannot be written")
    if os.name == "posix" and os.geteuid():
        folder.chmod(0o500)
        refused(run("make", designs, "--out", folder), "cannot be written")


def test_without_the_extra_one_line_says_how_it_is_installed(run, designs, monkeypatch):
    for module in ("pneumorph.make", "pneumorph.make.libraries"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr("pneumorph.extras.find_spec", lambda name: None)
    refused(run("make", designs), "pip install 'pneumorph[cad]'")
