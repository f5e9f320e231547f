"""Bodies that are filled from a supply: against an independent integration, and what is refused."""

import json
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from texts import problem_text
from tiny import REST, TINY
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.analysis.airflow import GAS, Tube
from pneumorph.analysis.supply import read_profiles, read_times
from pneumorph.cli import app
from pneumorph.errors import ProblemError
from pneumorph.problem import loads

AIR = 0.101325


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_pressures_are_those_of_an_independent_integration():
    design = pm.starting_design(loads(TINY))
    filled = design.over_time({"A": "60 kPa @ 0.02 s, 0 kPa @ 0.03 s"}, "0.8 mm x 1 m", "0:0.05:0.005 s")
    known, explorer, tube = np.linspace(0.0, 0.06, 9), design.explorer(), Tube(0.8, 1000.0)
    volume = CubicSpline(known, [explorer.at({"A": each}).step.volumes["A"] for each in known])

    def rate(time, p):
        supply = float(np.interp(time, [0.02, 0.03], [0.06, 0.0]))
        flow = GAS * tube.flow(supply + AIR, p[0] + AIR)
        return [flow / float(volume(p[0]) + (p[0] + AIR) * volume(p[0], 1))]

    times = [step.time for step in filled.steps]
    exact = solve_ivp(rate, (0.0, 0.05), [0.0], "Radau", times, rtol=1e-8, atol=1e-10, max_step=1e-3).y[0]
    found = np.array([step.pressures["A"] for step in filled.steps])
    assert found.max() > 0.02 and found[-1] < 0.9 * found.max()
    assert np.abs(found - exact).max() < 2e-4 * 0.06


def test_what_flows_in_is_there_and_a_chamber_acts_on_another():
    chambers = (("A", 1.6, "4 mm", "0 mm"), ("B", 1.6, "-4 mm", "0 mm"))
    rest = REST.replace('A = "60 kPa"', 'A = "60 kPa", B = "0 kPa"')
    text = problem_text(rest, chambers=chambers, body='control_density = "0.3 /mm"')
    design = pm.starting_design(loads(text))
    supply = {"A": "60 kPa", "B": "0 kPa @ 0.01 s, 50 kPa @ 0.01 s"}
    filled = design.over_time(supply, {"A": "0.5 mm x 1 m", "B": "0.2 mm x 1 m"}, "0:0.02:0.002 s")
    times = np.array([step.time for step in filled.steps])
    amount = np.array([(step.pressures["A"] + AIR) * step.volumes["A"] for step in filled.steps])
    flow = CubicSpline(times, [GAS * moment.flow["A"] for moment in filled.moments])
    flowed = [flow.integrate(0.0, time) for time in times]
    assert np.abs(amount - amount[0] - flowed).max() < 0.01 * (amount[-1] - amount[0])
    before = [step for step in filled.steps if step.time < 0.0099]
    # A alone is filled at first: it bends the body and so widens B, into which air is sucked.
    assert before[-1].pressures["B"] < -1e-5 and filled.steps[-1].pressures["B"] > 1e-4


def test_a_chamber_is_never_above_its_supply_however_long_the_steps_are():
    design = pm.starting_design(loads(TINY))
    supply = {"A": "60 kPa @ 0 s, 60 kPa @ 0.3 s, 10 kPa @ 0.3 s"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        filled = design.over_time(supply, "1.5 mm x 0.8 m", "0:0.6:0.1 s")
    pressures = [step.pressures["A"] for step in filled.steps]
    assert max(pressures) < 0.06 * (1 + 1e-6) and min(pressures[3:]) > 0.01 * (1 - 1e-6)
    assert pressures[2] == pytest.approx(0.06, rel=1e-3) and pressures[-1] == pytest.approx(0.01, rel=1e-3)
    assert "between 0 and 0.1 s" in str(filled)


def test_two_chambers_reach_their_supplies_in_one_step():
    chambers = (("A", 1.6, "4 mm", "0 mm"), ("B", 1.6, "-4 mm", "0 mm"))
    rest = REST.replace('A = "60 kPa"', 'A = "60 kPa", B = "0 kPa"')
    text = problem_text(rest, chambers=chambers, body='control_density = "0.3 /mm"')
    filled = pm.starting_design(loads(text)).over_time({"A": "60 kPa", "B": "25 kPa"}, "1.5 mm x 0.8 m", "0:0.2:0.1 s")
    for step in filled.steps[1:]:
        assert step.pressures["A"] == pytest.approx(0.06, rel=1e-4)
        assert step.pressures["B"] == pytest.approx(0.025, rel=1e-4)


@pytest.mark.slow
def test_where_a_body_balloons_it_ends_and_keeps_what_it_has():
    design = pm.starting_design(loads(TINY))
    filled = design.over_time({"A": "600 kPa"}, "0.5 mm x 1 m", "0:0.6:0.15 s")
    *before, last = filled.steps
    assert before[-1].converged and not last.converged and "volume" in last.reason
    assert before[-1].pressures["A"] < last.pressures["A"] < 0.6
    assert len(filled.to_csv().splitlines()) == 1 + len(filled.steps)


def test_the_command_writes_times_pressures_and_flows(tmp_path):
    (tmp_path / "tiny.toml").write_text(TINY)
    table, record, picture = (tmp_path / f"t.{suffix}" for suffix in ("csv", "json", "png"))
    options = ("--supply", "A=20kPa", "--tube", "1mm x 1m", "--times", "0:0.2:0.1s")
    result = run("simulate", tmp_path / "tiny.toml", *options, "--csv", table, "--json", record, "--png", picture)
    assert result.exit_code == 0 and "95 % of the way to 20 kPa between" in result.stdout, result.output
    lines = [line.split(",") for line in table.read_text().splitlines()]
    assert len(lines) == 4 and {"time_s", "supply_A_kPa", "flow_A_l_per_min"} < set(lines[0])
    moments = json.loads(record.read_text())["moments"]
    assert moments[0]["flow_l_per_min"]["A"] > 100 * abs(moments[-1]["flow_l_per_min"]["A"])
    assert picture.stat().st_size > 1000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--supply", "A=20kPa", "--tube", "1mm x 1m"), "--times"),
        (("--tube", "1mm x 1m", "--times", "0:1:0.1s"), "--supply"),
        (("--supply", "C=20kPa", "--tube", "1mm x 1m", "--times", "0:1:0.1s"), '"C"'),
        (("--supply", "A=20kPa", "--tube", "1mm x 1m", "--times", "0:1:0.1s", "--stiffness"), "--stiffness"),
        (("--supply", "A=20kPa", "--tube", "B=1mm x 1m", "--times", "0:1:0.1s"), '"B"'),
        (("--supply", "A=20kPa", "--tube", "0mm x 1m", "--times", "0:1:0.1s"), "2 mm x 1 m"),
    ],
)
def test_what_is_missing_or_too_much_is_told_in_a_line(tmp_path, options, words):
    (tmp_path / "tiny.toml").write_text(TINY)
    result = run("simulate", tmp_path / "tiny.toml", *options)
    assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1


def test_a_profile_is_linear_and_jumps():
    profile = read_profiles({"A": "0 kPa @ 1 s, 100 kPa @ 1 s, 50 kPa @ 3 s"}, ["A"])["A"]
    assert [profile.at(time) for time in (0.0, 1.0, 2.0, 9.0)] == pytest.approx([0.0, 0.1, 0.075, 0.05])


def test_profiles_and_times_that_are_none():
    for text in ("3", "1 kPa @ 2 s, 2 kPa @ 1 s", "1 kPa, 2 kPa @ 1 s", "-200 kPa", "1 kPa @ 2 mm"):
        with pytest.raises(ProblemError, match="supply A"):
            read_profiles({"A": text}, ["A"])
    for text in ("0:1", "0:1:0 s", "1:0:0.1 s", "0:1:0.1 kPa", "0:1:1e-9 s"):
        with pytest.raises(ProblemError, match="times"):
            read_times(text)
