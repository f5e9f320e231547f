"""The commands on a tiny body."""

import csv
import json
import signal

import jsonschema
import pytest
from signals import arrive

from pneumorph.analysis import simulate
from pneumorph.cli import check
from pneumorph.errors import ComputationError
from pneumorph.mechanics import NoEquilibrium, Skin, sweep
from pneumorph.optimize.setup import Setup
from pneumorph.output import pictures
from pneumorph.output.pictures import Pictures
from pneumorph.problem import Problem, loads
from pneumorph.run import complete

VECTOR = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
BY_NAME = {"type": "object", "additionalProperties": {"type": "number"}}
STEPS = {
    "type": "object",
    "required": ["steps", "elements", "dofs", "seconds"],
    "properties": {
        "steps": {
            "type": "array",
            "items": {
                "type": "object",
                "required": [
                    "task", "pressure_MPa", "translation_mm", "rotation_rad", "reaction", "volume_mm3", "max_stretch",
                    "stable", "converged",
                ],
                "properties": {
                    "task": {"type": "string"},
                    "pressure_MPa": BY_NAME,
                    "translation_mm": VECTOR,
                    "rotation_rad": VECTOR,
                    "reaction": BY_NAME,
                    "volume_mm3": BY_NAME,
                    "max_stretch": {"type": "number"},
                    "stable": {"type": "boolean"},
                    "converged": {"type": "boolean"},
                },
            },
        },
        "elements": {"type": "integer"},
        "dofs": {"type": "integer"},
        "seconds": {"type": "number"},
    },
}  # fmt: skip


def steps_of(path):
    content = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.validate(content, STEPS)
    return content["steps"]


def test_a_sweep(run, tiny, tmp_path):
    files = ("--json", tmp_path / "steps.json", "--csv", tmp_path / "steps.csv", "--png", tmp_path / "steps.png")
    result = run("simulate", tiny, "--pressure", "A=0:60:20kPa", *files)
    assert result.exit_code == 0, result.output
    steps = steps_of(tmp_path / "steps.json")
    assert [step["pressure_MPa"]["A"] for step in steps] == pytest.approx([0.0, 0.02, 0.04, 0.06])
    extension = [step["translation_mm"][2] for step in steps]
    assert extension[0] == pytest.approx(0.0, abs=1e-9)
    assert extension == sorted(extension) and extension[-1] > 0.03
    assert steps[-1]["reaction"]["axial"] == pytest.approx(4.0 * extension[-1])
    assert steps[-1]["volume_mm3"]["A"] > steps[0]["volume_mm3"]["A"]
    with (tmp_path / "steps.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [float(row["pressure_A_kPa"]) for row in table] == [0.0, 20.0, 40.0, 60.0]
    assert [float(row["translation_z_mm"]) for row in table] == pytest.approx(extension, rel=1e-9)
    assert (tmp_path / "steps.png").read_bytes().startswith(b"\x89PNG")


def test_a_blocked_plate(run, tiny, tmp_path):
    result = run("simulate", tiny, "--block", "all", "--json", tmp_path / "steps.json")
    assert result.exit_code == 0, result.output
    (step,) = steps_of(tmp_path / "steps.json")
    assert step["translation_mm"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert set(step["reaction"]) == {"shift_x", "shift_y", "axial", "bending_x", "bending_y", "torsion"}
    assert step["reaction"]["axial"] > 0.5


def test_a_step_without_equilibrium(run, tiny, tmp_path, monkeypatch):
    """What was found before is written, the rest is reported."""

    def ballooning(path, tangent):
        first, *others = path
        yield from sweep([first], tangent)
        for _ in others:
            yield NoEquilibrium("no equilibrium found near A = 400 kPa: it balloons", 0.0, None)

    monkeypatch.setattr(simulate, "sweep", ballooning)
    result = run("simulate", tiny, "--pressure", "A=0:800:400kPa", "--json", tmp_path / "steps.json")
    assert result.exit_code == 1
    assert result.stderr.startswith("pneumorph: 2 of 3 steps have no equilibrium: no equilibrium found near")
    assert result.stderr.count("\n") == 1
    steps = json.loads((tmp_path / "steps.json").read_text(encoding="utf-8"))["steps"]
    assert [step["converged"] for step in steps] == [True, False, False]
    assert steps[1]["translation_mm"] is None and "balloons" in steps[1]["reason"]


def test_an_interrupted_sweep(run, tiny, tmp_path, monkeypatch):
    """What was found before is in every file."""

    def interrupted(path, tangent):
        first, second, *_ = path
        yield from sweep([first, second], tangent)
        arrive(signal.SIGTERM)
        yield from sweep([first], tangent)

    monkeypatch.setattr(simulate, "sweep", interrupted)
    files = [tmp_path / "steps.json", tmp_path / "steps.csv", tmp_path / "steps.png"]
    options = [part for file in files for part in (f"--{file.suffix[1:]}", file)]
    result = run("simulate", tiny, "--pressure", "A=0:60:20kPa", *options)
    assert result.exit_code == 143
    assert result.stderr.startswith("pneumorph: stopped after 2 of 4 steps; the steps so far are in ")
    assert all(str(file) in result.stderr for file in files)
    assert len(steps_of(files[0])) == 2
    assert len(files[1].read_text(encoding="utf-8").splitlines()) == 3
    assert files[2].stat().st_size > 1000


def test_check(run, tiny):
    result = run("check", tiny)
    assert result.exit_code == 0, result.output
    for words in ("rubber    Hei-Cast 8400", "axial spring 4 N/mm", "limit     wall is 3 mm"):
        assert words in result.output
    assert result.output.count("right") == 2
    assert "gradient  pressures: nothing to test, no pressure is designed\n" in result.output
    assert result.output.endswith("The problem is sound and its gradient is exact.\n")


def test_a_quick_check_tests_no_gradient(run, tiny, monkeypatch):
    monkeypatch.setattr(check, "run_gradient_check", None)
    result = run("check", tiny, "--quick")
    assert "for the shape, 0 for pressures" in result.stdout
    assert result.exit_code == 0, result.output
    assert "limit     wall is 3 mm" in result.output and "gradient  " not in result.output
    assert result.output.endswith("The problem is sound; its gradient was not tested.\n")


def test_a_quiet_check_says_what_is_wrong_and_the_verdict(run, tiny):
    result = run("check", tiny, "--quick", "--quiet")
    assert result.exit_code == 0 and result.stdout == "The problem is sound; its gradient was not tested.\n"
    tiny.write_text(tiny.read_text(encoding="utf-8").replace('{ A = "60 kPa" }', "{}"))
    warning, verdict = run("check", tiny, "--quick", "-q").stdout.splitlines()
    assert warning.startswith("warning   in task extend no chamber has a pressure")
    assert verdict == "Nothing moves in task extend, see the warning; its gradient was not tested."


def test_a_margin_is_told_as_far_as_it_is_known(run, tiny):
    result = run("check", tiny, "--quick")
    assert "limit     margin is at least 1.44, must be at least 1.15\n" in result.stdout


def test_check_says_why_a_state_is_not_to_be_trusted(run, tiny, monkeypatch):
    monkeypatch.setattr(Skin, "intersects_itself", lambda self, x: True)
    result = run("check", tiny, "--quick")
    assert result.exit_code == 0 and "warning   extend: the deformed body self-intersects" in result.output
    assert "is sound" not in result.output and "start of task extend is doubtful" in result.output


def test_a_start_that_balloons_is_checked_at_the_lower_pressure_where_a_run_begins(run, tiny):
    table = loads(tiny.read_text(encoding="utf-8")).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa"}
    table["material"]["density"] = "1 g/cm^3"
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    table["task"][0]["pressure"]["A"] = {"start": "160 kPa", "min": "0 kPa", "max": "200 kPa"}
    # A quarter of it is solved.
    table["body"]["symmetry"] = {"mirror": ["xz", "yz"]}
    tiny.write_text(Problem.model_validate(table).to_toml())
    result = run("check", tiny, "--quick")
    assert result.exit_code == 0, result.output
    assert "no state at its pressures" in result.output and "at 80 kPa" in result.output


@pytest.mark.parametrize("command", ["check", "design"])
def test_limits_that_no_body_near_the_start_satisfies_are_a_fault_of_the_input(
    run, tiny, tmp_path, monkeypatch, command
):
    monkeypatch.setattr(Setup, "within", lambda self, phi: self.certify(phi))
    text = tiny.read_text(encoding="utf-8")
    tiny.write_text(f'{text}[limits]\nenvelope = {{ radius = "7.5 mm" }}\n')
    options = ("--quick",) if command == "check" else ("--out", tmp_path / "run")
    result = run(command, tiny, *options)
    assert result.exit_code == 2, result.output
    assert "envelope" in result.stderr and "is sound" not in result.output


def test_a_body_that_does_not_move_has_no_gradient_to_test(run, tiny):
    tiny.write_text(tiny.read_text(encoding="utf-8").replace('pressure = { A = "60 kPa" }', "pressure = {}"))
    result = run("check", tiny)
    assert result.exit_code == 0, result.output
    assert result.output.count(": nothing to test") == 3 and "WRONG" not in result.output
    assert result.output.endswith(
        "Nothing moves in task extend, see the warning, but there is nothing to test its gradient on.\n"
    )


@pytest.fixture
def no_pictures(monkeypatch):
    """Drawing has tests of its own."""
    monkeypatch.setattr(pictures, "run_pictures", lambda directory: Pictures((), ("no pictures here",)))


@pytest.mark.slow
def test_a_run_and_its_continuation(run, tiny, tmp_path, no_pictures):
    out = tmp_path / "run"
    # As `make demo` has it: a problem file begins a run where there is none.
    first = run("design", tiny, "--out", out, "--iterations", 1, "--resume")
    assert first.exit_code == 0, first.output
    assert "no pictures here" in first.output
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["completed"] and result["iterations"] == 1 and "reached" in result["reason"]
    elsewhere = run("design", out, "--resume", "--out", tmp_path / "elsewhere")
    assert elsewhere.exit_code == 2 and "leave it out" in elsewhere.stderr
    again = run("design", out, "--iterations", 2, "--resume")
    assert again.exit_code == 0, again.output
    assert "resuming after design 1" in again.output
    lines = [json.loads(line) for line in (out / "history.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["iteration"] for line in lines][:3] == [0, 1, 2]
    assert str(out / "report.html") in again.output.replace("\n", "") and (out / "report.html").exists()
    reported = run("report", out, "--out", tmp_path / "page.html")
    assert reported.exit_code == 0 and reported.output == f"written to {tmp_path / 'page.html'}\n"
    exported = run("export", out, "--out", tmp_path / "body.vtu")
    assert exported.exit_code == 0, exported.output
    assert (tmp_path / "body.vtu").stat().st_size > 10_000
    simulated = run("simulate", out, "--json", tmp_path / "steps.json", "--design", 0)
    assert simulated.exit_code == 0, simulated.output
    (step,) = steps_of(tmp_path / "steps.json")
    assert step["translation_mm"][2] == pytest.approx(lines[0]["tasks"]["extend"]["translation_mm"][2], rel=1e-3)


def test_a_failure_tells_what_is_saved(run, tiny, tmp_path, no_pictures, monkeypatch):
    def failing(problem, state, settings, begin):
        raise ComputationError("the body could not be meshed")
        yield

    monkeypatch.setattr(complete, "design", failing)
    result = run("design", tiny, "--out", tmp_path / "run")
    assert result.exit_code == 1
    assert result.stderr.startswith("pneumorph: the body could not be meshed; no design was finished")
    assert result.stderr.count("\n") == 1


def test_half_a_body_is_simulated_where_all_is_symmetric(run, tiny, tmp_path):
    pair = """
    symmetry = { mirror = ["xz"] }
    [[body.chamber]]
    name = "B"
    radius = "1.5 mm"
    center = ["0 mm", "-4 mm"]
    span = ["3 mm", "21 mm"]
    [[body.chamber]]
    """
    text = (
        tiny.read_text(encoding="utf-8")
        .replace("[[body.chamber]]", pair)
        .replace('["0 mm", "0 mm"]', '["0 mm", "4 mm"]')
    )
    tiny.write_text(text.replace('radius = "4 mm"', 'radius = "1.5 mm"').replace("{ A =", '{ B = "60 kPa", A ='))
    report = tmp_path / "steps.json"
    result = run("simulate", tiny, "--json", report)
    assert result.exit_code == 0, result.output
    assert "half the body on one side of the plane xz" in result.output
    (step,) = steps_of(report)
    assert step["volume_mm3"]["A"] == step["volume_mm3"]["B"]
    assert step["stable"]
    result = run("simulate", tiny, "--pressure", "B=30kPa", "--json", report)
    assert result.exit_code == 0, result.output
    assert "half the body" not in result.output
    (step,) = steps_of(report)
    assert step["volume_mm3"]["A"] > step["volume_mm3"]["B"]
    assert step["rotation_rad"][0] > 1e-3
