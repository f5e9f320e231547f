"""Run directories whose files are whole but wrong: one line each, and nothing in them is changed."""

import io
import json
import os
import pickle
import shutil
import struct
import zipfile

import numpy as np
import pytest
from records import entry, one_element
from tiny import tiny

from pneumorph import atomic
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.interface.runs import open_run
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.results import Fields, checkpoint, unpack_fields
from pneumorph.run import RunDirectory, StoredDesign, create, resume
from pneumorph.run.complete import Outcome, result

PROBLEM = loads(tiny())
START = starting_body(PROBLEM.body)


@pytest.fixture(scope="module")
def state():
    """All of a state to resume from but its equilibrium, which nothing here solves."""
    morph = mesh_body(START, PROBLEM.mesh.size)
    arrays = {"mesh_points": START.control_points(), "mesh_straight": morph.reference, "mesh_tets": morph.mesh.tets}
    arrays |= {f"mesh_B_{part}": getattr(morph.B, part) for part in ("data", "indices", "indptr")}
    arrays |= {f"face {name}": each for name, each in morph.mesh.faces.items()}
    arrays |= {f"param {name}": each for name, each in morph.param.items()}
    phi = build_design_space(PROBLEM, START).start
    return arrays | {
        "phi": phi, "state extend": np.zeros(9), "mesh_size": morph.size, "values": [-1.0], "radius": 1.0,
        "iteration": 1,
    }  # fmt: skip


@pytest.fixture(scope="module")
def sound(tmp_path_factory, state):
    """A run with two designs and a result."""
    run = create(tmp_path_factory.mktemp("runs") / "sound", PROBLEM)
    pressures = {"extend": {"A": 0.06}}
    for number in range(2):
        run.record(entry(number), StoredDesign.of(START, pressures), one_element(), state | {"iteration": number})
    run.write_result(result(PROBLEM, run.history(), Outcome("it is a test", True)))
    return run


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


def refusal(action, *arguments) -> str:
    with pytest.raises(ProblemError) as caught:
        action(*arguments)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable() and len(message) < 400
    return message


def contents(run):
    return {path: path.read_bytes() for path in sorted(run.path.rglob("*")) if path.is_file() and path.name != ".lock"}


def test_the_sound_one_is_read(run):
    ended, resumable = everything(run)
    assert ended.completed and resumable["iteration"] == 1


NET = START.exterior.net
DESIGNS = {
    "NaN": ({"exterior": np.where(NET > 5, np.nan, NET)}, "not finite"),
    "large": ({"exterior": 1e300 * NET}, "too large"),
    "zeros": ({"exterior": 0 * NET}, "lie in a plane"),
    "complex": ({"exterior": NET + 0j}, "neither numbers nor text"),
    "text": ({"exterior": NET.astype(str)}, "not of real numbers"),
    "a row less": ({"exterior": NET[1:]}, "has the shape"),
    "flat": ({"exterior": NET.ravel()}, "has the shape"),
    "another chamber": ({"chamber_A": NET}, "has the shape"),
    "pressures NaN": ({"pressures": np.array([[np.nan]])}, "not finite"),
    "pressures large": ({"pressures": np.array([[1e300]])}, "too large"),
    "pressures complex": ({"pressures": np.array([[0.06j]])}, "neither numbers nor text"),
    "pressures of more": ({"pressures": np.zeros((2, 3))}, "has the shape 2 × 3, not 1 × 1"),
    "one pressure": ({"pressures": np.array(0.06)}, "has the shape of one number"),
}


@pytest.mark.parametrize("name", DESIGNS)
def test_nets_and_pressures(run, name):
    changed, said = DESIGNS[name]
    path = run.path / "designs" / "0001.npz"
    with np.load(path) as stored:
        atomic.write_arrays(path, {**stored, **changed})
    before = contents(run)
    message = refusal(everything, run)
    assert message.startswith(f"{path}: is damaged (") and said in message
    assert contents(run) == before


def test_a_missing_net(run):
    atomic.write_arrays(run.path / "designs" / "0001.npz", {"exterior": NET, "pressures": np.zeros((1, 1))})
    assert "'chamber_A' is missing" in refusal(everything, run)


def many(value, where=0):
    """Put a value into an array."""

    def put(array):
        changed = np.array(array)
        changed.flat[where] = value
        return changed

    return put


def test_elements_that_are_inverted_while_straight_are_no_damage(state):
    """They may be sound with the curved edges that the body has, and that decides."""
    straight = state["mesh_straight"]
    mirrored = straight * [-1.0, 1.0, 1.0]
    checkpoint.check(PROBLEM, state | {"mesh_straight": mirrored, "mesh_fresh": straight})
    with pytest.raises(ValueError, match="without volume"):
        checkpoint.check(PROBLEM, state | {"mesh_fresh": mirrored})


STATES = {
    "mesh_tets": [(many(-1), "out of range"), (many(10**9), "out of range"), (many(0, slice(None)), "no element uses"),
                  (lambda a: a.astype(float), "whole numbers"), (lambda a: a[:, :9], "shape")],
    "mesh_straight": [(many(np.nan), "not finite"), (lambda a: 0 * a, "without volume"), (lambda a: a[:, :2], "shape")],
    "mesh_B_indices": [(many(-5), "out of range"), (many(10**8), "out of range"), (lambda a: a[1:], "shape")],
    "mesh_B_indptr": [(many(10**8, -1), "out of range"), (many(-1), "out of range"), (many(3), "does not fit"),
                      (lambda a: np.concatenate([a[:1], a[-2:0:-1], a[-1:]]), "falls"),
                      (lambda a: a[:1], "does not fit")],
    "mesh_B_data": [(many(np.inf), "not finite")],
    "mesh_points": [(many(np.nan), "not finite"), (lambda a: a[:5], "out of range")],
    "face exterior": [(many(10**9), "out of range"), (lambda a: a.ravel(), "shape")],
    "param exterior": [(many(7.0), "too large")],
    "phi": [(many(np.nan), "not finite")],
    "state extend": [(many(np.nan), "not finite"), (None, "'state extend' is missing")],
    "mesh_size": [(lambda _: np.nan, "not finite"), (lambda _: "2", "not of real numbers")],
    "values": [(lambda _: "none", "not of real numbers"), (None, "'values' is missing")],
    "iteration": [(lambda _: -1, "out of range"), (lambda _: 1.5, "whole numbers")],
    "radius": [(None, "'radius' is missing"), (lambda _: [1.0], "shape")],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "change", "said"), [(name, *each) for name, changes in STATES.items() for each in changes]
)
def test_states_to_resume_from(state, name, change, said):
    spoiled = {key: value for key, value in state.items() if key != name}
    if change is not None:
        spoiled[name] = change(state[name])
    with pytest.raises((KeyError, ValueError)) as caught:
        checkpoint.check(PROBLEM, spoiled)
    assert said.split(" is missing")[0] in str(caught.value)


def test_a_wrong_state_is_said_with_its_file(run, state):
    run.record(
        entry(2), StoredDesign.of(START, {"extend": {"A": 0.06}}), one_element(), state | {"phi": np.zeros(0) / 1j}
    )
    assert "checkpoint.npz: is damaged (array phi.npy is neither numbers nor text)" in refusal(run.resumable)


def without(key):
    return lambda line: {name: value for name, value in line.items() if name != key}


LINES = {
    "a list": (lambda line: [line], "is not what it should be"),
    "no number": (without("iteration"), "'iteration' is missing"),
    "no objective": (without("objective"), "'objective' is missing"),
    "no limit": (lambda line: line | {"limits": {}}, "'curvature' is missing"),
    "no seconds": (lambda line: line | {"seconds": {}}, "'total' is missing"),
    "another task": (lambda line: line | {"tasks": {"twist": line["tasks"]["extend"]}}, "are not those of the problem"),
    "tasks as a list": (lambda line: line | {"tasks": []}, '"tasks" is not what'),
    "text": (lambda line: line | {"objective": "1"}, '"objective" is not what'),
    "null": (lambda line: line | {"objective": None}, '"objective" is not what'),
    "infinite": (lambda line: line | {"objective": 1e300 * 1e300}, '"objective" is not what'),
    "large": (lambda line: line | {"dofs": 10**400}, '"dofs" is not what'),
    "no design": (lambda line: line | {"iteration": -7}, "it is of design -7"),
    "a part": (lambda line: line | {"iteration": 1.5}, '"iteration" is not what'),
}


@pytest.mark.parametrize("name", LINES)
def test_lines_of_the_history(run, name):
    change, said = LINES[name]
    path = run.path / "history.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([lines[0], json.dumps(change(json.loads(lines[1])))]) + "\n")
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


@pytest.mark.parametrize("text", ["", "[]", "3", "null", '{"title": 3}', "9" * 5000, "[" * 100_000, "\ud800"])
def test_results(run, text):
    (run.path / "result.json").write_bytes(text.encode("utf-8", errors="surrogatepass"))
    message = refusal(everything, run)
    assert "result.json: is damaged" in message and "remove it and run with --resume" in message


def fields(run):
    with np.load(run.path / "fields" / "0001.npz") as stored:
        return dict(stored)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("tets", np.full((1, 10), 10), "out of range"),
        ("tets", np.arange(10.0)[None], "whole numbers"),
        ("points", np.zeros((10, 3)), "without volume"),
        ("u extend", np.zeros((9, 3)), "shape"),
        ("u extend", np.full((10, 3), np.nan), "not finite"),
        ("u twist", np.zeros((10, 3)), "not of the same tasks"),
        ("stretch extend", np.zeros(3), "shape"),
        ("sag", np.zeros(3), "shape"),
        ("face mirror ab", np.zeros((1, 6), int), "no known plane"),
        ("inflation parts extend", np.zeros(2), "'inflation u extend' is missing"),
    ],
)
def test_fields(run, name, value, said):
    path = run.path / "fields" / "0001.npz"
    atomic.write_arrays(path, fields(run) | {name: value})
    message = refusal(everything, run)
    assert message.startswith(f"{path}: is damaged (") and said in message


def member(**changes):
    """The bytes of a zip archive with one stored member, whose entries are changed."""
    info = zipfile.ZipInfo("exterior.npy")
    path = io.BytesIO()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(info, b"xyz")
    data = bytearray(path.getvalue())
    # Offsets in the header of the member, and from there in that of the directory.
    places = {"flags": (6, 8, "<H"), "method": (8, 10, "<H"), "packed": (18, 20, "<I"), "unpacked": (22, 24, "<I")}
    directory = data.index(b"PK\x01\x02")
    for key, value in changes.items():
        local, central, kind = places[key]
        struct.pack_into(kind, data, local, value)
        struct.pack_into(kind, data, directory + central, value)
    return bytes(data)


def header(text: str) -> bytes:
    """The bytes of an archive with an array that has this header and three bytes."""
    content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode("latin-1") + b"abc"
    path = io.BytesIO()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("exterior.npy", content)
    return path.getvalue()


def packed() -> bytes:
    path = io.BytesIO()
    np.savez_compressed(path, exterior=np.zeros(1_000_000))
    return path.getvalue()


ARCHIVES = {
    "encrypted": (member(flags=1), "is encrypted"),
    "of an unknown compression": (member(method=97), "is compressed"),
    "compressed": (packed(), "it has more in it than its size"),
    "of 4 GB": (member(packed=0xFFFFFFF0, unpacked=0xFFFFFFF0), "it has more in it than its size"),
    "an object": (header("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }\n"), "neither numbers nor text"),
    "of 8 TB": (header("{'descr': '<f8', 'fortran_order': False, 'shape': (10**12,), }\n"), ""),
    "of 8 TB, written out": (
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }\n"),
        "has not the size of its shape",
    ),
    "of no size": (header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -3), }\n"), "not the size"),
    "of empty texts": (header("{'descr': '<U0', 'fortran_order': False, 'shape': (9999999999,), }\n"), "not the size"),
    "with a wrong header": (header("{'descr': 'x', 'shape': }\n"), ""),
    "a pickle": (pickle.dumps([1]), "is damaged"),
    "empty": (b"", "is damaged"),
}  # fmt: skip


@pytest.mark.parametrize("name", ARCHIVES)
@pytest.mark.parametrize("file", ["designs/0001.npz", "fields/0001.npz", "checkpoint.npz"])
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
    mesh = mesh_body(starting_body(asked.body), 6.0, ("sector 3",)).mesh
    arrays = Fields(mesh, {}, {}).pack()
    assert unpack_fields(arrays).mesh.part == ("sector 3",)
    known, added = wrong
    arrays[added] = arrays[known]
    with pytest.raises(ValueError, match="no known sector"):
        unpack_fields(arrays)
