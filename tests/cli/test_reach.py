"""`pneumorph reach`: what it prints, what it writes, and one line for each mistake."""

import csv
import re

import pytest

from pneumorph import load
from pneumorph.interface.reach import range_of
from pneumorph.problem.components import MOTIONS, is_turn

pytestmark = pytest.mark.usefixtures("without_mesh_errors")


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
        (("extension=2mm", "--bounds", "A=nan:60kPa"), "A: "),
        (("=2mm",), "has no name"),
        (("--position", "0 mm, 20 mm"), "position: "),
        (("--position", "0, 0, 20"), "position: "),
        (("--rotation", "0 mm, 0 mm, 0 mm"), "rotation: "),
        (("extension=2mm", "--position", "0 mm, 0 mm, 20 mm"), "position: says where extension"),
        (("--position", "0 mm, 0 mm, 20 mm", "--curve", "none.csv"), "--curve"),
        (("extension=nanmm",), "extension: "),
        (("extension=2mm", "--load", "gravity=0,0"), "load gravity: "),
        (("extension=2mm", "--task", "jump"), "jump"),
        (("extension=2mm", "--curve", "none.csv"), "--curve"),
        (("--curve", "none.csv"), "none.csv"),
        (("push_extension=2mm",), "push_extension: "),
        (("push_stretch=2N",), "push_stretch: is no motion"),
        (("extension=2mm", "--block", "axial"), "extension: is held"),
        (("extension=2mm", "push_extension=1N"), "extension: is held"),
        (("push_extension=1N", "--block", "axial=0:2:1mm"), "block axial: is held at one value"),
        (("push_extension=1N", "--block", "wrist"), "wrist"),
        (("extension=2mm", "--load", "force=1N"), "load force: is no load"),
        (("extension=2mm", "--load", "force_x=1mm"), "load force_x: "),
        (("extension=2mm", "--load", "force_x"), "has no value"),
        (("extension=2mm", "--load", "gravity=0,0,-1"), "load gravity: the body has no weight"),
    ],
)
def test_a_mistake_is_one_line(run, tiny, arguments, words):
    result = run("reach", tiny, *arguments)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1 and words in result.stderr
    assert "Traceback" not in result.output


def test_a_pose_in_coordinates_is_the_motion_to_it(run, tiny):
    length = load(tiny).body.length
    still = [f"{name}=0{'deg' if is_turn(name) else 'mm'}" for name in MOTIONS if name != "extension"]
    moved = run("reach", tiny, "extension=0.01mm", *still)
    posed = run("reach", tiny, "--position", f"0 mm, 0 mm, {length + 0.01!r} mm", "--rotation", "0 deg, 0 deg, 0 deg")
    assert "extension 0.01 mm (wanted 0.01 mm)" in posed.stdout
    assert sorted(posed.stdout.splitlines()) == sorted(moved.stdout.splitlines())
    assert posed.exit_code == moved.exit_code


def test_bounds_may_have_a_unit_at_each_end():
    assert range_of("A", "5 kPa:0.06 MPa") == pytest.approx((0.005, 0.06))
    assert range_of("A", "-10:60kPa") == pytest.approx((-0.01, 0.06))


def test_forces_of_a_curve_under_a_load(run, tiny, tmp_path):
    table, out = tmp_path / "forces.csv", tmp_path / "pressures.csv"
    table.write_text("push_extension (N)\n0.2\n0.4\n")
    result = run("reach", tiny, "--curve", table, "--csv", out, "--load", "force_z=-0.1N")
    assert result.exit_code == 0 and result.stdout.count("force along z") == 2
    rows = list(csv.DictReader(out.open()))
    assert [float(row["push_extension (N)"]) for row in rows] == pytest.approx([0.2, 0.4], rel=1e-3)
    assert [float(row["extension (mm)"]) for row in rows] == pytest.approx([0.0, 0.0], abs=1e-6)
    pressures = [float(row["pressure A (kPa)"]) for row in rows]
    # The force that acts is pushed away too: the pressure goes up with the sum of both.
    assert pressures[1] / pressures[0] == pytest.approx(0.5 / 0.3, rel=0.1)
