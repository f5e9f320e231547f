"""Bad input ends in one readable line and exit status 2."""

import pytest

from pneumorph.cli.pressures import legs_of
from pneumorph.errors import ProblemError


@pytest.mark.parametrize("command", ["design", "simulate", "check"])
def test_a_file_that_is_not_there(run, tmp_path, command):
    result = run(command, tmp_path / "none.toml")
    assert result.exit_code == 2
    assert result.stderr.startswith("pneumorph: ") and result.stderr.count("\n") == 1
    assert "there is no such file" in result.stderr


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"60 kPa"', '"60 mm"'), "task[0].pressure.A"),
        (('length = "24 mm"', "length = 24"), "body.length"),
        (('size = "6 mm"', 'siez = "6 mm"'), "mesh.siez"),
    ],
)
def test_a_bad_file(run, tiny, change, words):
    tiny.write_text(tiny.read_text().replace(*change))
    result = run("check", tiny)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1 and words in result.stderr
    assert "Traceback" not in result.output


@pytest.mark.parametrize(
    "arguments", [(), ("--iterations", "0"), ("--iterations", "many"), ("--resume", "--frobnicate")]
)
def test_usage(run, tiny, arguments):
    files = (tiny,) if arguments else ()
    assert run("design", *files, *arguments).exit_code == 2


@pytest.mark.parametrize(
    ("objective", "words"),
    [
        (
            '{ kind = "custom", code = "def objective(f):\\n    return f.speed" }',
            "task[0].objective.code: AttributeError",
        ),
        (
            '{ kind = "match_curve", degree = 1, sections = 2, control_points = '
            '[["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "20 mm"], ["0 mm", "0 mm", "9 mm"]] }',
            "task[0].objective.control_points: the curve turns back",
        ),
    ],
)
def test_a_target_without_an_answer_begins_no_run(run, tiny, tmp_path, objective, words):
    tiny.write_text(tiny.read_text().replace('{ kind = "maximize", motion = "extension" }', objective))
    result = run("design", tiny, "--out", tmp_path / "run")
    assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_run_is_not_written_over(run, tiny, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "notes.txt").write_text("mine")
    result = run("design", tiny, "--out", tmp_path / "run")
    assert result.exit_code == 2 and "--resume" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--block", "sideways"), "take one of shift_x"),
        (("--pressure", "B=60kPa"), 'no chamber "B"'),
        (("--pressure", "A=60"), "has no unit"),
        (("--design", "3"), "is no run directory"),
        (("--one-by-one",), "no chamber is swept"),
        (("--png", "curves.png"), "no sweep to draw"),
        (("--csv", "."), "is a directory"),
    ],
)
def test_simulate_refuses(run, tiny, arguments, words):
    result = run("simulate", tiny, *arguments)
    assert result.exit_code == 2 and words in result.stderr


def test_a_free_tip_cannot_be_blocked(run, tiny):
    tiny.write_text(tiny.read_text().replace('spring = { axial = "4 N/mm" }', 'kind = "free"'))
    result = run("simulate", tiny, "--block", "axial")
    assert result.exit_code == 2 and "free tip" in result.stderr


def test_an_empty_run_cannot_be_simulated(run, tiny, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "problem.toml").write_text(tiny.read_text())
    result = run("simulate", tmp_path / "run")
    assert result.exit_code == 2 and "no finished design" in result.stderr


def path_of(*options, chambers=("A", "B")):
    """The path of the one sweep that options ask for."""
    (leg,) = legs_of(list(options), chambers)
    return leg.path


def test_pressures():
    assert path_of() == [{}]
    assert path_of("A=60kPa") == [{"A": 0.06}]
    path = path_of("A=0:0.1:0.05 bar", "B = 10 kPa")
    assert path == [{"B": 0.01, "A": pytest.approx(pressure)} for pressure in (0.0, 0.005, 0.01)]
    assert [step["A"] for step in path_of("A=60:-0:-20kPa")] == pytest.approx([0.06, 0.04, 0.02, 0.0])
    together = path_of("A=0:60:20kPa", "B=60:0:-20kPa")
    assert together[1] == {"A": pytest.approx(0.02), "B": pytest.approx(0.04)}


def test_one_by_one():
    legs = legs_of(["A=0:60:20kPa", "B=10:20:10kPa", "C=5kPa"], ("A", "B", "C"), one_by_one=True)
    assert [leg.swept for leg in legs] == [("A",), ("B",)]
    assert [step["A"] for step in legs[0].path] == pytest.approx([0.0, 0.02, 0.04, 0.06])
    assert all(step["B"] == pytest.approx(0.01) for step in legs[0].path)
    assert [step["B"] for step in legs[1].path] == pytest.approx([0.01, 0.02])
    assert all(step["A"] == 0.0 and step["C"] == 0.005 for step in legs[1].path)
    with pytest.raises(ProblemError, match="--one-by-one: no chamber is swept"):
        legs_of(["A=5kPa"], ("A",), one_by_one=True)


@pytest.mark.parametrize(
    "option", ["A", "A=", "A=0:60kPa", "A=0:60:0kPa", "A=0:60:-5kPa", "A=0:60:5mm", "A=0:60:1e-9kPa"]
)
def test_pressures_that_are_none(option):
    with pytest.raises(ProblemError, match="--pressure"):
        legs_of([option], ("A",))


def test_sweeps_of_different_lengths():
    with pytest.raises(ProblemError, match=r"step together.*--one-by-one"):
        legs_of(["A=0:60:20kPa", "B=0:60:30kPa"], ("A", "B"))


def test_a_value_of_several_lines_is_repeated_in_one(run, tiny):
    result = run("simulate", tiny, "--pressure", "A=\n60\u2028kPa\x0b!")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
