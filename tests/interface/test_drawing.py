"""Pictures of runs that are asked for: which design, cut and format, also of runs that were stopped."""

import json
import re

import numpy as np
import pytest
from PIL import Image
from runs import inflated, waving_run
from tiny import tiny
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.cli import app
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface import design as module
from pneumorph.mesh.tube import mesh_body
from pneumorph.output import render
from pneumorph.problem import loads
from pneumorph.results import Fields, to_json

DESIGNS = 3


@pytest.fixture(scope="module")
def fields():
    """A body that is pulled out."""
    mesh = mesh_body(starting_body(loads(tiny()).body), 6.0).mesh
    u = mesh.points * np.array([-0.05, 0.0, 0.2])
    return Fields(mesh, {"extend": u}, {"extend": 1.0 + 0.01 * mesh.points[:, 2]})


@pytest.fixture
def run(tmp_path, fields):
    directory = waving_run(tmp_path / "run", loads(tiny()), DESIGNS, {0: fields, DESIGNS - 1: inflated(fields)})
    return pm.open_run(directory.path)


def command(*arguments):
    return CliRunner().invoke(app, ["draw", *map(str, arguments)])


def test_pictures_have_names_of_what_they_show(run, drawn):
    asked = [
        ({}, "body.png"),
        ({"design": 0, "cut": "yz", "format": "pdf"}, "body_0_yz.pdf"),
        ({"cut": "xy", "at": "7 mm", "format": "svg"}, "body_xy_7mm.svg"),
        ({"picture": "history", "format": "svg"}, "history.svg"),
        ({"picture": "profile", "design": 1}, "profile_1.png"),
        ({"picture": "evolution", "cut": "yz"}, "evolution_yz.gif"),
        ({"picture": "inflation"}, "inflation.gif"),
    ]
    begins = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml", "gif": b"GIF89a"}
    for arguments, name in asked:
        path = run.draw(**arguments)
        assert path == run.path / "pictures" / name
        assert path.read_bytes().startswith(begins[path.suffix[1:]])
    views = [[str(panel.view) for panel in job.panels] for job in drawn]
    assert views == [
        ["cut xz"] * 2, ["cut yz"] * 2, ["cut xy at z = 7 mm"] * 2, ["cut yz"] * DESIGNS, ["cut xz"] * 7
    ]  # fmt: skip
    with Image.open(run.path / "pictures" / "evolution_yz.gif") as moving:
        assert moving.n_frames == DESIGNS
    text = (run.path / "pictures" / "body_xy_7mm.svg").read_text(encoding="utf-8")
    words = [" ".join(comment.split()) for comment in re.findall("<!--(.*?)-->", text, re.DOTALL)]
    assert "Tiny, design 2" in words and "at rest cut xy at z = 7 mm" in " ".join(words)


def test_what_is_not_stored_is_computed(run, drawn, fields, monkeypatch):
    """The fields of a design in the middle, and how the first inflates."""
    asked = []
    monkeypatch.setattr(
        module.Design, "_computed", lambda self, inflated=False: (asked.append((self.iteration, inflated)), fields)[1]
    )
    run.draw(design=1)
    run.draw("inflation", design=0)
    run.draw("inflation")
    assert asked == [(1, False), (0, True)]


def test_a_run_that_was_stopped_while_it_stored_a_design(run, drawn):
    """The history has one line more than there are designs."""
    (run.path / "designs" / f"{DESIGNS:04d}.npz").unlink(missing_ok=True)
    last = to_json(run.history[-1]) | {"iteration": DESIGNS}
    with (run.path / "history.jsonl").open("a") as file:
        file.write(json.dumps(last) + "\n")
    assert run.result is None
    for picture in ("body", "history", "profile", "evolution"):
        assert run.draw(picture).stat().st_size > 1000
    assert len(drawn[-1].panels) == DESIGNS
    result = command(run.path, "all")
    assert result.exit_code == 0, result.output
    assert "history.png|pdf|svg" in result.output and "evolution.gif, inflation.gif" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"picture": "portrait"}, '"portrait" is none; use one of body, history'),
        ({"cut": "zz"}, '"zz" is not a plane; use one of yz, xz, xy, none'),
        ({"at": "3 mm"}, "give cut too"),
        ({"cut": "none", "at": "3 mm"}, "there is no cut"),
        ({"cut": "xy", "at": "3"}, "has no unit"),
        ({"design": 9}, "has designs 0 to 2 only"),
        ({"task": "bend"}, 'no task "bend"; use one of extend'),
        ({"format": "gif"}, "use png or pdf or svg"),
        ({"picture": "evolution", "format": "pdf"}, "use gif"),
        ({"picture": "evolution", "design": 1}, "design: means nothing for the picture evolution"),
        ({"picture": "history", "cut": "yz"}, "cut: means nothing for the picture history"),
        ({"picture": "pressures"}, "all pressures of this problem are fixed"),
        ({"picture": "shape"}, "no task has a target"),
        ({"path": "a.bmp"}, '"bmp" is not a format'),
        ({"path": "a.png", "format": "pdf"}, "its suffix is not pdf"),
    ],
)
def test_refusals(run, drawn, arguments, words):
    with pytest.raises(ProblemError, match=words):
        run.draw(**arguments)
    assert not drawn and not (run.path / "pictures").exists()


def test_the_command(run, drawn, tmp_path):
    out = tmp_path / "deep" / "picture.pdf"
    result = command(run.path, "--design", 0, "--cut", "yz", "--at", "2 mm", "--format", "pdf", "--out", out)
    assert result.exit_code == 0, result.output
    assert out.read_bytes().startswith(b"%PDF") and "picture.pdf" in result.output
    assert str(drawn[0].panels[0].view) == "cut yz at x = 2 mm"
    refused = command(run.path, "all", "--cut", "yz")
    assert refused.exit_code == 2 and "--cut: means nothing for all pictures" in refused.stderr
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "problem.toml").write_text(tiny())
    for arguments in ((), ("all",), ("history",)):
        refused = command(tmp_path / "empty", *arguments)
        assert refused.exit_code == 2 and "no finished design" in refused.stderr
    (tmp_path / "file").write_text("")
    refused = command(run.path, "history", "--out", tmp_path / "file" / "picture.png")
    assert refused.exit_code == 2 and "cannot be written" in refused.stderr and refused.stderr.count("\n") == 1


def test_a_machine_that_cannot_draw(run, monkeypatch):
    monkeypatch.setattr(render, "CHILD", "import os; os.abort()")
    with pytest.raises(ComputationError, match="VTK cannot draw off-screen here"):
        run.draw()
    result = command(run.path, "all")
    assert result.exit_code == 1 and "cannot draw off-screen" in result.stderr
    assert run.draw("profile").exists()
