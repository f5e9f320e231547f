"""The independent check of stored states finds what goes through itself or through an obstacle."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tiny import tiny

from pneumorph.cad import stl
from pneumorph.verify.solids import tube

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "interpenetration.py"
MESH = tube(4, 6, 20, (1, 12, 4))
X = MESH.points
WALL = '[[obstacle]]\nname = "o"\nkind = "plane"\npoint = ["0 mm", "0 mm", "24 mm"]\nnormal = [0, 0, -1]\n'
BALL = '[[obstacle]]\nname = "o"\nkind = "sphere"\ncenter = ["{x} mm", "0.3 mm", "7.3 mm"]\nradius = "0.5 mm"\n'
BOX = '[[obstacle]]\nname = "o"\nkind = "box"\ncenter = ["8 mm", "0 mm", "10 mm"]\nsize = ["3 mm", "3 mm", "3 mm"]\n'
CORNERS = np.array([[-1.5, -1.5, -1.5], [1.5, -1.5, -1.5], [0.0, 1.5, -1.5], [0.0, 0.0, 1.5]])
SURFACE = stl.pack(stl.Surface(CORNERS, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])))
TETRAHEDRON = (
    f'[[obstacle]]\nname = "o"\nkind = "mesh"\ntriangles = "{SURFACE}"\nscale = 1.0\n'
    'rotation = ["0 deg", "0 deg", "90 deg"]\nposition = ["7.9 mm", "0 mm", "10 mm"]\n'
)
FLAT = X * [1.0, 0.02, 1.0] - X


def pushed(by):
    """The inner surface through the outer one, on one side."""
    u = np.zeros(X.shape)
    inside = (np.linalg.norm(X[:, :2], axis=1) < 4.1) & (X[:, 0] > 3.0) & (np.abs(X[:, 2] - 10) < 4)
    u[inside, 0] = by
    return u


CASES = {
    "nothing": ("", WALL, FLAT, ""),
    "a wall": ("", WALL, X * [0, 0, 0.3], "goes through o"),
    "a wall that is moved": ('move = { o = ["0 mm", "0 mm", "-5 mm"] }', WALL, 0 * X, "goes through o"),
    "a ball beside the body": ("", BALL.format(x=7), 0 * X, ""),
    "a ball between the nodes": ("", BALL.format(x=5), 0 * X, "goes through o"),
    "a box": ("", BOX, 0 * X + [0.6, 0, 0], "goes through o"),
    "beside triangles": ("", TETRAHEDRON, 0 * X, ""),
    "triangles": ("", TETRAHEDRON, 0 * X + [0.7, 0, 0], "goes through o"),
    "itself": ("", "", pushed(3.0), "triangles intersect"),
}


@pytest.mark.parametrize("name", CASES)
def test_what_interpenetrates_is_found(name, tmp_path):
    task, obstacle, u, wrong = CASES[name]
    text = tiny().replace('name = "extend"', f'name = "extend"\n{task}')
    (tmp_path / "problem.toml").write_text(text + "[contact]\nself = true\n" + obstacle, encoding="utf-8")
    (tmp_path / "fields").mkdir()
    faces = {f"face {key}": triangles for key, triangles in MESH.faces.items()}
    arrays = {"points": X, "u extend": u, **faces}
    np.savez(tmp_path / "fields" / "0000.npz", **arrays)
    found = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, encoding="utf-8")
    assert found.returncode == (1 if wrong else 0), found.stdout + found.stderr
    assert (wrong or "nothing interpenetrates") in found.stdout
