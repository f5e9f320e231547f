"""Run the members of a study on Dask: on this machine, on the scheduler at an address, or on SLURM."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from dask import config
from dask.system import CPU_COUNT
from distributed import Client, Future, KilledWorker, LocalCluster, Security
from distributed.system import MEMORY_LIMIT

from pneumorph.errors import ProblemError, short
from pneumorph.optimize.settings import LoopSettings
from pneumorph.processes import temporary_folder, without_working_directory
from pneumorph.results import HistoryEntry, from_json
from pneumorph.study.file import Member
from pneumorph.study.in_turn import in_turn
from pneumorph.study.members import TOPIC, MemberEnd, run_on_worker

LOOPBACK = "127.0.0.1"

# Dask documents that None is accepted here; its annotation allows only text.
_NONE = cast(str, None)

TLS = {"--tls-ca": "tls_ca_file", "--tls-cert": "tls_client_cert", "--tls-key": "tls_client_key"}
"""Dask's name of what each option gives."""

KILLS = 5
"""A member fails after so many killed workers; before that, another worker resumes it from its checkpoint."""

WORKER_MEMORY = 2_000_000_000
"""Bytes for a worker: an example at its own size needs 1.7 GB at most."""


@contextmanager
def connected(
    address: str | None, workers: int | None = None, tls: Mapping[str, Path | None] | None = None
) -> Iterator[Client]:
    """A client of the scheduler at an address, of a SLURM cluster, or of processes on this machine.

    Client and scheduler run what the other sends them: only a scheduler that is named here is connected to, and the
    processes on this machine listen on its loopback interface alone, without a dashboard.

    Parameters
    ----------
    address : "tcp://…", "tls://…", "slurm", or None for this machine
        For SLURM, queue, cores and memory come from Dask's own configuration (jobqueue.slurm).
    workers : number of workers to start; unused with a scheduler's address.
        By default one for every core and for every `WORKER_MEMORY` of this machine, whichever are fewer.
    tls : {option: file}
        "--tls-ca", "--tls-cert" and "--tls-key" for an address with tls; without them those of Dask's configuration.

    Raises
    ------
    ProblemError
        If no scheduler answers at the address, or SLURM cannot be used here.
    """
    security = _security(address, {option: path for option, path in (tls or {}).items() if path is not None})
    logging.getLogger("distributed").setLevel(logging.ERROR)
    count = workers or workers_for(CPU_COUNT, MEMORY_LIMIT)
    if address == "slurm":
        with without_working_directory(), _slurm(count) as cluster, Client(cluster) as client:
            yield client
        return
    if address is not None:
        if "://" not in address:
            raise ProblemError(
                f'--cluster "{short(address)}": is not an address; write tcp://host:8786, tls://… or slurm'
            )
        try:
            client = Client(address, timeout=20, security=security)
        except (OSError, ValueError, TypeError) as error:
            raise ProblemError(
                f"--cluster {address}: no scheduler answers there ({error}); check that it is running"
            ) from None
        with client:
            yield client
        return
    with (
        without_working_directory(),
        temporary_folder() as folder,
        config.set({"distributed.scheduler.allowed-failures": KILLS, "temporary-directory": str(folder)}),
        LocalCluster(
            host=LOOPBACK,
            n_workers=count,
            threads_per_worker=1,
            memory_limit=0,
            dashboard_address=_NONE,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def workers_for(cores: int, memory: int) -> int:
    """The number of workers that a machine with so many cores and bytes of memory can bear, at least one."""
    return max(1, min(cores, memory // WORKER_MEMORY))


def _security(address: str | None, files: Mapping[str, Path]) -> Security | None:
    """What encrypts a connection; None where Dask's own configuration says it."""
    if not files:
        return None
    named = ", ".join(files)
    if address is None or not address.startswith("tls://"):
        raise ProblemError(f"{named}: is for a scheduler at tls://… only; name its address with --cluster")
    if set(files) != set(TLS):
        raise ProblemError(f"{named}: is not enough; give {', '.join(TLS)}")
    for option, path in files.items():
        if not path.is_file():
            raise ProblemError(f"{option} {path}: there is no such file; check the path")
    return Security(require_encryption=True, **{TLS[option]: str(path) for option, path in files.items()})


def _slurm(workers: int) -> Any:
    """A cluster of SLURM jobs."""
    try:
        SLURMCluster = import_module("dask_jobqueue").SLURMCluster
    except ImportError:
        raise ProblemError(
            "--cluster slurm: needs dask-jobqueue; install it with pip install pneumorph[slurm]"
        ) from None
    try:
        # Asked for by the user's configuration, the page of the scheduler is where that says.
        given = config.get("jobqueue.slurm.scheduler-options", None) or {}
        cluster = SLURMCluster(scheduler_options={"dashboard_address": f"{LOOPBACK}:0", **given})
    except (ValueError, TypeError) as error:
        raise ProblemError(f"--cluster slurm: {error}; set it in Dask's configuration under jobqueue.slurm") from None
    cluster.scale(jobs=workers)
    return cluster


def run_members(
    client: Client,
    members: Iterable[tuple[Member, LoopSettings | None]],
    out: Path,
    on_design: Callable[[str, HistoryEntry], None],
    drawn: bool = True,
) -> Iterator[MemberEnd]:
    """Run members, each in its directory under `out`, and yield their ends as they come.

    Parameters
    ----------
    client : Client
        Of Dask, with its workers.
    members : iterable of (Member, LoopSettings or None)
        With settings of their loops, None for the usual ones. Each is taken from there when a worker is free for it.
    out : Path
        The study's directory.
    on_design : callable
        Takes the member's name and the history entry of every accepted design.
    drawn : bool
        Whether pictures and a page of every member are made.

    Raises
    ------
    ComputationError
        If the scheduler is lost.
    """

    def received(event: tuple[Any, dict[str, Any]]) -> None:
        _, message = event
        on_design(message["name"], from_json(HistoryEntry, message["entry"]))

    client.subscribe_topic(TOPIC, received)

    def tasks() -> Iterator[tuple[str, Future]]:
        for member, settings in members:
            where, key = str((out / member.name).absolute()), f"{member.name}-{os.urandom(4).hex()}"
            given = member.name, member.problem, where, drawn, member.begin, settings
            yield member.name, client.submit(run_on_worker, *given, key=key, pure=False)

    for name, future in in_turn(client, tasks()):
        yield _end_of(name, future)


def _end_of(name: str, future: Future) -> MemberEnd:
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, KilledWorker):
        return MemberEnd(name, False, "its workers were killed repeatedly; is there enough memory?")
    return MemberEnd(name, False, f"{type(error).__name__}: {error}".splitlines()[0])
