"""Tasks of Dask's workers in turn: each is submitted when a thread is free for it.

Dask gives a task to a worker as soon as it is submitted, and moves those that wait by what it guesses of how long they
take. It does not know that of tasks of minutes, and gives some to busy workers while others are idle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from queue import Empty, SimpleQueue
from typing import TypeVar, cast

from distributed import Client, Future

from pneumorph.errors import ComputationError
from pneumorph.interrupts import stop_if_asked

LOOK = 0.1
"""Seconds between looks at whether the command is to stop, and whether there are more workers."""

Label = TypeVar("Label")


def in_turn(client: Client, tasks: Iterable[tuple[Label, Future]]) -> Iterator[tuple[Label, Future]]:
    """Tasks as they end, each with its label.

    Parameters
    ----------
    client : Client
        Of Dask, with its workers; more of them may come later.
    tasks : iterable of (label, future)
        Each is submitted when it is taken from there.

    Raises
    ------
    ComputationError
        If the scheduler is lost.
    """
    waiting, more = iter(tasks), True
    running: dict[Future, Label] = {}
    done: SimpleQueue[Future] = SimpleQueue()
    while more or running:
        stop_if_asked()
        if more:
            free = threads_of(client) - len(running)
            begun = list(islice(waiting, max(0, free)))
            more = len(begun) >= free
            for label, future in begun:
                running[future] = label
                future.add_done_callback(done.put)
        try:
            future = done.get(timeout=LOOK)
        except Empty:
            continue
        if future.cancelled():
            raise _lost()
        yield running.pop(future), future


def threads_of(client: Client) -> int:
    """How many tasks its workers can run at once; one where there are none yet.

    Raises
    ------
    ComputationError
        If the scheduler is lost.
    """
    # A client that connects again has given up the tasks that it had.
    if client.status != "running":
        raise _lost()
    try:
        # Its annotation is that of clients which do not wait.
        return max(1, sum(cast(dict[str, int], client.nthreads()).values()))
    except OSError:
        raise _lost() from None


def _lost() -> ComputationError:
    return ComputationError("the scheduler of the workers is lost; start it again, and give the same command")
