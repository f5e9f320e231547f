"""Files that no body can be made of: each is refused in a line, in bounded memory, by one process for all of them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from solids import box, occ, problem, written

from pneumorph.cad.read import MOST_FACES

READ = """
import json, sys
from pathlib import Path
from pneumorph.errors import ProblemError
from pneumorph.problem import loads
texts = json.load(open(sys.argv[1]))
said = {}
for name, text in texts.items():
    try:
        loads(text, folder=Path(sys.argv[1]).parent)
    except ProblemError as error:
        said[name] = str(error)
print(json.dumps(said))
"""
"""What refuses the problems in a file of JSON, by their names."""

GIBIBYTES = 4
FACES = 100_000


def ball(radius, count):
    """Points and triangles of a ball, about 2 count² of them."""
    turns, falls = np.linspace(0, 2 * np.pi, count, endpoint=False), np.linspace(0, np.pi, count + 1)[1:-1]
    rings = [radius * np.column_stack([np.sin(v) * np.cos(turns), np.sin(v) * np.sin(turns), np.full(count, np.cos(v))])
             for v in falls]  # fmt: skip
    points = np.concatenate([*rings, [[0, 0, radius], [0, 0, -radius]]])
    k, after = np.arange(count), np.roll(np.arange(count), -1)
    last = count * (len(falls) - 1)
    found = [np.column_stack([np.full(count, len(points) - 2), k, after])]
    for row in range(len(falls) - 1):
        here, below = count * row, count * (row + 1)
        found.append(np.column_stack([here + k, below + k, here + after]))
        found.append(np.column_stack([here + after, below + k, below + after]))
    found.append(np.column_stack([last + after, last + k, np.full(count, len(points) - 1)]))
    return points, np.concatenate(found)


def write_stl(path, points, triangles):
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(triangles), record)
    records["corners"] = points[triangles]
    path.write_bytes(bytes(80) + np.array([len(triangles)], "<u4").tobytes() + records.tobytes())


def write_obj(path, points, triangles):
    lines = [*(f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in points.tolist()),
             *(f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist())]  # fmt: skip
    path.write_text("\n".join(lines), encoding="ascii")


def hollow(lower, upper, wall=2.0):
    """A block with a closed void."""
    inner = np.array(lower) + wall, np.array(upper) - wall
    return box(lower, upper) - box(*inner)


def made(folder: Path):
    """Write all files and return what has to be said of each."""
    many = ball(20.0, 225)
    assert len(many[1]) > FACES
    write_stl(folder / "many.stl", *many)
    write_obj(folder / "many.obj", *many)
    # Some programs write a blank before the parenthesis.
    for name, face in (("many", "ADVANCED_FACE("), ("blanks", "ADVANCED_FACE ( "), ("surfaces", "FACE_SURFACE(")):
        (folder / f"{name}.step").write_text(f"#1 = {face}'',(#2),#3,.T.);\n" * FACES)
    (folder / "many.brep").write_text("DBRep_DrawableShape\n" + "Fa\n0  1e-07 1 0\n" * FACES)
    # Two parts that touch in an edge alone, and parts in one another.
    written(occ().Compound([hollow((0, 0, 0), (9, 9, 20)), hollow((9, 9, 0), (18, 18, 20))]), folder / "edge.step")
    written(hollow((0, 0, 0), (9, 9, 20)).Scale(occ().Pnt(0, 0, 0), 1e-3), folder / "metres.step")
    written(hollow((0, 0, 0), (9, 9, 20)).Scale(occ().Pnt(0, 0, 0), 1e3), folder / "large.step")
    parts = [hollow((12 * k, 12 * m, 0), (12 * k + 9, 12 * m + 9, 20)) for k in range(5) for m in range(5)]
    written(occ().Compound(parts), folder / "assembly.step")
    for name in ("text.step", "text.brep", "text.stl", "text.obj", "text.3mf"):
        (folder / name).write_text("Dear colleague,\n\nthe file is attached.\n" * 200)
    (folder / "noise.step").write_bytes(np.random.default_rng(0).bytes(200_000))
    cut = written(hollow((0, 0, 0), (9, 9, 20)), folder / "whole.step").read_bytes()
    (folder / "half.step").write_bytes(cut[: len(cut) // 2])
    return {
        "many.stl": "more than",
        "many.obj": "more than",
        **{f"{name}.step": f"{FACES} faces, more than {MOST_FACES}" for name in ("many", "blanks", "surfaces")},
        "many.brep": f"{FACES} faces, more than {MOST_FACES}",
        "edge.step": "more than two faces meet",
        "metres.step": "scale = 1000",
        "large.step": "scale = 0.001",
        "assembly.step": "second body at",
        **{f"text.{form}": "again" for form in ("step", "brep", "stl", "obj", "3mf")},
        "noise.step": "again",
        "half.step": "again",
    }


NAMES = (
    *("many.stl", "many.obj", "many.step", "blanks.step", "surfaces.step", "many.brep", "edge.step", "metres.step"),
    *("large.step", "assembly.step", "text.step", "text.brep", "text.stl", "text.obj", "text.3mf", "noise.step"),
    "half.step",
)


@pytest.fixture(scope="module")
def refused(tmp_path_factory):
    """What has to be said, what is said, and the largest memory that the process or one of its children took, bytes."""
    folder = tmp_path_factory.mktemp("hard")
    expected = made(folder)
    texts = folder / "texts.json"
    texts.write_text(json.dumps({name: problem(name, size="3 mm") for name in expected}))
    process = subprocess.Popen([sys.executable, "-c", READ, str(texts)], stdout=subprocess.PIPE, encoding="utf-8")
    said = json.loads(process.stdout.read() or "{}")
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return expected, said, 1024 * usage.ru_maxrss


@pytest.mark.parametrize("name", NAMES)
def test_a_file_is_refused_in_a_line(refused, name):
    expected, said, _ = refused
    assert set(expected) == set(NAMES)
    assert name in said, "it was taken for a body"
    assert expected[name] in said[name]
    assert "\n" not in said[name] and len(said[name]) <= 300
    assert "body.file" in said[name]


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in other units there")
def test_all_of_them_take_little_memory(refused):
    assert refused[2] < GIBIBYTES << 30
