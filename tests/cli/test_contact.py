"""`simulate` with an obstacle: forces on the screen and in the files."""

import csv
import json

import pytest

WALL = """
[[obstacle]]
name = "wall"
kind = "plane"
point = ["0 mm", "0 mm", "{height} mm"]
normal = [0, 0, -1]
"""


def test_simulate_says_what_presses_on_an_obstacle(run, tiny, tmp_path):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=24.35))
    files = ("--json", tmp_path / "s.json", "--csv", tmp_path / "s.csv")
    result = run("simulate", tiny, "--pressure", "A=0:120:60kPa", *files)
    assert result.exit_code == 0, result.output
    first, _, last = json.loads((tmp_path / "s.json").read_text())["steps"]
    assert first["contact_N"] == {"wall": [0.0, 0.0, 0.0]} and first["contact_area_mm2"] == {"wall": 0.0}
    x, y, z = last["contact_N"]["wall"]
    assert z > 1e-3 and abs(x) + abs(y) < 1e-6 * z
    assert 0.0 < last["translation_mm"][2] < 0.35
    # The plate is round, of radius 8 mm, and touches with all of its face.
    assert last["contact_area_mm2"]["wall"] == pytest.approx(201, rel=0.05)
    assert "presses on wall with (" in result.output
    with (tmp_path / "s.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert float(rows[-1]["contact_wall_z_N"]) == pytest.approx(z)


def test_an_obstacle_in_the_body_is_refused(run, tiny):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=20))
    refused = run("simulate", tiny)
    assert refused.exit_code != 0
    assert 'obstacle "wall" touches the body at rest; move it away' in refused.stderr
