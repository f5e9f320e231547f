"""Commands on runs with damaged files: what a command needs of them is refused in one line, what it does not is not."""

import shutil

import numpy as np
import pytest
from brief import BEGUN, arguments, brief, commands_for
from damage import PROBLEM, START, contents, damages, resumable_state, sound_run

from pneumorph.mesh.tube import mesh_body
from pneumorph.results import Fields
from pneumorph.run import RunDirectory

STATE = resumable_state()
DAMAGES = damages(STATE)


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


@pytest.mark.parametrize("name", DAMAGES)
def test_damage(name, sound, tmp_path, run, used):
    shutil.copytree(sound.path, tmp_path / "run")
    spoiled = RunDirectory(tmp_path / "run", PROBLEM)
    DAMAGES[name](spoiled)
    before = contents(spoiled)
    for command in commands_for(name):
        with brief(used):
            ended = run(*arguments(command, spoiled.path, tmp_path))
        assert isinstance(ended.exception, SystemExit | None), (command, ended.exception)
        if BEGUN not in ended.stderr and ended.exit_code != 0:
            assert (ended.exit_code, ended.stderr.count("\n")) == (2, 1), (command, ended.output)
            assert ended.stderr.startswith("pneumorph: ")
    assert contents(spoiled) == before
