"""Members begin where a worker is free for them: none is bound to a busy one while another is idle."""

import threading
from types import SimpleNamespace

import pytest
from distributed import Client, LocalCluster
from distributed.diagnostics.plugin import SchedulerPlugin

from pneumorph.errors import ComputationError
from pneumorph.study import cluster
from pneumorph.study.cluster import run_members
from pneumorph.study.in_turn import in_turn
from pneumorph.study.members import MemberEnd

HUNG = 60.0
"""Seconds after which members that wait for each other are taken to hang."""


@pytest.fixture
def workers():
    """Two workers, of one thread each, in this process."""
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0") as found:
        yield found


WORK = []
"""What members do, in this process, which is also that of the workers: what they wait for cannot be sent to others."""


def run_on_worker(name, *_):
    """Stands for the run of a member."""
    return MemberEnd(name, WORK[-1](name), "")


@pytest.fixture
def run(workers, monkeypatch, tmp_path):
    """Run members that do something with their names; whether it succeeded, by their names."""

    def ended(names, work):
        WORK[:] = [work]
        monkeypatch.setattr(cluster, "run_on_worker", run_on_worker)
        members = [(SimpleNamespace(name=name, problem=None, begin=None), None) for name in names]
        with Client(workers) as client:
            return {end.name: end.completed for end in run_members(client, members, tmp_path, lambda *_: None)}

    return ended


class Most(SchedulerPlugin):
    """The most members that a worker has had at once: one that it runs, and those that wait for it."""

    def __init__(self, scheduler):
        self.scheduler, self.found = scheduler, 0

    def transition(self, *_, **__):
        self.found = max(self.found, *(len(each.processing) for each in self.scheduler.workers.values()))


def test_no_member_waits_for_a_certain_worker(workers, run):
    names, two, most = ["one", "two", "three", "four"], threading.Barrier(2), Most(workers.scheduler)
    workers.scheduler.add_plugin(most)

    def side_by_side(name):
        two.wait(HUNG)
        return True

    assert run(names, side_by_side) == dict.fromkeys(names, True)
    assert most.found == 1


def test_a_short_member_after_another_runs_beside_a_long_one(run):
    short = threading.Semaphore(0)

    def work(name):
        if name != "long":
            short.release()
            return True
        return all([short.acquire(timeout=HUNG) for _ in range(3)])

    assert all(run(["long", "one", "two", "three"], work).values())


def test_a_worker_that_comes_later_is_used(workers, run):
    third = threading.Event()

    def work(name):
        if name == "one":
            workers.scale(3)
        if name == "three":
            third.set()
        return third.wait(HUNG)

    assert all(run(["one", "two", "three"], work).values())


def test_a_lost_scheduler_is_said_in_one_line(workers):
    with Client(workers) as client:

        def cancelled():
            """What the client does to tasks when it loses the scheduler."""
            future = client.submit(print)
            future.cancel()
            yield "one", future

        with pytest.raises(ComputationError, match="the scheduler of the workers is lost"):
            list(in_turn(client, cancelled()))
    with pytest.raises(ComputationError, match="the scheduler of the workers is lost"):
        list(in_turn(client, []))
