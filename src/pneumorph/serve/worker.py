"""The process that solves: it gets demands through a pipe, the newest of which counts, and sends back what it found."""

from __future__ import annotations

import signal
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from pneumorph.analysis import Explored, Explorer, Stopped
from pneumorph.errors import PneumorphError
from pneumorph.interface.runs import open_run
from pneumorph.mechanics import rubbers_of
from pneumorph.output.format import warnings_of
from pneumorph.output.packed import pack
from pneumorph.output.report_shapes import packed_state
from pneumorph.problem import Problem
from pneumorph.results import to_json

MOST_DESIGNS = 3
"""Designs whose meshes and states are kept, the latest."""


@dataclass(frozen=True)
class RequestedState:
    """An equilibrium that is asked for.

    Attributes
    ----------
    path : the run directory.
    design : number of the design in it.
    written : when its file was written, in ns, so that a later design of the same number is another one.
    pressures : chambers with MPa.
    """

    path: Path
    design: int
    written: int
    pressures: tuple[tuple[str, float], ...]


@dataclass(frozen=True, eq=False)
class Answer:
    """What was found: whether there is an equilibrium, and the block of it for the page (see `output.packed`)."""

    converged: bool
    block: bytes


def work(connection: Connection) -> None:
    """Answer demands until the other end of the pipe is closed.

    What is sent back is a pair: the demand, and its `Answer`, or None where a newer demand came before it was found.
    """
    # Ctrl-C is for the server, which closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        while True:
            wanted = connection.recv()
            while connection.poll():
                wanted = connection.recv()
            connection.send((wanted, _answer(wanted, connection)))
    except (EOFError, OSError):
        return


def _answer(wanted: RequestedState, connection: Connection) -> Answer | None:
    try:
        explorer = _explorer(wanted.path, wanted.design, wanted.written)
        # Anything in the pipe is a newer demand.
        explored = explorer.at(dict(wanted.pressures), connection.poll)
    except Stopped:
        return None
    except PneumorphError as error:
        return failure(" ".join(str(error).split()))
    state, arrays = {}, {}
    if explored.fields is not None:
        state, arrays = packed_state(explorer.problem, explored.fields, dict(wanted.pressures), explored.step)
    facts = {"step": to_json(explored.step), "warnings": _warnings(explorer.problem, explored), "state": state}
    return Answer(explored.step.converged, pack(facts, arrays, level=1))


def failure(reason: str) -> Answer:
    """The answer where nothing could be computed, with one line that says why."""
    facts: dict[str, Any] = {"step": {"converged": False, "reason": reason}, "warnings": [], "state": {}}
    return Answer(False, pack(facts, {}, level=1))


@lru_cache(MOST_DESIGNS)
def _explorer(path: Path, design: int, written: int) -> Explorer:
    # The command has asked about code in it, and no objective is evaluated.
    return open_run(path, trust=True).design(design).explorer()


def _warnings(problem: Problem, explored: Explored) -> list[str]:
    step = explored.step
    if not step.converged:
        return []
    return [f"{said[0].upper()}{said[1:]}." for said in warnings_of(rubbers_of(problem), step)]
