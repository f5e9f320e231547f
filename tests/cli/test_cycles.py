"""Sweeps there and back by the command: times, the energy lost, and what is refused."""

import csv
import json

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

RELAXING = 'relaxation = [{ share = 0.3, time = "5 s" }]\nsoftening = { r = 2.0, m = "5 kPa" }'


def remembering(path, keys=RELAXING):
    path.write_text(path.read_text(encoding="utf-8").replace("[material]", f"[material]\n{keys}"))
    return path


def test_steps_have_times_and_cycles_lose_energy(run, tiny, tmp_path):
    files = ("--json", tmp_path / "s.json", "--csv", tmp_path / "s.csv", "--png", tmp_path / "s.png")
    swept = ("--pressure", "A=0:60:30kPa", "--rate", "10kPa/s", "--cycles", "2")
    result = run("simulate", remembering(tiny), *swept, *files)
    assert result.exit_code == 0, result.output
    stored = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    steps = stored["steps"]
    assert [step["time_s"] for step in steps] == pytest.approx([3.0 * number for number in range(9)])
    kilopascals = [1e3 * step["pressure_MPa"]["A"] for step in steps]
    assert kilopascals == pytest.approx([0, 30, 60, 30, 0, 30, 60, 30, 0])
    volumes = [step["volume_mm3"]["A"] for step in steps]
    assert volumes[3] > volumes[1], "on the way back the chamber is larger"
    first, second = stored["cycles"]
    assert first["lost_mJ"] > second["lost_mJ"] > 0.0
    by_hand = 0.03 * (0.5 * (volumes[1] - volumes[0]) + 1.5 * (volumes[2] - volumes[1]))
    assert first["work_mJ"] == pytest.approx(by_hand)
    assert sum(line.startswith("extend: in cycle") for line in result.output.splitlines()) == 2
    with (tmp_path / "s.csv").open() as file:
        assert [float(row["time_s"]) for row in csv.DictReader(file)][-1] == pytest.approx(24.0)
    assert (tmp_path / "s.png").exists()


def test_a_rubber_of_the_library_relaxes_along_cycles_by_its_name_alone(run, tiny, tmp_path):
    tiny.write_text(tiny.read_text(encoding="utf-8").replace("Hei-Cast 8400", "Filaflex 60A"))
    swept = ("--pressure", "A=0:60:30kPa", "--rate", "2kPa/s", "--cycles", "2")
    result = run("simulate", tiny, *swept, "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    cycles = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["cycles"]
    assert all(0.0 < cycle["lost_mJ"] < 0.24 * cycle["work_mJ"] for cycle in cycles)
    assert "elastic here" not in result.output
    assert 'elastic here, in the state "first pull"' in " ".join(run("check", tiny, "--quick").output.split())


def test_cycles_of_elastic_rubber_lose_nothing(run, tiny, tmp_path):
    result = run("simulate", tiny, "--pressure", "A=0:40:20kPa", "--cycles", "1", "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    stored = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    (cycle,) = stored["cycles"]
    assert abs(cycle["lost_mJ"]) < 1e-6 * cycle["work_mJ"]
    assert stored["steps"][0].get("time_s") is None


def test_a_held_stretch_relaxes_as_the_prony_series(run, tiny, tmp_path):
    """All stress of incompressible rubber that is stretched at once and held falls by the same factor; so do forces."""
    tiny.write_text(tiny.read_text(encoding="utf-8").replace("Hei-Cast 8400", "Dragon Skin 30"))
    keys = 'relaxation = [{ share = 0.3, time = "5 s" }, { share = 0.2, time = "40 s" }]'
    pulled = ("--pressure", "A=0kPa", "--block", "axial=0:2:2mm", "--rate", "1e6mm/s", "--hold", "20s")
    result = run("simulate", remembering(tiny, keys), *pulled, "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    steps = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["steps"]
    times = np.array([step["time_s"] for step in steps[1:]])
    forces = np.array([step["reaction"]["axial"] for step in steps[1:]])
    assert times[-1] == pytest.approx(20.0, rel=1e-4) and len(times) == 6
    series = 1 - 0.3 * (1 - np.exp(-times / 5)) - 0.2 * (1 - np.exp(-times / 40))
    np.testing.assert_allclose(forces / forces[0], series / series[0], rtol=1e-3)


def test_loads_stay_at_both_ends_of_a_cycle(run, tiny, tmp_path):
    swept = ("--pressure", "A=0:40:40kPa", "--rate", "10kPa/s", "--cycles", "2", "--hold", "31s")
    result = run("simulate", remembering(tiny), *swept, "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    stored = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    steps, end = stored["steps"], [5.0, 7.0, 11.0, 19.0, 35.0]
    at_top = [step["time_s"] for step in steps if step["pressure_MPa"]["A"]]
    assert at_top == pytest.approx([4.0, *end, 74.0, *(70.0 + each for each in end)])
    volumes = [step["volume_mm3"]["A"] for step in steps]
    assert volumes[1:7] == sorted(volumes[1:7]), "it creeps while the pressure is held"
    assert len(stored["cycles"]) == 2


def test_a_sweep_one_way_has_no_cycles(run, tiny, tmp_path):
    result = run("simulate", tiny, "--pressure", "A=0:40:20kPa", "--json", tmp_path / "s.json")
    assert result.exit_code == 0, result.output
    assert "cycles" not in json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert "cycle" not in result.output


SWEEP = ("--pressure", "A=0:60:30kPa")


@pytest.mark.parametrize(
    ("keys", "options", "key", "told"),
    [
        ("", (*SWEEP, "--rate", "2kPa/s"), "rate 2kPa/s", "relaxation"),
        (RELAXING, (*SWEEP, "--cycles", "2"), "cycles 2", "add a rate"),
        (RELAXING, (*SWEEP, "--hold", "2s"), "hold 2s", "add a rate"),
        ("", (*SWEEP, "--hold", "2s"), "hold 2s", "relaxation"),
        (RELAXING, (*SWEEP, "--rate", "2kPa/s", "--hold", "2mm"), "hold", "10 s"),
        (RELAXING, ("--rate", "2kPa/s"), "rate 2kPa/s", "nothing is swept"),
        (RELAXING, (*SWEEP, "--rate", "2kPa"), "rate", "kPa/s"),
        (RELAXING, (*SWEEP, "--rate", "-2kPa/s"), "rate", "above zero"),
        (RELAXING, (*SWEEP, "--rate", "2kPa/s", "--stiffness"), "stiffness", "leave the rate"),
        ('state = "relaxed"', SWEEP, "material.state", "relaxation"),
        ('state = "softened"', SWEEP, "material.state", "stretch"),
        ('relaxation = [{ share = 0.6, time = "1 s" }, { share = 0.4, time = "9 s" }]', SWEEP, "relaxation", "add up"),
        ('softening = { r = 1.0, m = "5 kPa" }', SWEEP, "softening.r", "1"),
    ],
)
def test_what_contradicts_is_refused_in_a_line(run, tiny, keys, options, key, told):
    result = run("simulate", remembering(tiny, keys), *options)
    assert result.exit_code != 0
    (line,) = [each for each in result.stderr.splitlines() if key in each]
    assert told in line
