"""Demands for equilibria: the newest wins, sweeps fill the time between, and nothing is solved twice."""

import os
import signal
import threading
from contextlib import contextmanager
from dataclasses import replace

import pytest
from signals import POSIX

import pneumorph as pm
from pneumorph.output.packed import unpack
from pneumorph.serve.live import LiveRun
from pneumorph.serve.solver import LOST, Solver


def beyond(live, kilopascals):
    """A demand that the page does not make: its sliders end before."""
    return replace(live.wanted(0, {"A": 1.0}), pressures=(("A", kilopascals / 1e3),))


@pytest.fixture(scope="module")
def solver():
    solver = Solver()
    yield solver
    solver.close()


@pytest.fixture
def live(run):
    return LiveRun(run.path)


def step_of(answer):
    return unpack(answer.block)[0]["step"]


def until(solver, condition):
    """Wait until something has become so of a solver, which tells whoever waits for it."""
    with solver._changed:
        assert solver._changed.wait_for(condition, timeout=600), "it hangs"


@contextmanager
def busy(solver):
    """Keep the process that solves from going on; it is there after its first answer."""
    pid = solver._process.pid
    os.kill(pid, signal.SIGSTOP)
    try:
        yield pid
    finally:
        os.kill(pid, signal.SIGCONT)


def asking(solver, wanted):
    """Ask in a thread; its answer is in the list once the thread has ended."""
    found = []
    thread = threading.Thread(target=lambda: found.append(solver.ask(wanted)), daemon=True)
    thread.start()
    until(solver, lambda: solver._demand == wanted)
    return thread, found


def test_an_answer_is_what_simulate_finds(run, solver, live):
    wanted = live.wanted(2, {"A": 42.5})
    answer = solver.ask(wanted)
    facts, arrays = unpack(answer.block)
    (expected,) = pm.open_run(run.path).design(2).simulate({"A": "42.5 kPa"}).steps
    assert facts["step"]["translation_mm"] == pytest.approx(expected.translation, abs=1e-7)
    assert facts["step"]["max_stretch"] == pytest.approx(expected.max_stretch, rel=1e-6)
    assert facts["step"]["stable"] and facts["warnings"] == []
    tip = next(part for part in facts["state"]["parts"] if part["face"] == "tip")
    assert arrays["u 0 0 extend"][tip["vertices"] - 1, 2] == pytest.approx(expected.translation[2], abs=1e-3)
    assert solver.ask(wanted) is answer, "it is solved once"


@POSIX
def test_the_newest_demand_wins(solver, live):
    assert solver.ask(live.wanted(1, {"A": 5.0})).converged
    with busy(solver):
        asked = [asking(solver, live.wanted(1, {"A": kilopascals})) for kilopascals in (10.0, 20.0, 30.0, 40.0)]
    for thread, _ in asked:
        thread.join()
    _, (second,), (third,), (newest,) = (found for _, found in asked)
    assert step_of(newest)["converged"] and second is None and third is None


@POSIX
def test_a_sweep_fills_the_time_and_gives_way(solver, live):
    wanted = live.sweep(0)
    assert [dict(each.pressures)["A"] for each in wanted] == pytest.approx([part * 0.06 / 6 for part in range(7)])
    assert solver.ask(live.wanted(2, {"A": 5.0})).converged
    demand = live.wanted(0, {"A": 33.0})
    with busy(solver):
        solver.sweep(wanted)
        assert solver.left == 7
        thread, found = asking(solver, demand)
    thread.join()
    assert step_of(found[0])["converged"]
    until(solver, lambda: solver.left == 0)
    known = [each for each, _ in solver.known(wanted[0])]
    assert set(known) == {demand, *wanted}
    assert known.index(demand) <= 1, "a demand goes before the sweep"
    solver.sweep(wanted)
    assert solver.left == 0


def test_stretch_and_missing_states_are_reported(solver, live):
    answer = solver.ask(beyond(live, 5000.0))
    assert not answer.converged and "no equilibrium found" in step_of(answer)["reason"]
    hard = solver.ask(beyond(live, 250.0))
    facts = unpack(hard.block)[0]
    assert hard.converged is facts["step"]["converged"]
    if facts["step"].get("beyond_validity"):
        assert "its parameters are valid up to" in facts["warnings"][0]


def test_a_run_that_is_gone_is_one_line(solver, live):
    wanted = live.wanted(0, {"A": 1.0})
    gone = type(wanted)(live.path / "gone", 0, 1, wanted.pressures)
    assert "is not a run directory" in step_of(solver.ask(gone))["reason"]


@POSIX
def test_a_lost_process_is_reported_and_replaced(solver, live):
    assert solver.ask(live.wanted(0, {"A": 11.0})).converged
    process = solver._process
    # Or it may have answered before it is killed.
    os.kill(process.pid, signal.SIGSTOP)
    thread, found = asking(solver, beyond(live, 4900.0))
    os.kill(process.pid, signal.SIGKILL)
    thread.join()
    assert step_of(found[0])["reason"] == LOST
    assert solver.ask(live.wanted(0, {"A": 12.0})).converged
    assert solver._process.pid != process.pid


def test_closing_ends_the_process_and_the_waiting(run, live):
    solver = Solver()
    thread, found = asking(solver, live.wanted(0, {"A": 1.0}))
    process = solver._process
    assert process is not None
    solver.close()
    thread.join()
    assert found == [None] and not process.is_alive()
