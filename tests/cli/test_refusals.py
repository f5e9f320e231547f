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
    ("arguments", "words"),
    [
        (("design",), "design: missing argument PROBLEM; see pneumorph design --help"),
        (("design", "a.toml", "--iterations", "0"), "design: --iterations: "),
        (("design", "a.toml", "--iterations", "many"), "design: --iterations: "),
        (("design", "a.toml", "--resume", "--frobnicate"), "design: there is no option --frobnicate; see pneumorph "),
        (
            ("design", "a.toml", "--itertions", "3"),
            "design: there is no option --itertions; the nearest is --iterations",
        ),
        (("design", "a.toml", "-z"), "design: there is no option -z; see pneumorph design --help"),
        (("desing", "a.toml"), "no such command desing, did you mean design; see pneumorph --help"),
        (("material", "fit", "--strss", "x"), "material fit: there is no option --strss; the nearest is --stress"),
        (("--verison",), "there is no option --verison; the nearest is --version"),
    ],
)
def test_usage(run, arguments, words):
    result = run(*arguments)
    assert result.exit_code == 2 and result.stderr.startswith(f"pneumorph: {words}")
    assert result.stderr.count("\n") == 1 and not result.stdout


@pytest.mark.parametrize("arguments", [(), ("material",)])
def test_without_a_command_the_help_is_shown(run, arguments):
    assert "Commands:" in run(*arguments).output


def test_what_is_no_picture_is_told_with_those_that_are(run, tiny, tmp_path):
    of_file = run("draw", tiny, "everything")
    assert of_file.exit_code == 2 and of_file.stderr == (
        f'pneumorph: {tiny}: of a problem file, body or inflation can be drawn, not "everything"; of its run also '
        "history, profile, shape, pressures, evolution, or all\n"
    )
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "problem.toml").write_text(tiny.read_text(encoding="utf-8"))
    of_run = run("draw", tmp_path / "run", "final")
    assert of_run.exit_code == 2 and of_run.stderr == (
        'pneumorph: "final" is not a picture; draw one of body, history, profile, shape, pressures, evolution, '
        "inflation, or all\n"
    )


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


def test_a_directory_without_a_run_is_not_resumed(run, tmp_path):
    none = tmp_path / "none"
    for directory, words in (
        (none, f"{none}: there is no run to resume; give the directory of a run, or start one with: "),
        (tmp_path, f"{tmp_path}: there is no run to resume"),
    ):
        result = run("design", directory, "--resume")
        assert result.exit_code == 2 and result.stderr.startswith(f"pneumorph: {words}")
        assert result.stderr.count("\n") == 1 and not none.exists()


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
