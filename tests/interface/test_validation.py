"""A curve of one's own beside the prediction of a body, and what is refused."""

import numpy as np
import pytest
from texts import problem_text
from typer.testing import CliRunner

from pneumorph.cli import app
from pneumorph.interface.design import starting_design
from pneumorph.problem import load, loads

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

TASK = '[[task]]\nname = "extend"\npressure = { A = "40 kPa" }\nobjective = { motion = "extension" }\n'


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "tube.toml"
    path.write_text(loads(problem_text(TASK)).with_changes({"mesh.size": "8 mm"}).to_toml())
    return path


def test_the_prediction_has_the_values_and_deviations_of_the_design(source, tmp_path):
    curve, out = tmp_path / "curve.csv", tmp_path / "out"
    curve.write_text("pressure_kPa,extension_mm\n40,0.15\n0,0\n20,0.07\n40,0.17\n")
    done = CliRunner().invoke(
        app, ["validate", str(source), "--measured", str(curve), "--tolerance", "rubber=5 %", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    assert {path.name for path in out.iterdir()} >= {"table.md", "points.csv"} and len(list(out.glob("*.png"))) == 1
    design = starting_design(load(source))
    (one,) = design.validate(curve, rubber="5 %").comparisons
    np.testing.assert_allclose(one.at, [0.0, 20.0, 40.0])
    np.testing.assert_allclose(one.measured, [0.0, 0.07, 0.16])
    np.testing.assert_allclose(one.scatter, [0.0, 0.0, 0.02 / np.sqrt(2)])
    scatter = design.tolerance(rubber="5 %").tasks["extend"]
    assert one.predicted[2] == pytest.approx(scatter.motion[2], rel=1e-4)
    assert one.error[2] == pytest.approx(scatter.deviations[2], rel=1e-3)


def test_a_force_is_compared_where_its_motion_is_held(source, tmp_path):
    """Held at rest, as the task does not hold it; it is that of a sweep with the same motion blocked."""
    curve = tmp_path / "curve.csv"
    curve.write_text("pressure_kPa,push_extension_N\n0,0\n20,0.5\n40,1\n")
    design = starting_design(load(source))
    (one,) = design.validate(curve, rubber="5 %").comparisons
    assert one.quantity == "force against extension" and one.unit == "N"
    swept = design.simulate({"A": "0:40:20 kPa"}, block="axial")
    np.testing.assert_allclose(one.predicted, [step.reaction["axial"] for step in swept.steps], rtol=1e-3, atol=1e-6)
    assert (one.error[1:] > 0.02 * one.predicted[1:]).all()


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["chair"], "balloon, beam, disc"),
        (["beam", "--task", "extend"], "--measured"),
        (["beam", "disc", "--measured", "none.csv"], "one body"),
        (["beam", "--measured", "none.csv", "--tolerance", "rubber"], "rubber=5 %"),
        (["beam", "--measured", "none.csv", "--quick"], "--quick"),
    ],
)
def test_what_contradicts_is_refused_in_a_line(options, word):
    done = CliRunner().invoke(app, ["validate", *options])
    assert done.exit_code == 2 and word in done.stderr and done.stderr.count("\n") == 1
