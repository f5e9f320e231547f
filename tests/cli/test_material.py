"""The command `pneumorph material`."""

import json
import tomllib

import numpy as np
import pytest

from pneumorph.problem.material import library


def test_list_names_every_elastomer_and_its_source(run):
    result = run("material", "list")
    assert result.exit_code == 0
    for name, elastomer in library().items():
        assert name in result.stdout and elastomer["source"][:40] in result.stdout


def test_show(run):
    result = run("material", "show", "Elastosil M4601")
    assert result.exit_code == 0 and "yeoh" in result.stdout and "κ/μ = 1000" in result.stdout
    wrong = run("material", "show", "Chewing gum")
    assert wrong.exit_code == 2 and "is not in the library" in wrong.stderr


def test_fit_writes_a_table_to_paste(run, tmp_path):
    stretch = np.linspace(1, 3, 20)
    excess = stretch**2 + 2 / stretch - 3
    stress = 1e3 * 2 * (0.11 + 2 * 0.02 * excess) * (stretch - stretch**-2)
    rows = "".join(f"{a},{b}\n" for a, b in zip(stretch - 1, stress, strict=True))
    (tmp_path / "test.csv").write_text(f"nominal strain, nominal stress (kPa)\n{rows}")
    result = run("material", "fit", tmp_path / "test.csv", "--model", "yeoh", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "R² 1.00000" in result.stdout and "stable up to 3" in result.stdout
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text())["material"]
    assert table["model"] == "yeoh" and table["bulk_modulus"] == "220 MPa" and table["valid_stretch"] == 3.0
    assert [float(c.split()[0]) for c in table["coefficients"]] == pytest.approx([0.11, 0.02], rel=1e-4)
    assert json.loads((tmp_path / "out" / "fit.json").read_text())[0]["stable"] is True
    assert (tmp_path / "out" / "fit.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.csv",), "no such file"),
        (("a.csv", "--model", "hooke"), "--model"),
        (("a.csv", "--density", "1"), "no unit"),
    ],
)
def test_refusals(run, tmp_path, arguments, words):
    result = run("material", "fit", tmp_path / arguments[0], *arguments[1:])
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and words in result.stderr


def test_a_stretch_beyond_the_rubber_s_range_is_said(run, tiny):
    text = tiny.read_text().replace(
        'name = "Hei-Cast 8400"',
        'shear_modulus = "0.49 MPa"\nbulk_modulus = "4.8 MPa"\ndensity = "1 g/cm^3"\nvalid_stretch = 1.01',
    )
    tiny.write_text(text)
    report = tiny.with_suffix(".json")
    result = run("simulate", tiny, "--json", report)
    assert result.exit_code == 0 and "beyond the range of the rubber's parameters" in result.stdout
    assert json.loads(report.read_text())["steps"][0]["beyond_validity"] is True
    tiny.write_text(text.replace("1.01", "3.0"))
    result = run("simulate", tiny, "--json", report)
    assert "beyond" not in result.stdout and json.loads(report.read_text())["steps"][0]["beyond_validity"] is False
