"""Commands that are interrupted keep what they have, say how to go on, and end with the signal's status."""

import re
import signal
from contextlib import nullcontext

import pytest
from runs import analysed, ended, waving_run
from signals import POSIX, SENT, arrive, heard, interrupted, start
from tiny import tiny as text

from pneumorph.cli import design, study
from pneumorph.interface.runs import Run
from pneumorph.interrupts import stop_if_asked
from pneumorph.output import pictures
from pneumorph.output.pictures import Pictures
from pneumorph.problem import loads
from pneumorph.run import open_run

pytestmark = POSIX


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """The directory of a run with two designs."""
    problem = loads(text())
    found = waving_run(tmp_path_factory.mktemp("runs") / "run", problem, 2, {0: analysed(problem, 0.0)})
    ended(found)
    return found


def stopping(number):
    """A function during which a signal arrives."""

    def stopped(*_, **__):
        arrive(number)
        stop_if_asked()

    return stopped


@pytest.mark.parametrize(("number", "status"), SENT)
def test_a_design_says_what_is_saved(run, tiny, stored, tmp_path, monkeypatch, number, status):
    monkeypatch.setattr(Run, "complete", stopping(number))
    result = run("design", tiny, "--out", tmp_path / "run")
    left = f"no design was finished; {tmp_path / 'run'} contains the problem only"
    assert (result.exit_code, result.stderr) == (status, f"pneumorph: stopped; {left}\n")
    monkeypatch.setattr(design, "prepare_run", lambda *_, **__: Run(stored))
    result = run("design", tiny, "--iterations", 5)
    command = f"pneumorph design {tiny} --out {stored.path} --iterations 5 --resume"
    left = f"designs 0 to 1 are saved in {stored.path}; resume with: {command}"
    assert (result.exit_code, result.stderr) == (status, f"pneumorph: stopped; {left}\n")


def test_while_pictures_are_drawn_the_run_is_complete(run, tiny, stored, monkeypatch):
    monkeypatch.setattr(design, "prepare_run", lambda *_, **__: Run(stored))
    monkeypatch.setattr(Run, "complete", lambda *_, **__: None)
    monkeypatch.setattr(pictures, "run_pictures", stopping(signal.SIGINT))
    result = run("design", tiny)
    left = f"the run in {stored.path} is complete; draw its pictures with: pneumorph draw {stored.path} all"
    assert (result.exit_code, result.stderr) == (130, f"pneumorph: stopped; {left}\n")


def test_a_study_says_how_to_go_on(run, tiny, tmp_path, monkeypatch):
    path = tmp_path / "study.toml"
    path.write_text('base = "tiny.toml"\n[[member]]\n')

    monkeypatch.setattr(study, "connected", lambda *_: nullcontext())
    monkeypatch.setattr(study, "run_members", stopping(signal.SIGTERM))
    result = run("study", path, "--out", tmp_path / "out")
    assert result.exit_code == 143
    assert result.stderr.startswith(f"pneumorph: stopped; designs so far are in {tmp_path / 'out'}; resume with")
    assert result.stderr.count("\n") == 1


LOADING = """
import runpy, sys, threading

class Endless:
    # Loads a library without ever coming to an end.

    def find_spec(self, name, path=None, target=None):
        if name == library:
            print("loading", flush=True)
            threading.Event().wait()

library = sys.argv.pop(1)
sys.meta_path.insert(0, Endless())
runpy.run_module("pneumorph", run_name="__main__", alter_sys=True)
"""


@pytest.mark.parametrize(
    ("library", "arguments"),
    [
        ("typer", "check tiny.toml"),
        ("numpy", "design tiny.toml"),
        ("jax", "verify --only sphere"),
        ("pydantic", "material list"),
    ],
)
def test_while_libraries_are_loaded_there_is_no_traceback(tiny, library, arguments):
    process = start(["-c", LOADING, library, *arguments.split()], cwd=tiny.parent)
    heard(process, "loading")
    found = interrupted(process, signal.SIGINT)
    assert (found.status, found.out, found.err) == (130, "", "pneumorph: stopped\n")
    assert not (tiny.parent / "runs").exists()


@pytest.mark.slow
def test_a_design_is_stopped_and_resumed(run, tmp_path, monkeypatch):
    path, out = tmp_path / "tiny.toml", tmp_path / "run"
    path.write_text(text(iterations="1000"))
    process = start(["-m", "pneumorph", "design", str(path), "--out", str(out)])
    heard(process, "    1 ")
    found = interrupted(process, signal.SIGINT)
    assert found.status == 130
    *_, last = found.err.splitlines()
    latest = re.fullmatch(r"pneumorph: stopped; designs 0 to (\d) are saved in .*; resume with: pneumorph (.*)", last)
    assert latest, found.err
    assert open_run(out).latest() == int(latest[1])
    monkeypatch.setattr(pictures, "run_pictures", lambda directory: Pictures((), ()))
    result = run(*latest[2].split(), "--iterations", int(latest[1]), "--quiet")
    assert result.exit_code == 0, result.output
    assert open_run(out).result().completed


@pytest.mark.slow
def test_a_sweep_keeps_its_table(tiny, tmp_path):
    table = tmp_path / "table.csv"
    command = ["-m", "pneumorph", "simulate", str(tiny), "--pressure", "A=0:60:0.1kPa", "--csv", str(table)]
    process = start(command)
    heard(process, "extend ")
    found = interrupted(process, signal.SIGHUP)
    assert found.status == 129
    steps = re.search(r"pneumorph: stopped after (\d+) of 601 steps; the steps so far are in .*table.csv\n", found.err)
    assert steps, found.err
    assert len(table.read_text().splitlines()) == int(steps[1]) + 1
