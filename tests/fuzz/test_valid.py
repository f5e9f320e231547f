"""Any sound problem is simulated, or one line says that it has no equilibrium or mesh; in bounded time, without NaN."""

import json
import math
import signal
import time
from contextlib import contextmanager

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from problems import problems
from tally import Outcome

from pneumorph.analysis import simulate
from pneumorph.mechanics import Equilibrium, sweep

DEADLINE = 180.0
"""Seconds of processor time that one simulation may take, with up to a minute of compiling on a fresh machine; those on
the wall depend on what else the machine does."""


class TooLong(BaseException):
    """Nothing in the program catches it."""


@contextmanager
def deadline(seconds):
    """Stop what takes more processor time; where the system has no such timer it runs to its end and is measured."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number, frame):
        raise TooLong(f"stopped after {seconds:g} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@pytest.fixture
def equilibria(monkeypatch):
    """What the command's solver found: the residual and the stability are in no file."""
    found = []

    def recorded(path, tangent):
        for one in sweep(path, tangent):
            found.append(one)
            yield one

    monkeypatch.setattr(simulate, "sweep", recorded)
    return found


def numbers(value):
    """All numbers in what a JSON file holds."""
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from numbers(part)
    elif isinstance(value, float | int):
        yield value


def promise_broken(result, steps, equilibria):
    """Which promise a simulation did not keep; empty if it kept all."""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return f"it ended with {type(result.exception).__name__}: {result.exception}"
    if result.exit_code not in (0, 1):
        return f"a sound problem ended with exit status {result.exit_code}"
    if result.exit_code == 1:
        reported = result.stderr.startswith("pneumorph: ") and result.stderr.count("\n") == 1
        return "" if reported and "nan" not in result.stderr.lower() else "the failure is not reported in one line"
    found = equilibria[-1]
    if not isinstance(found, Equilibrium) or not found.residual < 1e-8:
        return f"its state is no equilibrium (residual {getattr(found, 'residual', None)})"
    if not all(map(math.isfinite, numbers(steps))):
        return "a number is not finite"
    (step,) = steps
    if step["stable"] and not found.stable:
        return "its state is not stable, and that is not reported"
    if step["max_stretch"] < 1.0 - 1e-6:
        return f"its largest stretch is {step['max_stretch']}"
    return ""


def test_valid_problems(tally, command, equilibria, tmp_path):
    """A failure is not shrunk, that would be hundreds of simulations; all are counted and reported with their files.

    Examples cost seconds, so there are fewer than of other properties: in an ordinary run a handful, always the same.
    """

    @given(problems())
    @settings(
        max_examples=settings.default.max_examples // 33,
        derandomize=settings.default.max_examples < 1000,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        database=None,
    )
    def each(text):
        report = tmp_path / "steps.json"
        report.unlink(missing_ok=True)
        equilibria.clear()
        began = time.process_time()
        try:
            with deadline(DEADLINE):
                result = command("simulate", text.encode(), "--json", str(report))
        except TooLong as stopped:
            tally.add(Outcome("too long", "", time.process_time() - began, text, str(stopped)))
            return
        seconds = time.process_time() - began
        steps = json.loads(report.read_text(encoding="utf-8"))["steps"] if report.exists() else []
        broken = promise_broken(result, steps, equilibria)
        if seconds > DEADLINE:
            broken = broken or f"it took {seconds:.0f} s"
        verdict = {0: "converged", 1: "failed" if steps else "not meshed", 2: "refused"}[result.exit_code]
        if result.exit_code == 0 and not steps[0]["stable"]:
            verdict = "converged, reported as not stable"
        reason = result.stderr.strip().removeprefix("pneumorph: ")
        tally.add(Outcome(verdict, reason, seconds, text, broken))

    each()
    assert not tally.broken, tally.complaint()
    if len(tally.outcomes) >= 50:
        assert sum(outcome.verdict.startswith("converged") for outcome in tally.outcomes) > len(tally.outcomes) / 4
