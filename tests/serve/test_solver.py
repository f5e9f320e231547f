"""Demands for equilibria: the newest wins, sweeps fill the time between, and nothing is solved twice."""

import os
import signal
import threading
import time

import pytest

import pneumorph as pm
from pneumorph.output.packed import unpack
from pneumorph.serve.live import LiveRun
from pneumorph.serve.solver import LOST, Solver


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


def until(condition, seconds=120):
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, "it takes too long"
        time.sleep(0.02)


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


def test_the_newest_demand_wins(solver, live):
    found = {}

    def ask(kilopascals):
        found[kilopascals] = solver.ask(live.wanted(1, {"A": kilopascals}))

    # This design is meshed first, so that the demands come while the solver is busy.
    threads = [threading.Thread(target=ask, args=(kilopascals,)) for kilopascals in (10.0, 20.0, 30.0, 40.0)]
    for thread in threads:
        thread.start()
        time.sleep(0.05)
    for thread in threads:
        thread.join(timeout=120)
    assert step_of(found[40.0])["converged"]
    assert found[20.0] is None and found[30.0] is None


def test_a_sweep_fills_the_time_and_gives_way(solver, live):
    wanted = live.sweep(0)
    assert [dict(each.pressures)["A"] for each in wanted] == pytest.approx([part * 0.06 / 6 for part in range(7)])
    solver.sweep(wanted)
    assert solver.left == 7
    answer = solver.ask(live.wanted(0, {"A": 33.0}))
    assert step_of(answer)["converged"] and solver.left > 0, "a demand goes before the sweep"
    until(lambda: solver.left == 0)
    known = {each for each, _ in solver.known(wanted[0])}
    assert known.issuperset(wanted) and len(known) == 8
    solver.sweep(wanted)
    assert solver.left == 0


def test_stretch_and_missing_states_are_reported(solver, live):
    answer = solver.ask(live.wanted(0, {"A": 5000.0}))
    assert not answer.converged and "no equilibrium found" in step_of(answer)["reason"]
    hard = solver.ask(live.wanted(0, {"A": 250.0}))
    facts = unpack(hard.block)[0]
    assert hard.converged is facts["step"]["converged"]
    if facts["step"].get("beyond_validity"):
        assert "its parameters are valid up to" in facts["warnings"][0]


def test_a_run_that_is_gone_is_one_line(solver, live):
    wanted = live.wanted(0, {"A": 1.0})
    gone = type(wanted)(live.path / "gone", 0, 1, wanted.pressures)
    assert "is not a run directory" in step_of(solver.ask(gone))["reason"]


def test_a_lost_process_is_reported_and_replaced(solver, live):
    assert solver.ask(live.wanted(0, {"A": 11.0})).converged
    process = solver._process
    os.kill(process.pid, signal.SIGSTOP)  # or it may have answered before it is killed
    waiting = {}
    thread = threading.Thread(target=lambda: waiting.update(found=solver.ask(live.wanted(0, {"A": 4900.0}))))
    thread.start()
    until(lambda: solver._sent is not None)
    os.kill(process.pid, signal.SIGKILL)
    thread.join(timeout=60)
    assert step_of(waiting["found"])["reason"] == LOST
    assert solver.ask(live.wanted(0, {"A": 12.0})).converged
    assert solver._process.pid != process.pid


def test_closing_ends_the_process_and_the_waiting(run, live):
    solver = Solver()
    found = []
    thread = threading.Thread(target=lambda: found.append(solver.ask(live.wanted(0, {"A": 1.0}))))
    thread.start()
    until(lambda: solver._process is not None)
    process = solver._process
    solver.close()
    thread.join(timeout=30)
    assert found == [None] and not process.is_alive()
