"""Pictures, pages and exports are written in place of links, not through them."""

import os

import pytest
from matplotlib.figure import Figure
from PIL import Image
from records import one_element
from runs import analysed, waving_run
from tiny import tiny

from pneumorph import atomic
from pneumorph.errors import ProblemError
from pneumorph.output.animation import save_gif
from pneumorph.output.export import export
from pneumorph.output.figures import save
from pneumorph.output.pictures import pictures_folder, run_pictures
from pneumorph.output.report import write_report
from pneumorph.output.report_data import _files as files_of
from pneumorph.problem import loads
from pneumorph.run import create
from pneumorph.study.members import finished

PROBLEM = loads(tiny())
WRITES = {
    "a.png": lambda path: save(Figure(), path),
    "a.svg": lambda path: save(Figure(), path),
    "a.gif": lambda path: save_gif(path, [(Image.new("RGB", (9, 9)), 0.1), (Image.new("RGB", (9, 9), "red"), 0.1)]),
    "a.vtu": lambda path: export(path, "vtu", PROBLEM, analysed(PROBLEM, 0.0), {"A": 0.06}),
    "a.3mf": lambda path: atomic.publish(path.parent / "made", path.parent),
}


@pytest.mark.parametrize("name", WRITES)
def test_files(tmp_path, name):
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "a.3mf").write_bytes(b"made")
    outside, path = tmp_path / "precious", tmp_path / name
    outside.write_bytes(b"precious")
    for link in (path, tmp_path / f".{name}.new", tmp_path / f"{name}.vtu"):
        link.symlink_to(outside)
    WRITES[name](path)
    assert outside.read_bytes() == b"precious"
    assert not path.is_symlink() and path.stat().st_size > 3


def test_members_of_studies(tmp_path):
    create(tmp_path / "elsewhere", PROBLEM)
    assert not finished(tmp_path / "elsewhere", PROBLEM)
    (tmp_path / "member").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ProblemError, match="member: is a link"):
        finished(tmp_path / "member", PROBLEM)


def test_what_links_lead_to_is_not_on_the_page(tmp_path):
    """Nor is a pipe waited for."""
    folder, outside = tmp_path / "make", tmp_path / "outside"
    for each in (folder, outside):
        each.mkdir()
        (each / "body.step").write_bytes(b"body")
    (folder / "key.step").symlink_to(outside / "body.step")
    (folder / "folder.step").mkdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.step")
    assert [each["name"] for each in files_of(folder)] == ["body.step"]
    (tmp_path / "link").symlink_to(outside)
    assert files_of(tmp_path / "link") == []


def test_folders(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    run = waving_run(tmp_path / "run", PROBLEM, 1, {0: one_element()})
    (run.path / ".report.html.new").symlink_to(outside / "file")
    (run.path / "report.html").symlink_to(outside / "file")
    write_report(run)
    (run.path / "pictures").symlink_to(outside)
    for action in (pictures_folder, run_pictures):
        with pytest.raises(ProblemError, match="pictures is a link"):
            action(run)
    (tmp_path / "made" / "mould").mkdir(parents=True)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "mould").symlink_to(outside)
    (tmp_path / "made" / "mould" / "a.3mf").write_bytes(b"made")
    with pytest.raises(NotADirectoryError, match="mould is a link"):
        atomic.publish(tmp_path / "made", tmp_path / "folder")
    assert list(outside.iterdir()) == []
