"""The command `pneumorph material`."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from pneumorph.problem.material import library

pytestmark = pytest.mark.usefixtures("without_mesh_errors")


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
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert table["model"] == "yeoh" and table["bulk_modulus"] == "220 MPa" and table["valid_stretch"] == 3.0
    assert [float(c.split()[0]) for c in table["coefficients"]] == pytest.approx([0.11, 0.02], rel=1e-4)
    assert json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))[0]["stable"] is True
    assert (tmp_path / "out" / "fit.png").stat().st_size > 10_000


def test_list_as_json(run):
    result = run("material", "list", "--json")
    assert result.exit_code == 0
    entries = {entry["name"]: entry for entry in json.loads(result.stdout)}
    assert entries.keys() == library().keys()
    assert entries["Hei-Cast 8400"]["shear_modulus_MPa"] == 0.49
    assert all(entry["exports"] == ["vtu", "inp", "msh", "feb", "py"] for entry in entries.values())


def test_several_modes_weights_and_the_largest_stretch(run, tmp_path):
    stretch = np.linspace(1.05, 3, 20)
    for name, stress in (("pull", stretch - stretch**-2), ("shear", stretch - stretch**-3)):
        rows = "".join(f"{a};{0.3 * b}\n".replace(".", ",") for a, b in zip(stretch, stress, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"lambda;Spannung\n-;MPa\n{rows}")
    result = run(
        "material", "fit", tmp_path / "pull.csv", f"shear={tmp_path / 'shear.csv'}", "--model", "neo-hookean",
        "--stress", "nominal", "--weight", "shear=0.5", "--max-stretch", "2.5", "--out", tmp_path / "out",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert result.stdout.index('column 1 "lambda [-]"') < result.stdout.index("neo-hookean  ")
    assert (
        "shear.csv: planar tension, 20 points" in result.stdout and "beyond the largest stretch of 2.5" in result.stdout
    )
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert table["shear_modulus"] == "0.3 MPa" and table["valid_stretch"] < 2.5


def test_a_model_that_is_refused_says_what_can_be_had(run, tmp_path):
    stretch = np.linspace(1.05, 3, 20)
    rows = "".join(f"{a},{0.2 * (a**2 - a**-2.5)}\n" for a in stretch)
    (tmp_path / "a.csv").write_text(f"stretch, nominal stress (MPa)\n{rows}")
    result = run("material", "fit", tmp_path / "a.csv", "--model", "mooney-rivlin", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert (
        "no [material] is written: mooney-rivlin is" in result.stdout
        and "the model all tries the others" in result.stdout
    )
    assert not (tmp_path / "out" / "material.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.csv", "--max-stretch", "0.5"), "max_stretch: 0.5 is not above 1"),
        (("none.csv", "--section", "4 mm x 2"), "section: "),
        (("none.csv", "--weight", "planar=2"), "there is no file of this mode"),
        (("none.csv", "--stress", "piola"), "use one of nominal, true"),
        (("none.csv",), "no such file"),
        (("a.csv", "--model", "hooke"), "model: "),
        (("a.csv", "--density", "1"), "no unit"),
    ],
)
def test_refusals(run, tmp_path, arguments, words):
    result = run("material", "fit", tmp_path / arguments[0], *arguments[1:])
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and words in result.stderr


def test_a_stretch_beyond_the_rubber_s_range_is_said(run, tiny):
    text = tiny.read_text(encoding="utf-8").replace(
        'name = "Hei-Cast 8400"',
        'shear_modulus = "0.49 MPa"\nbulk_modulus = "4.8 MPa"\ndensity = "1 g/cm^3"\nvalid_stretch = 1.01',
    )
    tiny.write_text(text)
    report = tiny.with_suffix(".json")
    result = run("simulate", tiny, "--json", report)
    assert result.exit_code == 0 and "beyond the range of the rubber's parameters" in result.stdout
    assert json.loads(report.read_text(encoding="utf-8"))["steps"][0]["beyond_validity"] is True
    tiny.write_text(text.replace("1.01", "3.0"))
    result = run("simulate", tiny, "--json", report)
    assert (
        "beyond" not in result.stdout
        and json.loads(report.read_text(encoding="utf-8"))["steps"][0]["beyond_validity"] is False
    )


def test_the_picture_shows_all_modes_with_a_band():
    from pneumorph.mechanics.material.fit import TensionTest
    from pneumorph.mechanics.material.judge import band, fit_all
    from pneumorph.output.fit import fits_figure

    stretch = np.linspace(1.1, 2.5, 20)
    test = TensionTest(stretch, 0.3 * (stretch - stretch**-2))
    fits = fit_all([test], "neo-hookean")
    figure = fits_figure([test], fits, "a test")
    assert [axes.get_title().split()[0].strip(",") for axes in figure.axes] == ["uniaxial", "equibiaxial", "planar"]
    for axes, mode in zip(figure.axes, fits[0].curves, strict=True):
        low, high = band(fits, mode)
        edge = axes.collections[0].get_paths()[0].vertices[:, 1]
        assert (edge.min(), edge.max()) == pytest.approx((low.min(), high.max())) and (high > low).all()


def test_a_recorded_curve_is_averaged(run, tmp_path):
    stretch = np.linspace(1.0, 2.5, 5000)
    rows = "".join(f"{a},{0.3 * (a - a**-2)}\n" for a in stretch)
    (tmp_path / "a.csv").write_text(f"stretch, nominal stress (MPa)\n{rows}")
    result = run("material", "fit", tmp_path / "a.csv", "--model", "neo-hookean", "--out", tmp_path / "out")
    assert result.exit_code == 0 and "averaged to 200" in result.stdout
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert float(table["shear_modulus"].split()[0]) == pytest.approx(0.3, rel=1e-4)


def test_a_bad_fit_is_refused_unless_asked_for(run, tmp_path):
    # A curve that no rubber has: it jumps at once and stays.
    points = "\n".join(f"{1 + 0.1 * k},{0.3 + 0.02 * (k % 3)}" for k in range(1, 30))
    file = tmp_path / "odd.csv"
    file.write_text(f"stretch, nominal stress (MPa)\n{points}\n")
    arguments = ["material", "fit", str(file), "--model", "neo-hookean", "--out", str(tmp_path / "fit")]
    assert "[material]" not in (refused := run(*arguments).output).replace("no [material]", "")
    assert "least_r2" in refused
    assert "shear_modulus" in run(*arguments, "--least-r2", "0").output


def test_a_modulus_that_no_rubber_has_is_doubted(run, tmp_path):
    points = "\n".join(f"{1 + 0.1 * k},{500.0 * (1 + 0.1 * k - (1 + 0.1 * k) ** -2)}" for k in range(10))
    file = tmp_path / "kPa_as_MPa.csv"
    file.write_text(f"stretch, nominal stress (MPa)\n{points}\n")
    output = run("material", "fit", str(file), "--model", "neo-hookean", "--out", str(tmp_path / "fit")).output
    assert "500 MPa is not that of a rubber" in output
    assert "no [material] is written: the initial shear modulus of neo-hookean is 500 MPa" in output
    assert "without a positive" not in output and "use one of" not in output


def test_stiff_rubbers_are_fitted_too(run, tmp_path):
    points = "\n".join(f"{a},{3.0 * (a - a**-2)}" for a in np.linspace(1.0, 2.0, 12))
    (tmp_path / "stiff.csv").write_text(f"stretch, nominal stress (MPa)\n{points}\n")
    run("material", "fit", tmp_path / "stiff.csv", "--model", "neo-hookean", "--out", tmp_path / "fit")
    table = tomllib.loads((tmp_path / "fit" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert (table["shear_modulus"], table["bulk_modulus"]) == ("3 MPa", "3000 MPa")


def test_show_says_which_value_is_used_why_and_the_range_of_all_sources(run):
    shown = run("material", "show", "Ecoflex 00-30").stdout
    assert "chosen" in shown and "0.0151 to 0.0375" in shown and "compression tests" in shown
    entry = next(
        each for each in json.loads(run("material", "list", "--json").stdout) if each["name"] == "Dragon Skin 10"
    )
    assert entry["shear_modulus_range_MPa"] == pytest.approx([0.043, 0.0879])
    assert entry["scatter"] == pytest.approx(np.log(0.0879 / 0.043) / 2)
    assert "one source alone" in run("material", "show", "Hei-Cast 8400").stdout


def test_how_strain_was_measured_is_told_and_stored(run, tmp_path):
    stretch = np.linspace(1.05, 2, 12)
    rows = "".join(f"{a},{0.3 * (a - a**-2)}\n" for a in stretch)
    (tmp_path / "pull.csv").write_text(f"stretch,nominal stress (MPa)\n{rows}")
    for given, word in (((), "not known"), (("--strain-from", "crosshead"), "too low")):
        result = run(
            "material", "fit", tmp_path / "pull.csv", "--model", "neo-hookean", *given, "--out", tmp_path / "out"
        )
        assert word in result.stdout
    assert json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))[0]["strain_from"] == "crosshead"
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert "strain of the crosshead" in table["source"]
    assert run("material", "fit", tmp_path / "pull.csv", "--strain-from", "eye").exit_code == 2


@pytest.mark.parametrize(("most", "told"), [("7.6", True), ("2.2", False)])
def test_a_fit_that_misses_small_stretches_is_told(run, tmp_path, most, told):
    test = Path(__file__).parents[2] / "examples" / "treloar" / "uniaxial.csv"
    output = run("material", "fit", test, "--model", "gent", "--max-stretch", most, "--out", tmp_path / "out").stdout
    words = " ".join(output.split())
    assert ("gent is 18 to 43 % below the uniaxial test at 6 points up to a stretch of 1.9" in words) == told
    assert ("max_stretch = 1.9 (--max-stretch 1.9)" in words) == told
