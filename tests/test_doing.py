"""What is done is said where nothing else has been, whatever runs, and only where somebody asks."""

import importlib
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from types import SimpleNamespace

import jax
import numba
import pytest
from numba.core import event
from tiny import tiny

from pneumorph import doing
from pneumorph.analysis import analyse_body
from pneumorph.interface.design import starting_design
from pneumorph.problem import loads


@pytest.fixture
def parts(monkeypatch):
    """All that is done, as it is begun."""

    class Noted(list):
        def append(self, part):
            super().append(part)
            found.append(doing.words())

    found: list[str] = []
    monkeypatch.setattr(doing, "_now", Noted())
    return found


def test_from_the_whole_to_its_part(monkeypatch):
    monkeypatch.setattr(doing, "time", SimpleNamespace(monotonic=lambda: 100.0))
    with doing.doing("checking"), doing.doing("meshing") as far:
        assert doing.words() == "checking, meshing"
        far("2 of 3 surfaces")
        assert doing.line(107.0) == "checking, meshing: 2 of 3 surfaces (7 s)"
        doing.counted("factorisation")
        doing.counted("factorisation")
        assert doing.words() == "checking, meshing: 2 of 3 surfaces, 2 factorisations"
        with doing.silent():
            assert doing.line(107.0) is None
    assert doing.line(107.0) is None


def test_a_line_is_due_five_seconds_after_the_last(monkeypatch):
    monkeypatch.setattr(doing, "_latest", 100.0)
    assert [doing.due(now) for now in (100.0, 103.0, 105.0, 120.0)] == [5.0, 2.0, 0.0, 0.0]
    # Clocks of other machines may be behind.
    assert doing.due(0.0) == doing.EVERY


def test_lines_come_while_the_main_thread_waits(monkeypatch):
    monkeypatch.setattr(doing, "EVERY", 0.0)
    told: list[str] = []
    heard = Event()

    def say(text):
        told.append(text)
        heard.set()

    with doing.doing("waiting"):
        doing.announce(say)
        assert heard.wait(60.0)
        doing.announce(None)
    assert told[0] == "waiting (0 s)"
    count = len(told)
    doing.announce(None)
    assert len(told) == count


def test_first_use_is_told_while_it_lasts(tmp_path, monkeypatch):
    """By the names that modules of Python, Numba and jax have in the versions that are installed."""
    (tmp_path / "telling.py").write_text("from pneumorph import doing\n\nTOLD = doing.words()\n")
    monkeypatch.syspath_prepend(tmp_path)
    heard: list[str] = []

    class Heard(event.Listener):
        def on_start(self, event):
            heard.append(doing.words())

        def on_end(self, event):
            pass

    def kernel(x):
        heard.append(doing.words())
        return x + 1.0

    with doing.doing("checking"):
        assert importlib.import_module("telling").TOLD == "checking, loading the program"
        assert doing.words() == "checking"
        with event.install_listener("numba:run_pass", Heard()):
            assert numba.njit(lambda x: x + 2.0)(1.0) == 3.0
        assert set(heard) == {"checking, compiling kernels"}
        heard.clear()
        assert jax.jit(kernel)(1.0) == 2.0 and jax.jit(kernel)(2.0) == 3.0
        assert heard == ["checking, preparing kernels"]
        assert doing.words() == "checking"
    assert doing.words() == ""


def test_other_threads_are_not_listened_to():
    def work():
        with doing.doing("aside"):
            return doing.words()

    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(work).result() == ""


def test_an_analysis_says_what_it_does(parts):
    problem = loads(tiny())
    analyse_body(problem, starting_design(problem).body)
    assert any(each.startswith("meshing") for each in parts)
    assert any("near " in each and "kPa" in each for each in parts)
