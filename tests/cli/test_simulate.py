"""What `simulate` says of several tasks, of targets, and of numbers that are zero but for rounding."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from texts import EXTEND, problem_text

from pneumorph.cli.steps import Rows
from pneumorph.interface.design import starting_design
from pneumorph.problem import load
from pneumorph.results import SweepStep

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

MORE = """
[[task]]
name = "there"
pressure = { A = "60 kPa" }
objective = { kind = "reach", position = ["0 mm", "3 mm", "24 mm"], rotation = ["0 deg", "0 deg", "30 deg"] }
[[task]]
name = "again"
pressure = { A = "60 kPa" }
objective = { kind = "maximize", motion = "twist" }
[[task]]
name = "less"
pressure = { A = "20 kPa" }
objective = { kind = "motion", extension = "1 mm" }
"""


@pytest.fixture
def several(tiny):
    """The tiny problem with four tasks: the first three have equal loads, the second and the last a target."""
    tiny.write_text(tiny.read_text(encoding="utf-8") + MORE)
    return tiny


def steps_of(path):
    return json.loads(path.read_text(encoding="utf-8"))["steps"]


def test_tasks_under_equal_loads_are_solved_once(run, several, tmp_path, monkeypatch):
    files = ("--json", tmp_path / "s.json", "--csv", tmp_path / "s.csv")
    result = run("simulate", several, *files)
    assert result.exit_code == 0, result.output
    assert "task again is left out: its loads here are those of task extend\n" in result.output
    steps = {step["task"]: step for step in steps_of(tmp_path / "s.json")}
    assert list(steps) == ["extend", "there", "less"]
    assert steps["there"]["translation_mm"] == steps["extend"]["translation_mm"]
    assert steps["extend"]["errors"] == {}
    x, y, z = steps["there"]["translation_mm"]
    assert steps["there"]["errors"]["position_mm"] == pytest.approx(np.linalg.norm([x, y - 3, z]))
    assert steps["there"]["errors"]["orientation_rad"] == pytest.approx(np.radians(30), rel=1e-3)
    assert steps["less"]["errors"] == pytest.approx({"position_mm": 1.0 - steps["less"]["translation_mm"][2]})
    row = next(line for line in result.output.splitlines() if line.startswith("there "))
    assert f"{steps['there']['errors']['position_mm']:.2f}" in row.split()
    assert f"{np.degrees(steps['there']['errors']['orientation_rad']):.2f}" in row.split()
    with (tmp_path / "s.csv").open() as file:
        rows = {row["task"]: row for row in csv.DictReader(file)}
    assert float(rows["there"]["error_position_mm"]) == pytest.approx(steps["there"]["errors"]["position_mm"])
    assert rows["extend"]["error_position_mm"] == ""


def test_one_task(run, several, tmp_path):
    result = run("simulate", several, "--task", "again", "--json", tmp_path / "new" / "s.json")
    assert result.exit_code == 0, result.output
    assert [step["task"] for step in steps_of(tmp_path / "new" / "s.json")] == ["again"]
    assert "left out" not in result.output
    assert f"the folder {tmp_path / 'new'} is made for s.json\n" in result.output
    refused = run("simulate", several, "--task", "lift")
    assert refused.exit_code == 2 and 'no task "lift"; use one of extend, there, again, less' in refused.stderr


def test_sweeps_that_give_all_pressures_are_those_of_one_task(several):
    simulation = starting_design(load(several)).prepare_simulation({"A": "0:20:20 kPa"})
    assert simulation.left_out == {"again": "extend"} and simulation.count == 2 * 3
    assert starting_design(load(several)).prepare_simulation(task="less").count == 1


def test_a_quiet_one_prints_nothing(run, tiny, tmp_path):
    result = run("simulate", tiny, "--quiet", "--json", tmp_path / "s.json")
    assert result.exit_code == 0 and result.output == "" and len(steps_of(tmp_path / "s.json")) == 1


def test_steps_are_rows_of_numbers_and_rounding_is_printed_as_zero(tiny):
    (task,) = load(tiny).task
    rows = Rows({"extend": task})
    step = SweepStep(
        "extend", {"A": 0.06}, translation=(-1e-9, 2e-17, 0.1), rotation=(-1e-12, 0.0, 0.0),
        reaction={"shift_x": 9.488e-16, "axial": 2.5, "torsion": -3e-9}, max_stretch=1.1, stable=True,
    )  # fmt: skip
    heading, first = (line.plain for line in rows.lines(step))
    units = ["A kPa", "x mm", "y mm", "z mm", "about x °", "about y °", "about z °", "shift_x N", "axial N"]
    assert re.split("  +", heading) == ["task", *units, "torsion N·mm", "stretch"]
    assert first.split() == [
        "extend",
        "60",
        "0.000",
        "0.000",
        "0.100",
        "0.00",
        "0.00",
        "0.00",
        "0",
        "2.5",
        "0",
        "1.100",
    ]
    ends = [[word.end() for word in re.finditer(r"\S+(?: \S+)*", line)][1:] for line in (heading, first)]
    assert ends[0] == ends[1], "numbers end where their headings end"
    (second,) = rows.lines(replace(step, pressures={"A": 0.07}, buckled={"A": 0.065}))
    assert second.plain.startswith(first[: len("extend")]) and second.plain.endswith("1.100  buckled at 65 kPa")
    (failed,) = rows.lines(SweepStep("extend", {"A": 0.08}, converged=False, reason="no state"))
    assert failed.plain.split() == ["extend", "80", "no", "state"] and failed.style == "red"


def test_the_pull_on_a_plate_is_shown_and_a_lip_that_does_not_touch_leaks(tiny):
    (task,) = load(tiny).task
    step = SweepStep(
        "extend", {"A": -0.02}, translation=(0.0, 0.0, 0.1), rotation=(0.0, 0.0, 0.0), max_stretch=1.1, stable=True,
        contact={"plate": (0.0, 0.0, 2.0)}, contact_normal={"plate": 2.0}, contact_area={"plate": 9.0},
        pull={"plate": 6.25},
    )  # fmt: skip
    heading, holds = Rows({"extend": task}).lines(step)
    cells = dict(zip(re.split("  +", heading.plain), holds.plain.split(), strict=True))
    assert cells["pull on plate N"] == "6.25" and holds.style == ""
    loose = replace(step, contact={"plate": (0.0, 0.0, 0.0)}, contact_normal={"plate": 0.0})
    _, leaks = Rows({"extend": task}).lines(loose)
    assert "plate" in leaks.plain and "leaks" in leaks.plain and leaks.style == "yellow"


def test_titles_of_blocked_motions(tiny):
    figure = starting_design(load(tiny)).simulate({"A": "0:20:20 kPa"}, ("shift_x", "bending_y", "axial")).plot()
    assert figure.get_suptitle() == "Tiny, blocked: shift along x and extension and bending about y"


def test_a_body_that_goes_through_itself_is_told(run, tmp_path):
    """A tube with a thin wall under vacuum, of which a third is solved: its buckled shape has no thirds."""
    body = 'control_density = "0.4 /mm"\nsymmetry = { rotation = 3 }'
    chambers = (("A", 6, "0 mm", "0 mm"),)
    file = tmp_path / "thin.toml"
    file.write_text(problem_text(EXTEND + '[mesh]\nsize = "8 mm"\n', body=body, chambers=chambers))
    held = [word for name in ("shift_x", "shift_y", "bending_x", "bending_y") for word in ("--block", name)]
    result = run("simulate", file, "--pressure", "A=-50:-100:-50kPa", *held, "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    steps = steps_of(tmp_path / "s.json")
    assert [step.get("self_intersecting", False) for step in steps] == [False, True]
    assert result.output.count("self-intersects") == 1 and "[contact]" in result.output
    assert all(step["stable"] for step in steps)
    assert -0.1 < steps[1]["buckled_MPa"]["A"] < -0.05
    assert result.output.count("buckled at -5") == 1
    # A third alone would go on to a state with thirds, in which the whole body is stable too.
    result = run("simulate", file, "--pressure", "A=-100kPa", *held, "--json", tmp_path / "once.json")
    (once,) = steps_of(tmp_path / "once.json")
    assert once["buckled_MPa"]["A"] == pytest.approx(steps[1]["buckled_MPa"]["A"], rel=0.01)
    assert once["volume_mm3"]["A"] == pytest.approx(steps[1]["volume_mm3"]["A"], rel=1e-6)


def test_a_filled_chamber(run, tiny, tmp_path):
    files = "--json", tmp_path / "s.json", "--csv", tmp_path / "s.csv"
    result = run("simulate", tiny, "--volume", "A=0:0.2:0.1ml", *files)
    assert result.exit_code == 0, result.output
    heading, *rows = [line.split() for line in result.stdout.splitlines() if line.startswith(("task", "extend"))]
    assert heading[3:6] == ["A", "filled", "ml"] and [row[2] for row in rows[:3]] == ["0", "0.1", "0.2"]
    with (tmp_path / "s.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [float(row["filled_A_mm3"]) for row in table] == pytest.approx([0.0, 100.0, 200.0])
    assert [float(row["volume_A_mm3"]) - float(table[0]["volume_A_mm3"]) for row in table] == pytest.approx(
        [0.0, 100.0, 200.0], abs=1e-3
    )
    steps = steps_of(tmp_path / "s.json")
    grown = np.array([step["volume_mm3"]["A"] for step in steps]) - steps[0]["volume_mm3"]["A"]
    assert grown == pytest.approx([0.0, 100.0, 200.0], abs=1e-4)
    assert np.all(np.diff([step["pressure_MPa"]["A"] for step in steps]) > 1e-3)
    both = run("simulate", tiny, "--volume", "A=1ml", "--pressure", "A=1kPa")
    assert both.exit_code == 2 and "has a pressure too" in both.stderr
    unknown = run("simulate", tiny, "--volume", "B=1ml")
    assert unknown.exit_code == 2 and 'no chamber "B"' in unknown.stderr


def test_a_held_angle_is_told_by_the_command(run, tiny):
    result = run("simulate", tiny, "--block", "bending_y=10deg", "--pressure", "A=0kPa")
    assert result.exit_code == 0, result.output
    assert "bending_y held °" in result.output and "bending_y N·mm" in result.output
    refused = run("simulate", tiny, "--block", "all=1mm")
    assert refused.exit_code == 2 and "give each motion its own" in refused.stderr
    refused = run("simulate", tiny, "--block", "axial=3deg")
    assert refused.exit_code == 2 and "block axial=3deg" in refused.stderr


def test_the_stiffness_of_the_tip(run, tiny, tmp_path):
    path = tmp_path / "steps.json"
    result = run("simulate", tiny, "--blocked-along", "z", "--json", path)
    assert result.exit_code == 0
    (step,) = json.loads(path.read_text())["steps"]
    stiff = step["stiffness"]
    assert np.array(stiff["compliance"]).shape == (6, 6) and stiff["energy_mJ"] > 0.0 and stiff["air_mm3"]["A"] > 0.0
    assert f"blocked along (0, 0, 1): {stiff['blocked_N']:.3g} N" in result.stdout and stiff["blocked_N"] > 0.0
    assert f"z {1 / stiff['compliance'][2][2]:.3g} N/mm" in result.stdout
    result = run("simulate", tiny, "--blocked-along", "up")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and "blocked-along" in result.stderr
