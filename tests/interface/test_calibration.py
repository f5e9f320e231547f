"""Curves in files, and the problem with the rubber that was found."""

import numpy as np
import pytest
from texts import problem_text
from typer.testing import CliRunner

from pneumorph.cli import app
from pneumorph.errors import ProblemError
from pneumorph.interface.calibration import require_parameters, with_moduli
from pneumorph.problem import load, loads
from pneumorph.problem.material import elastomer, library
from pneumorph.problem.measured import read_measured

TASK = '[[task]]\nname = "extend"\npressure = { A = "40 kPa" }\nobjective = { motion = "extension" }\n'


@pytest.mark.parametrize(
    ("title", "column", "options"),
    [
        ("extension_mm", "translation_z_mm", []),
        ("push_extension_N", "reaction_axial_N", []),
        ("push_extension_N", "reaction_axial_N", ["--block", "axial=0.05mm"]),
        ("volume_A_mm3", "volume_A_mm3", []),
    ],
)
def test_the_command_writes_a_problem_that_shows_the_measured_curve(tmp_path, title, column, options):
    source, stiffer = tmp_path / "tube.toml", tmp_path / "stiffer.toml"
    source.write_text(loads(problem_text(TASK)).with_changes({"mesh.size": "8 mm"}).to_toml())
    stiffer.write_text(with_moduli(load(source), 1.25).to_toml())
    runner = CliRunner()
    swept = tmp_path / "swept.csv"
    held = options or (["--block", "axial"] if title.startswith("push") else [])
    done = runner.invoke(app, ["simulate", str(stiffer), "--pressure", "A=0:40:10kPa", "--csv", str(swept), *held])
    assert done.exit_code == 0, done.output
    rows = np.genfromtxt(swept, delimiter=",", names=True)
    curve = tmp_path / "curve.csv"
    points = [f"{row['pressure_A_kPa']:.9g},{row[column]:.12g}" for row in rows]
    curve.write_text("\n".join([f"pressure_A_kPa,{title}", *points]) + "\n")
    out = tmp_path / "found.toml"
    done = runner.invoke(app, ["calibrate", str(source), "--measured", str(curve), "--out", str(out), *options])
    assert done.exit_code == 0, done.output
    found, given = load(out), load(source)
    assert found.material.initial_shear_modulus == pytest.approx(1.25 * given.material.initial_shear_modulus, rel=1e-4)
    assert found.task == given.task


def test_a_force_of_a_free_tip_is_refused_in_one_line(tmp_path):
    source, curve = tmp_path / "tube.toml", tmp_path / "curve.csv"
    source.write_text(problem_text('[end_effector]\nkind = "free"\n' + TASK))
    curve.write_text("pressure (kPa), push_extension (N)\n0,0\n1,1\n2,2\n")
    done = CliRunner().invoke(app, ["calibrate", str(source), "--measured", str(curve)])
    assert done.exit_code == 2 and "plate" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "fit", "word"),
    [
        ("pressure (kPa), stretch\n0,0\n1,1\n2,2\n", "modulus", "needs titles"),
        ("pressure A (kPa), extension (mm)\n0,0\n1,1\n", "modulus", "has 2 points"),
        ("pressure A (kPa), extension (mm)\n0,0\n1,1\n2,2\n", "colour", "--fit"),
        ("pressure A (kPa), extension (mm)\n0,0\n1,1\n2,2\n", "c10,c10", "at most once"),
    ],
)
def test_a_bad_curve_is_refused_before_the_body_is_read(tmp_path, monkeypatch, text, fit, word):
    source, curve = tmp_path / "tube.toml", tmp_path / "curve.csv"
    source.write_text(problem_text(TASK))
    curve.write_text(text)
    monkeypatch.setattr("pneumorph.cli.calibrate.design_of", None)
    done = CliRunner().invoke(app, ["calibrate", str(source), "--measured", str(curve), "--fit", fit])
    assert done.exit_code == 2 and word in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "options", "word"),
    [
        ("pressure (kPa), extension (mm)\n0,0\n20,0.03\n40,0.07\n", ["--fit", "modulus,shear_modulus"], "one too many"),
        ("pressure (kPa), extension (mm)\n0,0\n20,0.03\n40,0.07\n", ["--block", "axial"], "push_extension"),
        ("pressure (kPa), extension (mm), volume A (ml)\n0,0,1\n20,1,2\n40,2,3\n", [], "only one of them"),
    ],
)
def test_what_a_curve_cannot_tell_is_refused_with_its_reason(tmp_path, text, options, word):
    source, curve = tmp_path / "tube.toml", tmp_path / "curve.csv"
    source.write_text(problem_text(TASK))
    curve.write_text(text)
    done = CliRunner().invoke(app, ["calibrate", str(source), "--measured", str(curve), *options])
    assert done.exit_code == 2 and word in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", list(library()))
def test_all_moduli_of_a_rubber_are_scaled(name):
    problem = loads(problem_text(TASK)).model_copy(update={"material": elastomer(name)})
    twice, once = with_moduli(problem, 2.0).material, problem.material
    assert twice.initial_shear_modulus == pytest.approx(2 * once.initial_shear_modulus)
    assert twice.bulk_modulus == pytest.approx(2 * once.bulk_modulus) and twice.density == once.density


@pytest.mark.parametrize(
    ("titles", "quantity", "by"),
    [
        ("pressure (kPa), extension (mm)", "extension", 1.0),
        ("Pressure A [bar]; bending_y [deg]", "bending_y", np.radians(1.0)),
        ("pressure (kPa), extension (mm)\nkPa, mm", "extension", 1.0),
        ("pressure A, twist\n[kPa], [deg]", "twist", np.radians(1.0)),
        ("pressure (kPa), push_extension (mN)", "push_extension", 1e-3),
        ("pressure_kPa, push bending_y_N_mm", "push_bending_y", 1.0),
        ("pressure (kPa), push_twist\n(kPa), (N*mm)", "push_twist", 1.0),
        ("pressure (kPa), Volume A (ml)", "volume_A", 1e3),
        ("pressure_A_kPa, volume_A_mm3", "volume_A", 1.0),
        ("pressure (kPa), volume (cm^3)", "volume_A", 1e3),
        ("pressure A, filled A\nkPa, ml", "filled_A", 1e3),
    ],
)
def test_titles_and_units_are_read(tmp_path, titles, quantity, by):
    path = tmp_path / "curve.csv"
    separator = ";" if ";" in titles else ","
    path.write_text("\n".join([titles, *(separator.join(map(str, (k, 2 * k))) for k in range(4))]))
    measured = read_measured(path, ["A"])
    assert measured.quantity == quantity
    np.testing.assert_allclose(measured.values, by * np.arange(4) * 2)
    np.testing.assert_allclose(measured.pressures["A"], (0.1 if "bar" in titles else 1e-3) * np.arange(4))


@pytest.mark.parametrize(
    ("titles", "word"),
    [
        ("pressure (kPa), stretch", "motion"),
        ("pressure C (kPa), extension (mm)", "chamber"),
        ("pressure (mm), extension (mm)", "mm"),
        ("pressure, extension (mm)", r'"pressure" has no unit; write e.g. "pressure \(kPa\)"'),
        ("pressure (kPa), push_extension (mm)", "force"),
        ("pressure (kPa), push_bending_y (N)", "moment"),
        ("pressure (kPa), push_extension", r"push_extension \(N\)"),
        ("pressure (kPa), push (N)", "push_extension"),
        ("pressure (kPa), volume A (mm)", "volume"),
        ("pressure (kPa), volume C (ml)", "no such chamber; there are A, B"),
        ("pressure (kPa), filled (ml)", 'name it, such as "filled A"'),
    ],
)
def test_what_is_no_curve_is_refused(tmp_path, titles, word):
    path = tmp_path / "curve.csv"
    path.write_text("\n".join([titles, *(f"{k},{k}" for k in range(4))]))
    with pytest.raises(ProblemError, match=word) as refused:
        read_measured(path, ["A", "B"])
    assert "\n" not in str(refused.value)


YEOH = 'model = "yeoh"\ncoefficients = ["0.2 MPa", "0.1 MPa", "0 MPa"]\nbulk_modulus = "9 MPa"\ndensity = "1 g/cm^3"\n'


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("c10", "c1, c2, c3, bulk_modulus"),
        ("skin.c1", "cannot be fitted"),
        ("c3", "is 0 in"),
        ("mu1", "cannot be fitted"),
    ],
)
def test_constants_that_the_rubber_does_not_have_are_refused(name, word):
    require_parameters([name])  # as long as the problem is not known
    with pytest.raises(ProblemError, match=word):
        require_parameters([name], loads(problem_text(TASK, material=YEOH)))
