"""Run directories whose files are whole but wrong: one line each, and nothing in them is changed."""

import json
import os
import shutil

import numpy as np
import pytest
from damage import (
    ARCHIVES,
    DESIGNS,
    FIELDS,
    LINES,
    NET,
    OF_ARRAYS,
    PROBLEM,
    RESULTS,
    START,
    STATES,
    change_arrays,
    change_line,
    change_state,
    contents,
    resumable_state,
    sound_run,
)
from records import entry, one_element
from refused import refusal
from tiny import tiny

from pneumorph import atomic
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.runs import open_run
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.results import Fields, checkpoint, unpack_fields
from pneumorph.run import RunDirectory, StoredDesign, resume


@pytest.fixture(scope="module")
def state():
    return resumable_state()


@pytest.fixture(scope="module")
def sound(tmp_path_factory, state):
    return sound_run(tmp_path_factory.mktemp("runs") / "sound", state)


@pytest.fixture
def run(sound, tmp_path):
    """A copy of it to be spoiled."""
    shutil.copytree(sound.path, tmp_path / "run")
    return RunDirectory(tmp_path / "run", PROBLEM)


def everything(run):
    """All that is read of a run, by whatever command."""
    opened = open_run(run.path)
    opened.design()
    for line in opened.history:
        opened.design(line.iteration)
    return opened.result, run.resumable()


def test_the_sound_one_is_read(run):
    ended, resumable = everything(run)
    assert ended.completed and resumable["iteration"] == 1


@pytest.mark.parametrize("name", DESIGNS)
def test_nets_and_pressures(run, name):
    changed, said = DESIGNS[name]
    path = run.path / "designs" / "0001.npz"
    change_arrays(path, changed)
    before = contents(run)
    message = refusal(everything, run)
    assert message.startswith(f"{path}: is damaged (") and said in message
    assert contents(run) == before


def test_a_missing_net(run):
    atomic.write_arrays(run.path / "designs" / "0001.npz", {"exterior": NET, "pressures": np.zeros((1, 1))})
    assert "'chamber_A' is missing" in refusal(everything, run)


def test_elements_that_are_inverted_while_straight_are_no_damage(state):
    """They may be sound with the curved edges that the body has, and that decides."""
    straight = state["mesh_straight"]
    mirrored = straight * [-1.0, 1.0, 1.0]
    checkpoint.check(PROBLEM, state | {"mesh_straight": mirrored, "mesh_fresh": straight})
    with pytest.raises(ValueError, match="without volume"):
        checkpoint.check(PROBLEM, state | {"mesh_fresh": mirrored})


@pytest.mark.parametrize(
    ("name", "change", "said"), [(name, *each) for name, changes in STATES.items() for each in changes]
)
def test_states_to_resume_from(state, name, change, said):
    spoiled = change_state(state, name, change)
    with pytest.raises((KeyError, ValueError)) as caught:
        checkpoint.check(PROBLEM, spoiled)
    assert said.split(" is missing")[0] in str(caught.value)


def test_a_wrong_state_is_said_with_its_file(run, state):
    run.record(
        entry(2), StoredDesign.of(START, {"extend": {"A": 0.06}}), one_element(), state | {"phi": np.zeros(0) / 1j}
    )
    assert "checkpoint.npz: is damaged (array phi.npy is neither numbers nor text)" in refusal(run.resumable)


@pytest.mark.parametrize("name", LINES)
def test_lines_of_the_history(run, name):
    change, said = LINES[name]
    path = run.path / "history.jsonl"
    change_line(path, change)
    before = contents(run)
    message = refusal(everything, run)
    assert message.startswith(f"{path}: is damaged (line 2: ") and said in message
    refusal(resume, run.path, PROBLEM)
    assert contents(run) == before, "resuming has replaced nothing"


@pytest.mark.parametrize(
    ("numbers", "said"), [((0, 0), "design 0 follows design 0"), ((0, 7), "is not in history.jsonl")]
)
def test_a_history_of_other_designs(run, numbers, said):
    path = run.path / "history.jsonl"
    lines = [json.loads(line) | {"iteration": number} for line, number in zip(path.open(), numbers, strict=True)]
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    assert said in refusal(everything, run)


@pytest.mark.parametrize("text", RESULTS)
def test_results(run, text):
    (run.path / "result.json").write_bytes(text.encode("utf-8", errors="surrogatepass"))
    message = refusal(everything, run)
    assert "result.json: is damaged" in message and "remove it and run with --resume" in message


@pytest.mark.parametrize(("name", "value", "said"), FIELDS)
def test_fields(run, name, value, said):
    path = run.path / "fields" / "0001.npz"
    change_arrays(path, {name: value})
    message = refusal(everything, run)
    assert message.startswith(f"{path}: is damaged (") and said in message


@pytest.mark.parametrize("name", ARCHIVES)
@pytest.mark.parametrize("file", OF_ARRAYS)
def test_archives(run, name, file):
    content, said = ARCHIVES[name]
    (run.path / file).write_bytes(content)
    message = refusal(everything, run)
    assert message.startswith(f"{run.path / file}: is damaged (") and said in message


def test_files_that_are_pipes_or_too_large(run):
    for file in ("designs/0001.npz", "fields/0001.npz", "checkpoint.npz", "history.jsonl", "result.json"):
        path = run.path / file
        whole = path.read_bytes()
        path.unlink()
        if hasattr(os, "mkfifo"):
            os.mkfifo(path)
            assert "it is a device or a pipe" in refusal(everything, run)
            path.unlink()
        with path.open("wb") as hollow:
            hollow.truncate(10**12)
        assert "it has more than" in refusal(everything, run)
        path.write_bytes(whole)
    everything(run)


def test_a_missing_checkpoint_beside_finished_designs(run):
    (run.path / "checkpoint.npz").unlink()
    before = contents(run)
    for action in (lambda: resume(run.path, PROBLEM), lambda: open_run(run.path).design(), lambda: run.resumable()):
        assert "has finished designs, but checkpoint.npz is missing; restore that file" in refusal(action)
    assert contents(run) == before
    (run.path / "result.json").unlink()
    (run.path / "designs" / "0001.npz").unlink()
    assert "checkpoint.npz is missing" in refusal(resume, run.path, PROBLEM), "the history has two lines"


@pytest.mark.parametrize("wrong", [("face chamber A", "face chamber A B"), ("face sector 3", "face mirror xz")])
def test_a_sector_with_faces_that_none_has(wrong):
    asked = loads(tiny().replace("[[body.chamber]]", "symmetry = { rotation = 3 }\n[[body.chamber]]"))
    mesh = mesh_body(starting_body(asked.tubes), 6.0, ("sector 3",)).mesh
    arrays = Fields(mesh, {}, {}).pack()
    assert unpack_fields(arrays).mesh.part == ("sector 3",)
    known, added = wrong
    arrays[added] = arrays[known]
    with pytest.raises(ValueError, match="no known sector"):
        unpack_fields(arrays)
