"""The command itself: version, help, and the files to start from."""

import re
import subprocess
import sys

import pytest
from certifying import certified
from typer.main import get_command
from typer.testing import CliRunner

import pneumorph
from pneumorph.cli import app
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import load
from pneumorph.problem.starts import KINDS


def test_version(run):
    result = run("--version")
    assert result.exit_code == 0 and result.stdout == f"pneumorph {pneumorph.__version__}\n"


def test_as_a_module():
    result = subprocess.run([sys.executable, "-m", "pneumorph", "--version"], capture_output=True, encoding="utf-8")
    assert result.stdout == f"pneumorph {pneumorph.__version__}\n" and result.returncode == 0


@pytest.mark.parametrize("width", [60, 100])
@pytest.mark.parametrize("command", [(), ("material",), ("material", "fit"), ("design",), ("simulate",), ("new",)])
def test_help_fits_the_screen(command, width):
    result = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": str(width)}, terminal_width=width)
    assert result.exit_code == 0
    assert max(len(line) for line in result.stdout.splitlines()) <= width
    # Sentences are not cut off.
    assert not re.search(r"[a-z,]\.\.\.$", result.stdout, flags=re.MULTILINE)


def commands(group):
    for command in group.commands.values():
        yield from commands(command) if hasattr(command, "commands") else (command,)


def test_common_options_have_the_same_short_names_everywhere():
    short = {"--out": "-o", "--quiet": "-q"}
    known = list(commands(get_command(app)))
    options = [set(param.opts) for command in known for param in command.params]
    assert sum("--out" in each for each in options) > 8 and sum("--quiet" in each for each in options) > 3
    for each in options:
        assert not each & set(short) or any(each == set(pair) for pair in short.items())
        assert not each & set(short.values()) or each & set(short), "no other option has such a name"
    assert CliRunner().invoke(app, ["material", "fit", "-h"]).exit_code == 0


def test_help_keeps_what_is_in_brackets(run):
    shown = " ".join(run("material", "fit", "--help").stdout.split())
    assert "as a table [material]." in shown and "Density for the table [material]," in shown
    assert "[MODE=]FILE..." in shown


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_file_is_sound_and_within_its_limits(run, tmp_path, kind):
    path = tmp_path / "my_robot.toml"
    result = run("new", tmp_path / "my_robot", "--kind", kind)
    assert result.exit_code == 0 and result.stdout.startswith(f"written to {path}; change it, then: pneumorph check")
    problem = load(path)
    assert problem.title == "My robot"
    assert certified(starting_body(problem.tubes), problem.limits).satisfied()
    text = path.read_text(encoding="utf-8")
    assert f"#     pneumorph design {path}" in text and "FILE" not in text
    assert max(len(line) for line in text.replace(str(path), "").splitlines()) <= 125
    # Every value that a reader may change has a word beside it.
    assert len(re.findall(r"#", text)) > 15


def test_new_is_the_extension_if_nothing_is_said(run, tmp_path):
    run("new", tmp_path / "a.toml")
    assert load(tmp_path / "a.toml").task[0].name == "extend"


def test_new_refuses(run, tmp_path):
    (tmp_path / "mine.toml").write_text("mine")
    for arguments, words in (
        ((tmp_path / "mine",), "there is already a file of this name"),
        ((tmp_path / "x", "--kind", "glove"), '"glove" is not known; use one of extension, bending, twist, finger'),
        ((tmp_path / "mine.toml" / "x",), "its folder cannot be made"),
    ):
        result = run("new", *arguments)
        assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == "mine"


def test_every_fault_of_a_file_has_a_line(run, tmp_path):
    path = tmp_path / "bad.toml"
    run("new", path)
    text = path.read_text(encoding="utf-8").replace('radius = "8 mm"', "radius = 8").replace("[mesh]", "[mush]")
    path.write_text(text.replace('wall = "2 mm"', 'wall = "2 kg"'), encoding="utf-8")
    result = run("check", path)
    assert result.exit_code == 2
    assert [line.split(": ")[:2] for line in result.stderr.splitlines()] == [
        ["pneumorph", "mush"], ["pneumorph", "body.radius"], ["pneumorph", "limits.wall"],
    ]  # fmt: skip
    path.write_text("\n".join(f"key{number} = 1" for number in range(12)), encoding="utf-8")
    lines = run("check", path).stderr.splitlines()
    assert len(lines) == 11 and lines[-1] == "pneumorph: and 5 more; correct these first"
