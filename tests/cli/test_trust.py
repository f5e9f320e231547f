"""Commands ask before they run code that comes with a file, and refuse where nobody can answer."""

import io
import sys

import pytest
from tiny import tiny

from pneumorph.cli import trust
from pneumorph.errors import ProblemError
from pneumorph.problem import load, loads
from pneumorph.run import create

CODE = "import pathlib\n\npathlib.Path(__file__ if False else {mark!r}).touch()\n\n\ndef objective(f):\n    return 1\n"


@pytest.fixture
def foreign(tmp_path, monkeypatch):
    """A problem file, a run and a study with code that leaves a mark where it runs."""
    (tmp_path / "cost.py").write_text(CODE.format(mark=str(tmp_path / "mark")), encoding="utf-8")
    (tmp_path / "arm.toml").write_text(tiny(objective='{ kind = "custom", file = "cost.py" }'))
    (tmp_path / "study.toml").write_text('base = "arm.toml"\n[grid]\n"mesh.size" = ["5 mm", "6 mm"]\n')
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "of another user"))
    create(tmp_path / "run", loads((tmp_path / "arm.toml").read_text(encoding="utf-8"), folder=tmp_path))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "own"))
    return tmp_path


COMMANDS = [
    ("check", "arm.toml"),
    ("check", "run"),
    ("simulate", "arm.toml"),
    ("simulate", "run"),
    ("design", "arm.toml", "--out", "new"),
    ("study", "study.toml", "--out", "new"),
    ("draw", "run"),
    ("view", "run", "--no-browser"),
    ("report", "run"),
    ("make", "run"),
    ("export", "run", "--out", "body.vtu"),
]


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_without_an_answer_nothing_runs(run, foreign, arguments, monkeypatch):
    monkeypatch.chdir(foreign)
    result = run(*arguments)
    assert result.exit_code == 2 and result.stdout == ""
    assert result.stderr.count("\n") == 1 and result.stderr.startswith(f"pneumorph: {arguments[1]}: task[0].objective")
    assert "add --trust" in result.stderr
    assert not (foreign / "mark").exists() and not (foreign / "new").exists()


def test_with_the_option_it_runs_and_is_trusted_from_then_on(run, foreign):
    # The function gives no real number: that is told once it has run.
    for options in (("--trust",), ()):
        result = run("design", foreign / "arm.toml", "--out", foreign / "new", *options)
        assert result.exit_code == 2 and "make it return one real number" in result.stderr
        assert (foreign / "mark").exists()
        (foreign / "mark").unlink()
    result = run("report", foreign / "run")
    assert result.exit_code == 2 and "no finished design" in result.stderr, "the code of the run is the same"


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("typed", "agreed"), [("y\n", True), ("YES\n", True), ("\n", False), ("no\n", False), ("", False)]
)
def test_at_a_terminal_the_code_is_shown_and_asked_about(foreign, monkeypatch, typed, agreed):
    hidden = "x = 1  # \x1b[2K\u202e\n\tpass\n"
    (foreign / "cost.py").write_text(hidden, encoding="utf-8")
    shown = Terminal()
    monkeypatch.setattr(sys, "stdin", Terminal(typed))
    monkeypatch.setattr(sys, "stderr", shown)
    path = foreign / "arm.toml"
    if agreed:
        load(path, trust.asking(False))
        load(path, trust.asking(False))
    else:
        with pytest.raises(ProblemError, match="add --trust"):
            load(path, trust.asking(False))
    text = shown.getvalue()
    assert text.count("Run it now") == 1
    assert f"{path}: task[0].objective.code, of which objective is called:\n" in text
    assert "    1  x = 1  # \\x1b[2K\\u202e\n" in text and "    2  \\tpass\n" in text
    assert "\x1b" not in text and "\u202e" not in text
