"""Files of a run that are whole but wrong, or not even whole."""

import io
import json
import os
import pickle
import struct
import zipfile

import numpy as np
from records import entry, one_element
from tiny import tiny

from pneumorph import atomic
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.run import StoredDesign, create
from pneumorph.run.complete import Outcome, result
from pneumorph.run.directory import _checkpoint_arrays as checkpoint_arrays

PROBLEM = loads(tiny())
START = starting_body(PROBLEM.tubes)


def resumable_state():
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


def sound_run(path, state, fields=None):
    """A run with two designs and a result, at a path."""
    run = create(path, PROBLEM)
    pressures = {"extend": {"A": 0.06}}
    for number in range(2):
        run.record(
            entry(number), StoredDesign.of(START, pressures), fields or one_element(), state | {"iteration": number}
        )
    run.write_result(result(PROBLEM, run.history(), Outcome("it is a test", True)))
    return run


def contents(run):
    """What is in every file of a run; of one that is too large to be read, its size."""
    files = [path for path in sorted(run.path.rglob("*")) if path.is_file() and path.name != ".lock"]
    return {path: size if (size := path.stat().st_size) > 10**9 else path.read_bytes() for path in files}


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


def many(value, where=0):
    """Put a value into an array."""

    def put(array):
        changed = np.array(array)
        changed.flat[where] = value
        return changed

    return put


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


def other(**changes):
    return tiny(**changes).encode()


PROBLEMS = {
    "empty": b"",
    "no TOML": b"[[[",
    "no text": b"\xff\xfe\x00",
    "a byte order mark": b"\xef\xbb\xbf" + PROBLEM.to_toml().encode(),
    "another body": other(length='"48 mm"'),
    "another net": other(control_density='"0.6 /mm"'),
    "another chamber": tiny().replace('"A"', '"B"').replace("A =", "B =").encode(),
    "another task": tiny().replace('"extend"', '"stretch"').encode(),
    "one task more": (
        tiny() + '[[task]]\nname = "more"\npressure = { A = "1 kPa" }\nobjective = { motion = "extension" }\n'
    ).encode(),
    "limits that it had not": (tiny() + '[limits]\nenvelope = { radius = "40 mm" }\n').encode(),
}

REPLACED = {
    "missing": lambda path: None,
    "a folder": lambda path: path.mkdir(),
    "a pipe": lambda path: os.mkfifo(path),
    "a link to itself": lambda path: path.symlink_to(path),
    "a link to a device": lambda path: path.symlink_to("/dev/zero"),
    "of a terabyte": lambda path: path.touch() or os.truncate(path, 10**12),
}

RESULTS = ["", "[]", "3", "null", '{"title": 3}', "9" * 5000, "[" * 100_000, "\ud800"]

FIELDS = [
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
    ("thickening extension twist", np.zeros(10), "of other tasks or motions"),
    ("thickening extension extend", np.zeros(9), "shape"),
]

OF_ARRAYS = ("designs/0001.npz", "fields/0001.npz", "checkpoint.npz")


def change_arrays(path, changed):
    """Put other arrays into a file."""
    with np.load(path) as stored:
        atomic.write_arrays(path, {**stored, **changed})


def change_state(state, name, change):
    """A state with an array changed, or without it."""
    return {key: value for key, value in state.items() if key != name} | (
        {} if change is None else {name: change(state[name])}
    )


def change_line(path, change):
    """Change the second line of a history."""
    first, second = path.read_text(encoding="utf-8").splitlines()
    path.write_text(f"{first}\n{json.dumps(change(json.loads(second)))}\n")


def damages(state):
    """What does all of this damage and more to a run, by its name; `state` is that of the sound one's checkpoint."""
    found = {}

    def arrays(file, **changed):
        return lambda run: change_arrays(run.path / file, changed)

    def content(file, data):
        return lambda run: (run.path / file).write_bytes(data)

    def moved(file, action):
        def spoil(run):
            (run.path / file).rename(run.path / ".away")
            action(run.path / file)

        return spoil

    for name, (changed, _) in DESIGNS.items():
        found[f"design: {name}"] = arrays("designs/0001.npz", **changed)
    for name, value, said in FIELDS:
        found[f"fields: {name}, {said}"] = arrays("fields/0001.npz", **{name: value})
    for name, changes in STATES.items():
        for number, (change, _) in enumerate(changes):
            stored = checkpoint_arrays(1, change_state(state | {"iteration": 1}, name, change))
            found[f"state: {name}, {number}"] = lambda run, stored=stored: atomic.write_arrays(
                run.path / "checkpoint.npz", stored
            )
    for name, (change, _) in LINES.items():
        found[f"history: {name}"] = lambda run, change=change: change_line(run.path / "history.jsonl", change)
    for text in RESULTS:
        found[f"result: {text[:9]!r}"] = content("result.json", text.encode("utf-8", errors="surrogatepass"))
    for name, (data, _) in ARCHIVES.items():
        found |= {f"{file}: {name}": content(file, data) for file in OF_ARRAYS}
    for name, data in PROBLEMS.items():
        found[f"problem: {name}"] = content("problem.toml", data)
    for file in (*OF_ARRAYS, "problem.toml", "history.jsonl", "result.json"):
        found |= {f"{file}: {name}": moved(file, action) for name, action in REPLACED.items()}
    return found
