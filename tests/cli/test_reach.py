"""`pneumorph reach`: what it prints, what it writes, and one line for each mistake."""

import csv
import re

import pytest


def test_a_motion_and_one_that_is_out_of_reach(run, tiny, tmp_path):
    table = tmp_path / "curve.csv"
    table.write_text("extension (mm)\n0.01\n0.02\n50\n")
    out = tmp_path / "pressures.csv"
    result = run("reach", tiny, "--curve", table, "--csv", out)
    assert result.exit_code == 3
    said = result.stdout
    assert said.count("reached with A = ") == 2 and said.count("out of reach; the nearest is at A = 60 kPa") == 1
    assert "at a bound: A" in said and "to first order no pressures within the bounds bring it nearer" in said
    rows = list(csv.DictReader(out.open()))
    pressures = [float(row["pressure A (kPa)"]) for row in rows]
    assert 0.0 < pressures[0] < pressures[1] < pressures[2] == pytest.approx(60.0)
    assert [float(row["extension (mm)"]) for row in rows[:2]] == pytest.approx([0.01, 0.02], rel=0.01)
    # The pressure that is printed gives the motion.
    [pressure] = re.findall(r"A = ([\d.]+) kPa", said.splitlines()[0])
    again = run("simulate", tiny, "--pressure", f"A={pressure}kPa", "--json", tmp_path / "step.json")
    assert again.exit_code == 0
    assert '"translation_mm"' in (tmp_path / "step.json").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "no motion is asked for"),
        (("extension",), "has no value"),
        (("extension=2",), "extension: "),
        (("extension=2deg",), "extension: "),
        (("stretch=2mm",), "stretch: is no motion"),
        (("extension=2mm", "--bounds", "B=0:60kPa"), "B: there is no such chamber"),
        (("extension=2mm", "--bounds", "A=0:60mm"), "A: "),
        (("extension=2mm", "--bounds", "A=60:10kPa"), "A: "),
        (("extension=2mm", "--bounds", "A=0:10:60kPa"), "A: "),
        (("extension=2mm", "--task", "jump"), "jump"),
        (("extension=2mm", "--curve", "none.csv"), "--curve"),
        (("--curve", "none.csv"), "none.csv"),
    ],
)
def test_a_mistake_is_one_line(run, tiny, arguments, words):
    result = run("reach", tiny, *arguments)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1 and words in result.stderr
    assert "Traceback" not in result.output
