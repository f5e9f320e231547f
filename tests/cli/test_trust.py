"""Commands ask before they run code that comes with a file, and refuse where nobody can answer."""

import io
import os
import re
import subprocess
import sys

import pytest
from tiny import tiny

from pneumorph.cli import trust
from pneumorph.errors import ProblemError
from pneumorph.objective.kinds.trial import fault_of
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
        fault_of.cache_clear()
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


IN_A_TERMINAL = """
import fcntl, os, signal, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
signal.signal(signal.SIGINT, signal.SIG_IGN)
if not (child := os.fork()):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
print("ended", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
signal.pause()
"""
"""It outlives the program: the end of the first process of a terminal discards what is not read yet."""

ENDED = re.compile(r"ended (-?\d+)\n")
QUESTION = "[y/N] "
READS = "from pneumorph.interrupts import install; install()\nfrom pneumorph.cli.trust import asking\n"
READS += "from pneumorph.problem import load\nload('arm.toml', asking(False)); print('it is read')"


def answered(arguments, folder, typed):
    """Run Python in a terminal of its own, and type an answer to its question: the status, and all that is shown."""
    pty = pytest.importorskip("pty")
    keyboard, screen = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", IN_A_TERMINAL, *arguments], cwd=folder, stdin=screen, stdout=screen, stderr=screen,
        start_new_session=True,
    )  # fmt: skip
    os.close(screen)
    shown, text, answers = b"", "", [typed]
    try:
        while not (end := ENDED.search(text)):
            shown += os.read(keyboard, 1000)
            text = shown.decode(errors="ignore").replace("\r\n", "\n")
            if answers and QUESTION in text:
                os.write(keyboard, answers.pop())
        return int(end[1]), text[: end.start()]
    finally:
        os.close(keyboard)
        process.kill()
        process.wait()


@pytest.mark.parametrize(
    ("typed", "status", "words"),
    [
        (b"y\n", 0, "it is read\n"),
        (b"n\n", 1, "add --trust"),
        (b"\x04", 1, "add --trust"),
        (b"\x03", 130, "\n\x1b[?25hpneumorph: stopped\n"),
    ],
    ids=["yes", "no", "end of input", "Ctrl-C"],
)
def test_in_a_real_terminal(foreign, typed, status, words):
    found, shown = answered(["-c", READS], foreign, typed)
    assert found == status and words in shown, shown
    assert shown.startswith("arm.toml: task[0].objective.code, of which objective is called:\n    1  import pathlib\n")
    assert shown.count("This Python code comes with the file, and can do on this machine whatever you can.") == 1
    found, shown = answered(["-c", READS], foreign, b"n\n")
    assert (found == 0) == (typed == b"y\n") and (QUESTION in shown) == (typed != b"y\n"), "a no is not kept"


def test_a_command_in_a_real_terminal(foreign):
    found, shown = answered(["-m", "pneumorph", "check", "arm.toml", "--quick"], foreign, b"yes\n")
    assert found == 2 and "make it return one real number" in shown and (foreign / "mark").exists()
    (foreign / "mark").unlink()
    (foreign / "cost.py").write_text("def objective(f):\n    return 2\n", encoding="utf-8")
    found, shown = answered(["-m", "pneumorph", "check", "arm.toml", "--quick"], foreign, b"\n")
    assert found == 2 and "add --trust" in shown and "    2      return 2\n" in shown
