"""Files of tension tests: what is read from them, and one line for what cannot be."""

from pathlib import Path

import numpy as np
import pytest

from pneumorph.errors import ProblemError
from pneumorph.problem import delimited
from pneumorph.problem.tension import Reading, read_tension

POINTS = [(1.0, 0.0), (1.5, 0.2), (1.2, 0.1), (2.0, 0.3), (2.5, 0.4)]


def written(path, header, points, separator=","):
    path.write_text("\n".join([header, *(separator.join(map(str, point)) for point in points)]) + "\n")
    return path


@pytest.mark.parametrize(
    ("header", "strain", "stress", "separator"),
    [
        ("stretch, nominal_stress_MPa", lambda s: s, 1.0, ","),
        ("Engineering Strain;Engineering Stress (kPa)", lambda s: s - 1, 1e3, ";"),
        ("strain_%\teng. stress [Pa]", lambda s: 100 * (s - 1), 1e6, "\t"),
        ("# a remark\nstretch,nominal stress N/mm^2", lambda s: s, 1.0, ","),
    ],
)
def test_columns_and_units(tmp_path, header, strain, stress, separator):
    points = [(strain(a), stress * b) for a, b in POINTS]
    read = read_tension(written(tmp_path / "a.csv", header, points, separator))
    stretch, found = read.stretch, read.stress
    order = np.argsort([a for a, _ in POINTS])
    assert stretch == pytest.approx(np.array(POINTS)[order, 0])
    assert found == pytest.approx(np.array(POINTS)[order, 1])


def test_other_columns_are_left_alone(tmp_path):
    points = [(9, a - 1, 99, a, b) for a, b in POINTS]
    header = "Time (s);True Strain;True Stress (MPa);stretch;nominal stress (MPa)"
    assert read_tension(written(tmp_path / "a.csv", header, points, ";")).stretch.max() == 2.5


@pytest.mark.parametrize(
    ("header", "points", "words"),
    [
        ("stretch, nominal stress", POINTS, "has no unit"),
        ("stretch, stress_MPa", POINTS, "add --stress nominal or --stress true"),
        ("stretch, nominal stress_bar", POINTS, '"bar" is not a known unit'),
        ("length, stress_MPa", POINTS, "has no column for stretch or strain"),
        ("stretch, force_N", POINTS, "is a force; add --section"),
        ("extension (mm), nominal stress_MPa", POINTS, "is a displacement; add --gauge-length"),
        (
            "strain, nominal stress_MPa",
            [(*p[:1], p[1]) for p in [(100 * a, b) for a, b in POINTS]],
            "add --strain percent",
        ),
        ("stretch, strain, nominal_stress_MPa", [(*p, 1) for p in POINTS], "more than one column"),
        ("stretch, nominal_stress_MPa", [*POINTS, (3.0, "much")], 'line 7: "much" is not a number'),
        ("stretch, nominal_stress_MPa", [*POINTS, (3.0,)], "line 7: column 2 is empty"),
        ("stretch, nominal_stress_MPa", [*POINTS, (3.0, "nan")], "line 7"),
        ("stretch, nominal_stress_MPa", POINTS[:3], "has 3 points"),
        ("stretch, nominal_stress_MPa", [(a - 1, b) for a, b in POINTS], "is not positive; is the column a strain?"),
        ("stretch, nominal_stress_MPa", [(a / 9, b) for a, b in POINTS], "no stretch is above 1"),
        ("stretch, nominal_stress_MPa", [(a, -b) for a, b in POINTS], "no stress is positive"),
        ("", [], "is empty"),
        ("", POINTS, "has no line of titles"),
        ("only words", [], "has no table of numbers"),
    ],
)
def test_one_line_for_what_is_wrong(tmp_path, header, points, words):
    path = written(tmp_path / "a.csv", header, points)
    with pytest.raises(ProblemError) as caught:
        read_tension(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and words in message


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ProblemError, match="there is no such file"):
        read_tension(tmp_path / "none.csv")


INSTRON = """Specimen label,"sheet 3"
Thickness,"2.00",(mm)

Time,Extension,Load,Tensile strain,Tensile stress
(s),(mm),(N),(mm/mm),(psi)
"0.0","0.0","0.0","0.0","0.0"
"1.0","5.0","0.4","0.2","14.5"
"2.0","12.5","0.8","0.5","29.0"
"3.0","25.0","1,200.0","1.0","43.5"
"4.0","37.5","1.6","1.5","58.0"
"""

ZWICK = """Prüfnorm;ISO 37
Probenbreite;4,0;mm
Zeit;Dehnung;Querdehnung;Technische Spannung
s;%;%;kPa
0,0;0,0;0,0;0,0
1,0;20,5;-9,0;100,5
2,0;50,0;-18,0;200,0
3,0;100,0;-29,0;300,0
4,0;150,0;-37,0;1.400,25
"""


def test_a_file_of_a_machine_with_preamble_units_row_quotes_and_psi(tmp_path):
    (tmp_path / "a.csv").write_text(INSTRON)
    read = read_tension(tmp_path / "a.csv", Reading(stress="nominal"))
    assert read.stretch == pytest.approx([1, 1.2, 1.5, 2, 2.5])
    assert read.stress == pytest.approx(np.array([0, 14.5, 29, 43.5, 58]) * 6.894757e-3)
    told = "\n".join(read.told)
    assert (
        "commas" in told and 'column 4 "Tensile strain [mm/mm]"' in told and 'column 5 "Tensile stress [psi]"' in told
    )
    with pytest.raises(ProblemError, match="--stress nominal or --stress true"):
        read_tension(tmp_path / "a.csv")


@pytest.mark.parametrize(("encoding", "word"), [("latin-1", "Latin-1"), ("utf-8-sig", "UTF-8"), ("utf-16", "UTF-16")])
def test_a_german_file_with_semicolons_and_decimal_commas(tmp_path, encoding, word):
    (tmp_path / "a.csv").write_bytes(ZWICK.encode(encoding))
    read = read_tension(tmp_path / "a.csv")
    assert read.stretch == pytest.approx([1, 1.205, 1.5, 2, 2.5])
    assert read.stress == pytest.approx([0, 0.1005, 0.2, 0.3, 1.40025])
    assert word in read.told[0] and "decimal comma" in read.told[0] and "per cent" in read.told[1]


@pytest.mark.parametrize(
    ("title", "strain"),
    [
        ("Tensile strain (mm/mm)", lambda s: s - 1),
        ("Strain [%]", lambda s: 100 * (s - 1)),
        ("Dehnung (%)", lambda s: 100 * (s - 1)),
        ("lambda", lambda s: s),
        ("True strain", np.log),
        ("λ [-]", lambda s: s),
    ],
)
def test_names_of_strain(tmp_path, title, strain):
    path = written(tmp_path / "a.csv", f"{title}\tEng. stress (MPa)", [(strain(a), b) for a, b in POINTS], "\t")
    assert read_tension(path).stretch == pytest.approx(np.sort([a for a, _ in POINTS]))


def test_force_and_displacement(tmp_path):
    path = written(tmp_path / "a.txt", "Extension (mm)   Load (N)", [(25 * (a - 1), 8 * b) for a, b in POINTS], "   ")
    path.write_text(path.read_text(encoding="utf-8").replace("Extension (mm)   Load (N)", "Extension_mm   Load_N"))
    read = read_tension(path, Reading(gauge_length=25.0, area=8.0))
    assert read.stretch == pytest.approx(np.sort([a for a, _ in POINTS]))
    assert read.stress == pytest.approx(np.sort([b for _, b in POINTS]))


def test_true_stress_is_converted_and_columns_can_be_named(tmp_path):
    path = written(tmp_path / "a.csv", "x,y,z", [(9, a - 1, a * b * 1e3) for a, b in POINTS])
    read = read_tension(path, Reading("2", "z", strain="strain", stress="true", stress_unit="kPa"))
    assert read.stress == pytest.approx(np.sort([b for _, b in POINTS]))
    with pytest.raises(ProblemError, match='no column is called "w"'):
        read_tension(path, Reading("w", "z"))


def test_lines_can_be_skipped(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("1,2\n3,4\nstretch,nominal stress (MPa)\n" + "".join(f"{a},{b}\n" for a, b in POINTS))
    assert len(read_tension(path, Reading(skip=2)).stretch) == 5


def test_only_bounded_regular_files_are_read(tmp_path, monkeypatch):
    with pytest.raises(ProblemError, match="is not a file with data"):
        read_tension(Path("/dev/zero"))
    monkeypatch.setattr(delimited, "MOST_BYTES", 10)
    with pytest.raises(ProblemError, match="MB; keep only the points"):
        read_tension(written(tmp_path / "a.csv", "stretch, nominal stress (MPa)", POINTS))
    (tmp_path / "b.csv").write_bytes(b"\0\1\2")
    with pytest.raises(ProblemError, match="is not a text file"):
        read_tension(tmp_path / "b.csv")


def test_unloading_is_said(tmp_path):
    loop = [(a, a - 1) for a in (1.0, 1.3, 1.6, 2.0, 2.4, 2.0, 1.5, 1.1)]
    header = "stretch, nominal stress (MPa)"
    assert (
        "unloading after a stretch of 2.4: 3 points" in read_tension(written(tmp_path / "a.csv", header, loop)).told[-1]
    )
    assert len(read_tension(written(tmp_path / "b.csv", header, loop[:5])).told) == 3


def curve(stretch):
    return 0.1 * (np.asarray(stretch) - np.asarray(stretch) ** -2.0)


UP = np.linspace(1.0, 3.0, 41)


@pytest.mark.parametrize("returns", [UP[::-1][1:], np.r_[UP[::-1][1:], UP, UP[::-1]]])
def test_unloading_and_later_cycles_are_left_out(tmp_path, returns):
    stretch = np.r_[UP, returns]
    stress = np.r_[curve(UP), 0.6 * curve(returns)]
    read = read_tension(written(tmp_path / "a.csv", "stretch, nominal stress (MPa)", zip(stretch, stress, strict=True)))
    np.testing.assert_allclose(read.stress, curve(read.stretch), atol=1e-12)
    assert read.stretch.max() == 3.0
    assert any("unloading" in line and "40 points" in line for line in read.told) or len(returns) > 40


@pytest.mark.parametrize(("after", "word"), [(np.zeros(10), "tears"), (curve(UP[-10:]) * 0.7 + 0.1, "slips")])
def test_what_follows_a_slip_or_a_rupture_is_left_out(tmp_path, after, word):
    stress = np.r_[curve(UP[:-10]), after]
    stress[31] = 0.5 * stress[30]
    read = read_tension(written(tmp_path / "a.csv", "stretch, nominal stress (MPa)", zip(UP, stress, strict=True)))
    np.testing.assert_allclose(read.stress, curve(UP[:31]), atol=1e-12)
    assert any(word in line and "10 points" in line for line in read.told)


def test_specimens_one_after_the_other_all_count(tmp_path):
    stretch, stress = np.r_[UP, UP, UP], np.r_[curve(UP), 1.1 * curve(UP), 0.9 * curve(UP)]
    read = read_tension(written(tmp_path / "a.csv", "stretch, nominal stress (MPa)", zip(stretch, stress, strict=True)))
    assert len(read.stretch) == 123
