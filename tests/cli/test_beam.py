"""The modulus of a strip under its own weight: files, tables, the command, and what is refused."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import pneumorph as pm
from pneumorph.mechanics.material.beam import Strip, centre_line

EXAMPLE = Path(__file__).parents[2] / "examples" / "small.toml"

STRIP = Strip(length=90.0, width=20.0, thickness=6.0, density=1.07e-9, gravity=9810.0, tilt=0.03)
SIZES = {"length": "90 mm", "section": "20 mm x 6 mm", "density": "1.07 g/cm^3"}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A photographed line with x to the left and y upwards, in cm, from an origin of the picture's own."""
    line = centre_line(STRIP, 0.2)[::100]
    path = tmp_path_factory.mktemp("beam") / "photo.csv"
    rows = "".join(f"{7.0 - x:.5f};{3.0 - y:.5f}\n" for x, y in 0.1 * line)
    path.write_text(f"x (cm);y (cm)\n{rows}")
    return path


def test_the_command_writes_the_modulus_of_the_line_as_a_table_that_a_problem_reads(run, file, tmp_path):
    options = [text for key, value in SIZES.items() for text in (f"--{key}", value)]
    result = run("material", "fit", "--beam", file, *options, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    table = tomllib.loads((tmp_path / "out" / "material.toml").read_text(encoding="utf-8"))["material"]
    assert float(table["shear_modulus"].split()[0]) == pytest.approx(0.2 / 3.0, rel=1e-3)
    assert "1.7° below" in result.stdout
    problem = pm.load(EXAMPLE).with_changes({"material": table})
    assert 0.02 < problem.material.scatter < 0.2  # of the sizes


def test_the_stiffening_of_a_rubber_of_the_library_is_kept(file):
    fitted = pm.fit_beam(file, **SIZES, like="Dragon Skin 20")
    (term,) = fitted.table["terms"]
    assert term["exponent"] == 2.9641 and float(term["modulus"].split()[0]) == pytest.approx(0.2 / 3.0, rel=1e-3)
    assert fitted.table["valid_stretch"] == 3.0 and "Dragon Skin 20" in fitted.table["source"]


def test_a_deflection_and_a_mass_at_the_tip():
    light = pm.fit_beam(deflection="10 mm", **SIZES)
    loaded = pm.fit_beam(deflection="10 mm", tip_mass="5 g", **SIZES)
    # Of a small deflection: 5 g at the tip are worth 8/3 of their mass as a distributed one.
    mass = 1.07e-3 * 90.0 * 20.0 * 6.0
    assert loaded.found.young / light.found.young == pytest.approx(1.0 + 5.0 / mass * 8.0 / 3.0, rel=0.01)


def test_a_short_thick_strip_is_doubted():
    fitted = pm.fit_beam(deflection="6.5 mm", length="100 mm", section="30 mm x 30 mm", density="1.07 g/cm^3")
    assert any("3.3 times as long" in sentence for sentence in fitted.reports)


@pytest.mark.parametrize(
    ("given", "word"),
    [({}, "deflection"), ({"deflection": "300 mm"}, "no rubber"), ({"deflection": "1 mm"}, "longer or thinner"),
     ({"deflection": "9 mm", "section": "20 mm"}, "width x thickness"),
     ({"deflection": "9 mm", "like": "gum"}, "library"), ({"deflection": "9"}, "unit")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(given, word):
    with pytest.raises(pm.ProblemError, match=word):
        pm.fit_beam(**{**SIZES, **given})


def test_files_need_titles_and_points(tmp_path):
    path = tmp_path / "line.csv"
    for text, word in (("a (mm),b (mm)\n0,0\n1,1\n2,2\n", "x and y"), ("x (mm),y (mm)\n0,0\n9,1\n", "2 points")):
        path.write_text(text)
        with pytest.raises(pm.ProblemError, match=word):
            pm.fit_beam(path, **SIZES)


def test_options_of_beams_are_refused_without_one(run, file):
    assert "--beam" in run("material", "fit", file, "--length", "90 mm").stderr
    assert "--length" in run("material", "fit", "--beam", file).stderr


def test_the_interval_of_noisy_points_is_wider_than_that_of_exact_ones(file, tmp_path):
    random, path = np.random.default_rng(1), tmp_path / "noisy.csv"
    points = centre_line(STRIP, 0.2)[::100] + random.normal(0.0, 1.0, (9, 2))
    path.write_text("x_mm,y_mm\n" + "".join(f"{x},{y}\n" for x, y in points - points[0]))
    assert pm.fit_beam(path, **SIZES).found.deviation > pm.fit_beam(file, **SIZES).found.deviation
