"""Run the members of a study on Dask: on this machine, on the scheduler at an address, or on SLURM."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from dask import config
from distributed import Client, KilledWorker, LocalCluster, as_completed

from pneumorph.analysis import HistoryEntry, from_json
from pneumorph.errors import ProblemError
from pneumorph.study.file import Member
from pneumorph.study.members import TOPIC, MemberEnd, run_on_worker

KILLS = 5
"""A member fails after so many killed workers; before that, another worker resumes it from its checkpoint."""


@contextmanager
def connected(address: str | None, workers: int | None = None) -> Iterator[Client]:
    """A client of the scheduler at an address, of a SLURM cluster, or of processes on this machine.

    Parameters
    ----------
    address : "tcp://…", "slurm", or None for this machine
        For SLURM, queue, cores and memory come from Dask's own configuration (jobqueue.slurm).
    workers : number of workers to start, by default one per core of this machine; unused with a scheduler's address.

    Raises
    ------
    ProblemError
        If no scheduler answers at the address, or SLURM cannot be used here.
    """
    logging.getLogger("distributed").setLevel(logging.ERROR)
    count = workers or os.cpu_count() or 1
    if address == "slurm":
        with _slurm(count) as cluster, Client(cluster) as client:
            yield client
        return
    if address is not None:
        try:
            client = Client(address, timeout=20)
        except (OSError, ValueError, TypeError) as error:
            raise ProblemError(
                f"--cluster {address}: no scheduler answers there ({error}); check that it is running"
            ) from None
        with client:
            yield client
        return
    with (
        config.set({"distributed.scheduler.allowed-failures": KILLS}),
        LocalCluster(
            n_workers=count, threads_per_worker=1, memory_limit=0, dashboard_address="", silence_logs=logging.CRITICAL
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _slurm(workers: int) -> Any:
    """A cluster of SLURM jobs."""
    try:
        SLURMCluster = import_module("dask_jobqueue").SLURMCluster
    except ImportError:
        raise ProblemError(
            "--cluster slurm: needs dask-jobqueue; install it with pip install pneumorph[slurm]"
        ) from None
    try:
        cluster = SLURMCluster()
    except (ValueError, TypeError) as error:
        raise ProblemError(f"--cluster slurm: {error}; set it in Dask's configuration under jobqueue.slurm") from None
    cluster.scale(jobs=workers)
    return cluster


def run_members(
    client: Client, members: Mapping[str, Member], out: Path, on_design: Callable[[str, HistoryEntry], None]
) -> Iterator[MemberEnd]:
    """Run members, each in its directory under `out`, and yield their ends as they come.

    `on_design` is called with the member's name and the history entry of every accepted design.
    """

    def received(event: tuple[Any, dict[str, Any]]) -> None:
        _, message = event
        on_design(message["name"], from_json(HistoryEntry, message["entry"]))

    client.subscribe_topic(TOPIC, received)
    futures = {
        client.submit(
            run_on_worker, name, member.problem, str((out / name).absolute()), key=f"{name}-{os.urandom(4).hex()}",
            pure=False,
        ): name
        for name, member in members.items()
    }  # fmt: skip
    for future in as_completed(list(futures)):
        name = futures[future]
        error = future.exception()
        if error is None:
            yield future.result()
        elif isinstance(error, KilledWorker):
            yield MemberEnd(name, False, "its workers were killed repeatedly; is there enough memory?")
        else:
            yield MemberEnd(name, False, f"{type(error).__name__}: {error}".splitlines()[0])
