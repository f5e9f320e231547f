"""`simulate` with an obstacle: forces on the screen and in the files."""

import csv
import json

import pytest

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

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
    assert "on wall z N" in result.output and "on wall mm²" in result.output
    with (tmp_path / "s.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert float(rows[-1]["contact_wall_z_N"]) == pytest.approx(z)


def test_an_obstacle_in_the_body_is_refused(run, tiny):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=20))
    refused = run("simulate", tiny)
    assert refused.exit_code != 0
    assert 'obstacle "wall" touches the body at rest; move it away' in refused.stderr


def test_a_wall_that_is_moved_onto_the_tip(run, tiny, tmp_path):
    """Force over displacement, in the table and in a picture; a wall that is pressed further presses back harder."""
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=24.35))
    files = ("--csv", tmp_path / "s.csv", "--png", tmp_path / "s.png")
    result = run("simulate", tiny, "--pressure", "A=0kPa", "--move", "wall.z=0:-1:-0.5mm", *files)
    assert result.exit_code == 0, result.output
    with (tmp_path / "s.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert [float(row["move_wall_z_mm"]) for row in rows] == [0.0, -0.5, -1.0]
    forces = [float(row["contact_wall_z_N"]) for row in rows]
    # The gap of 0.35 mm closes first; the tube is nearly linear, up to the activation distance of 0.3 mm.
    assert forces[0] < 0.05 * forces[1] and forces[2] / forces[1] == pytest.approx(0.8 / 0.3, rel=0.35)
    assert [float(row["contact_normal_wall_N"]) for row in rows] == pytest.approx(forces, rel=1e-6)
    assert float(rows[2]["contact_area_wall_mm2"]) == pytest.approx(201, rel=0.02)
    assert (
        "wall moved z mm" in result.output and "-1.000" in result.output and (tmp_path / "s.png").stat().st_size > 1000
    )


@pytest.mark.parametrize(
    "move, message",
    [
        ("wall.z", "is not an obstacle and an axis with a displacement"),
        ("wall=1mm", 'there is no obstacle and axis "wall"; use one of wall.x, wall.y, wall.z'),
        ("wall.z=1kPa", "move wall.z=1kPa: "),
        ("wall.z=down", "is not a length; write plate.z=-3mm"),
    ],
)
def test_moves_that_are_refused(run, tiny, move, message):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=24.35))
    refused = run("simulate", tiny, "--move", move)
    assert refused.exit_code != 0 and message in refused.stderr


def test_a_wall_that_moves_along_the_tip_pulls_at_it_by_friction(run, tiny, tmp_path):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=24.35))
    moves = ("--pressure", "A=0kPa", "--move", "wall.z=-0.5mm", "--move", "wall.x=0:0.4:0.2mm")
    result = run("simulate", tiny, *moves, "--friction", 0.2, "--csv", tmp_path / "s.csv")
    assert result.exit_code == 0, result.output
    with (tmp_path / "s.csv").open() as table:
        rows = list(csv.DictReader(table))
    pulls, normal = ([float(row[key]) for row in rows] for key in ("contact_wall_x_N", "contact_normal_wall_N"))
    assert abs(pulls[0]) < 1e-3 * normal[0]
    assert 0.1 * 0.2 * normal[1] < -pulls[1] <= -pulls[2] * 1.001 <= 0.2 * normal[2] * 1.002
    assert float(rows[2]["translation_x_mm"]) > 1e-3


def test_friction_is_refused_where_states_have_no_way_to_them(run, tiny):
    with tiny.open("a", encoding="utf-8") as file:
        file.write(WALL.format(height=24.35) + "[contact]\nself = false\nfriction = 0.3\n")
    refused = run("check", tiny)
    assert refused.exit_code != 0
    assert "contact.friction: is for simulate alone; leave it out here, and use simulate --friction" in refused.stderr


BALL = """
[[obstacle]]
name = "ball"
kind = "sphere"
center = ["0 mm", "0 mm", "29.4 mm"]
radius = "5 mm"
free = { mass = "5 g", hold = ["x", "y"] }
[gravity]
direction = [0, 0, -1]
"""


def test_a_free_ball_is_lifted_by_the_tip(run, tiny, tmp_path):
    """It lies on the plate: where that goes it goes too, and presses with its weight."""
    with tiny.open("a", encoding="utf-8") as file:
        file.write(BALL)
    files = ("--json", tmp_path / "s.json", "--csv", tmp_path / "s.csv")
    result = run("simulate", tiny, "--pressure", "A=0:60:60kPa", *files)
    assert result.exit_code == 0, result.output
    first, last = json.loads((tmp_path / "s.json").read_text())["steps"]
    for step in (first, last):
        assert step["contact_N"]["ball"] == pytest.approx([0.0, 0.0, 0.04905], abs=1e-4)
    lifted = last["pose_mm"]["ball"][2] - first["pose_mm"]["ball"][2]
    assert lifted == pytest.approx(last["translation_mm"][2] - first["translation_mm"][2], abs=1e-4) and lifted > 0.05
    with (tmp_path / "s.csv").open() as table:
        assert float(list(csv.DictReader(table))[1]["pose_ball_z_mm"]) == pytest.approx(last["pose_mm"]["ball"][2])
    assert "ball moved z mm" in result.output
