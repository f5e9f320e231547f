"""Bad input ends in a readable line for each fault and exit status 2, whatever is wrong with it."""

import subprocess
import sys
import time

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from problems import problems, spoiled
from tally import Outcome

from pneumorph.analysis import simulate
from pneumorph.errors import ComputationError

SOUND = "the file is sound after all"


@pytest.fixture
def no_mesh(monkeypatch):
    """A file that turns out to be sound is not simulated."""

    def stop(*_, **__):
        raise ComputationError(SOUND)

    monkeypatch.setattr(simulate, "mesh_of", stop)


def in_lines(stderr):
    """Whether a report consists of lines, one for each of at most ten faults and one for the rest."""
    lines = stderr.removesuffix("\n").split("\n")
    return len(lines) <= 11 and all(line.startswith("pneumorph: ") for line in lines)


def promise_broken(result):
    """Which promise about bad input a command did not keep; empty if it kept all."""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return f"it ended with {type(result.exception).__name__}: {result.exception}"
    if not in_lines(result.stderr) or "Traceback" in result.output:
        return "it is not reported in one line for each fault"
    if result.exit_code != 2 and SOUND not in result.stderr:
        return f"it ended with exit status {result.exit_code}"
    return ""


def outcome(result, began, shown):
    reason = result.stderr.strip().split("\n")[0].removeprefix("pneumorph: ")
    verdict = "sound" if SOUND in reason else "refused"
    return Outcome(verdict, reason.split(": ")[-1], time.perf_counter() - began, shown, promise_broken(result))


def test_spoiled_files(tally, command, no_mesh):
    @given(spoiled())
    @settings(suppress_health_check=list(HealthCheck), database=None)
    @example(b"")
    @example(b"\x00")
    @example(b"\xff\xfe")
    @example(b"= = =")
    def each(content):
        began = time.perf_counter()
        result = command("simulate", content)
        tally.add(outcome(result, began, content.decode(errors="backslashreplace")))
        assert not tally.outcomes[-1].broken, tally.outcomes[-1].broken

    each()
    refused = sum(found.verdict == "refused" for found in tally.outcomes)
    assert refused > len(tally.outcomes) / 2


PIECES = ["c0", "c9", "=", ":", "60", "0", "-5", "1e400", "nan", "kPa", "MPa", "mm", "/", " ", "²", "A"]


def test_pressures_that_are_none(tally, command, no_mesh):
    """What follows --pressure, made of what it is made of in another order, or of any text."""
    words = st.lists(st.sampled_from(PIECES), max_size=8).map("".join)

    @given(problems(), st.lists(words | st.text(max_size=20), min_size=1, max_size=3))
    @settings(suppress_health_check=list(HealthCheck), database=None)
    def each(text, options):
        began = time.perf_counter()
        result = command("simulate", text.encode(), *(f"--pressure={option}" for option in options))
        tally.add(outcome(result, began, repr(options)))
        assert not tally.outcomes[-1].broken, tally.outcomes[-1].broken

    each()


@pytest.mark.parametrize("content", [b"\x00\xff", b"[body]\nlength = 80"])
def test_through_the_shell(content, tmp_path):
    path = tmp_path / "problem.toml"
    path.write_bytes(content)
    arguments = [sys.executable, "-c", "from pneumorph.cli import app; app()", "simulate", str(path)]
    result = subprocess.run(arguments, capture_output=True, encoding="utf-8", timeout=600, check=False)
    assert result.returncode == 2
    assert result.stdout == ""
    assert in_lines(result.stderr)
