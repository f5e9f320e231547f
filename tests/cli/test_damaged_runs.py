"""Commands on runs with damaged files: what a command needs of them is refused in one line, what it does not is not."""

import shutil

import numpy as np
import pytest
from damage import PROBLEM, START, contents, damages, resumable_state, sound_run

from pneumorph.cli import view
from pneumorph.errors import ComputationError
from pneumorph.interface import pictures
from pneumorph.interface.design import Design
from pneumorph.mesh.tube import mesh_body
from pneumorph.results import Fields
from pneumorph.run import RunDirectory
from pneumorph.serve import live

STATE = resumable_state()
DAMAGES = damages(STATE)
COMMANDS = ("simulate", "view", "make", "draw body", "draw history", "draw profile", "draw evolution")
BEGUN = "it has begun"


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    mesh = mesh_body(START, PROBLEM.mesh.size).mesh
    u = mesh.points * np.array([-0.05, 0.0, 0.2])
    fields = Fields(mesh, {"extend": u}, {"extend": 1.0 + 0.01 * mesh.points[:, 2]})
    return sound_run(tmp_path_factory.mktemp("runs") / "sound", STATE, fields)


@pytest.fixture(scope="module")
def used():
    """Shares of the limits that designs use, by design."""
    return {}


@pytest.fixture
def brief(monkeypatch, drawn, used):
    """What takes long ends where it has begun, with a design that must be sound."""

    def begin(design, *_, **__):
        np.testing.assert_allclose(design.body.control_points(), START.control_points())
        assert design.pressures == {"extend": {"A": 0.06}}
        raise ComputationError(BEGUN)

    def serve(server):
        server.close()
        for each in server.runs:
            each._known = used
            if each.stamp() is not None:
                each.block()
                each.sweep(1)
        raise ComputationError(BEGUN)

    def save(picture, path):
        raise ComputationError(BEGUN)

    monkeypatch.setattr(Design, "prepare_simulation", begin)
    monkeypatch.setattr(Design, "make", begin)
    monkeypatch.setattr(view.Server, "serve_until_interrupted", serve)
    monkeypatch.setattr(live, "READINGS", 1)
    for name in ("saved", "saved_gif"):
        monkeypatch.setattr(pictures, name, save)


@pytest.mark.parametrize("name", DAMAGES)
def test_damage(name, sound, tmp_path, run, brief):
    shutil.copytree(sound.path, tmp_path / "run")
    spoiled = RunDirectory(tmp_path / "run", PROBLEM)
    DAMAGES[name](spoiled)
    before = contents(spoiled)
    # The others read no more of a checkpoint, and nothing of a result.
    for command in COMMANDS[: 2 if name.startswith(("state", "result")) else None]:
        word, *picture = command.split()
        folder = [] if word in ("simulate", "view") else ["--out", tmp_path / f"{command}.png"]
        ended = run(word, spoiled.path, *picture, *folder, *(["--no-browser"] if word == "view" else []))
        assert isinstance(ended.exception, SystemExit | None), (command, ended.exception)
        if BEGUN not in ended.stderr and ended.exit_code != 0:
            assert (ended.exit_code, ended.stderr.count("\n")) == (2, 1), (command, ended.output)
            assert ended.stderr.startswith("pneumorph: ")
    assert contents(spoiled) == before
