"""Fast models of a body against its exact states, from the command; and the reader as a file of its own."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
import tiny as problems
from texts import problem_text
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.cli import app
from pneumorph.surrogate import reader
from pneumorph.surrogate.file import read_shape

TWO = """[end_effector]
kind = "plate"
[[task]]
name = "bend"
pressure = { A = "60 kPa", B = "60 kPa" }
objective = { kind = "maximize", motion = "bending_y" }
[mesh]
size = "6 mm"
"""


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_a_model_of_two_chambers(tmp_path):
    chambers = (("A", 1.6, "4 mm", "0 mm"), ("B", 1.6, "-4 mm", "0 mm"))
    text = problem_text(TWO, chambers=chambers, body='control_density = "0.3 /mm"')
    (tmp_path / "two.toml").write_text(text)
    (tmp_path / "other.toml").write_text(text.replace("4 mm", "4.1 mm"))
    result = run("model", tmp_path / "two.toml", "--tolerance", "0.5 %", "--sections", "2")
    assert result.exit_code == 0 and "random states that are not among them" in result.stdout
    path = tmp_path / "two.npz"
    model = reader.Model(path)
    assert len(model.outputs) == 6 + 2 + 12
    explorer = pm.starting_design(pm.load(tmp_path / "two.toml")).explorer()
    step = explorer.at({"A": 0.047, "B": 0.011}).step
    pose = model.pose({"A": 0.047, "B": 0.011})
    span = np.ptp([model.pose(p).translation for p in ([0.0, 0.0], [0.06, 0.0], [0.0, 0.06])], axis=0).max()
    assert np.abs(pose.translation - step.translation).max() < 0.005 * span
    assert model.volumes({"A": 0.047, "B": 0.011})["A"] == pytest.approx(step.volumes["A"], rel=1e-4)
    faces, modes = read_shape(path)
    exact = explorer.at({"A": 0.047, "B": 0.011}).fields.whole()
    look = modes.at(2.0 * np.array([0.047, 0.011]) / 0.06 - 1.0)
    np.testing.assert_allclose(faces.points, exact.mesh.points[exact.skin], atol=1e-9)
    off = np.linalg.norm(look[:, :3] - exact.u["bend"][exact.skin], axis=1)
    assert off.max() < 2 * model.errors["shape_mm"] < 0.01 * model.header["ranges"]["shape_mm"]
    assert np.abs(look[:, 3] + 1.0 - exact.stretch["bend"][exact.skin]).max() < 2 * model.errors["stretch"] < 0.02
    np.savez(tmp_path / "odd.npz", **{**np.load(path), "shape_modes": np.zeros((2, 3, 4))})
    with pytest.raises(reader.ModelError, match="the shapes in it are damaged"):
        read_shape(tmp_path / "odd.npz")
    result = run("model", tmp_path / "two.toml", "--check", path)
    assert result.exit_code == 0, result.output
    result = run("model", tmp_path / "other.toml", "--check", path)
    assert result.exit_code == 2 and "another body" in result.stderr and result.stderr.count("\n") == 1
    table, picture = tmp_path / "w.csv", tmp_path / "w.png"
    result = run("workspace", path, "--csv", table, "--png", picture, "--points", "500")
    assert result.exit_code == 0 and "surface of" in result.stdout and picture.stat().st_size > 1000
    assert len(table.read_text().splitlines()) == 501
    for options, words in [(("--bounds", "A=0:70kPa"), "beyond"), (("--bounds", "C=0:7kPa"), "no such chamber")]:
        result = run("workspace", path, *options)
        assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1
    # Another program has this one file alone.
    shutil.copy(reader.__file__, tmp_path / "alone.py")
    code = "import sys, alone; m = alone.Model('two.npz'); print(m.pose([0.047, 0.011]).translation[0]); "
    code += "print('pneumorph' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    first, second = said.stdout.split()
    assert float(first) == pytest.approx(pose.translation[0]) and second == "False"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--tolerance", "much"), "--tolerance"),
        (("--tolerance", "90 %"), "tolerance: "),
        (("--sections", "-1"), "sections: "),
        (("--out", "model.txt"), "model.txt"),
        (("--bounds", "B=0:60kPa"), "B: there is no such chamber"),
        (("--check", "none.npz"), "none.npz"),
    ],
)
def test_a_mistake_is_one_line(tmp_path, options, words):
    (tmp_path / "tiny.toml").write_text(problems.tiny(spring='{ axial = "4 N/mm" }'))
    result = run("model", tmp_path / "tiny.toml", *options)
    assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1


def test_chambers_that_are_left_out_are_named(tmp_path):
    chambers = (("A", 1.6, "4 mm", "0 mm"), ("B", 1.6, "-4 mm", "0 mm"))
    text = problem_text(TWO, chambers=chambers, body='control_density = "0.3 /mm"')
    (tmp_path / "two.toml").write_text(text.replace('B = "60 kPa"', 'B = "0 kPa"'))
    for bounds, named in (((), True), (("--bounds", "B=0:20kPa"), False)):
        # The name of the file is refused before anything is solved.
        result = run("model", tmp_path / "two.toml", "--out", tmp_path / "two.txt", *bounds)
        assert result.exit_code == 2 and ("no pressure in B, as in all tasks; --bounds B=" in result.stdout) is named
