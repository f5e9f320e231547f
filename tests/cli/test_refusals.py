"""Bad input ends in one readable line and exit status 2."""

import pytest

from pneumorph.analysis import simulate


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
    tiny.write_text(tiny.read_text(encoding="utf-8").replace(*change))
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
            "task[0].objective.control_points: the curve reverses",
        ),
    ],
)
def test_a_target_without_an_answer_begins_no_run(run, tiny, tmp_path, objective, words):
    tiny.write_text(tiny.read_text(encoding="utf-8").replace('{ kind = "maximize", motion = "extension" }', objective))
    result = run("design", tiny, "--out", tmp_path / "run", "--trust")
    assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_a_run_without_a_design_has_no_page(run, tmp_path):
    result = run("report", tmp_path)
    assert result.exit_code == 2 and "is not a run directory" in result.stderr and result.stderr.count("\n") == 1


def test_a_run_is_not_written_over(run, tiny, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "notes.txt").write_text("mine")
    result = run("design", tiny, "--out", tmp_path / "run")
    assert result.exit_code == 2 and "--resume" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--block", "sideways"), "use one of shift_x"),
        (("--pressure", "B=60kPa"), 'no chamber "B"'),
        (("--pressure", "A=60"), "has no unit"),
        (("--design", "3"), "is not a run directory"),
        (("--one-by-one",), "no chamber is swept"),
        (("--pressure", "A"), "write A=60kPa for a constant pressure"),
        (("--pressure", "A=1kPa", "--pressure", "A=2kPa"), "is given twice"),
        (("--png", "curves.png"), "no sweep to draw"),
        (("--csv", "."), "is a directory"),
    ],
)
def test_simulate_refuses(run, tiny, arguments, words):
    result = run("simulate", tiny, *arguments)
    assert result.exit_code == 2 and words in result.stderr


def test_export_refuses(run, tiny, tmp_path):
    result = run("export", tiny, "--design", "1", "--out", tmp_path / "body.vtu")
    assert result.exit_code == 2 and "is not a run directory" in result.stderr
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "problem.toml").write_text(tiny.read_text(encoding="utf-8"))
    result = run("export", tmp_path / "run", "--out", tmp_path / "body.vtu")
    assert result.exit_code == 2 and "no finished design" in result.stderr


def test_a_free_tip_cannot_be_blocked(run, tiny):
    tiny.write_text(tiny.read_text(encoding="utf-8").replace('spring = { axial = "4 N/mm" }', 'kind = "free"'))
    result = run("simulate", tiny, "--block", "axial")
    assert result.exit_code == 2 and "free tip" in result.stderr


def test_an_empty_run_cannot_be_simulated(run, tiny, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "problem.toml").write_text(tiny.read_text(encoding="utf-8"))
    result = run("simulate", tmp_path / "run")
    assert result.exit_code == 2 and "no finished design" in result.stderr


def test_a_value_of_several_lines_is_repeated_in_one(run, tiny):
    result = run("simulate", tiny, "--pressure", "A=\n60\u2028kPa\x0b!")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1


def test_options_are_checked_before_a_body_is_read(run, tmp_path):
    result = run("simulate", tmp_path / "none.toml", "--block", "sideways")
    assert result.exit_code == 2 and "sideways" in result.stderr


@pytest.mark.parametrize("option", [("--volume", "Z=1ml"), ("--pressure", "Z=1kPa"), ("--move", "Z.x=1mm")])
def test_names_are_checked_before_anything_is_meshed(run, tiny, monkeypatch, option):
    def mesh(*_):
        raise AssertionError("it is meshed")

    monkeypatch.setattr(simulate, "mesh_of", mesh)
    result = run("simulate", tiny, *option)
    assert result.exit_code == 2 and "Z" in result.stderr
