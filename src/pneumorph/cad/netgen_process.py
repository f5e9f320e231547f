"""Netgen in a process of its own, so that a crash of its ends the mesh and not the program.

Netgen's optimiser frees memory twice on some meshes, which nothing but the end of a process can follow. What it prints
from C++ is not seen either.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Lock, Timer
from typing import Any

from pneumorph.doing import doing
from pneumorph.errors import ComputationError, MeshError
from pneumorph.interrupts import cleaned_up, stop_if_asked
from pneumorph.processes import python

_CHILD = Path(__file__).with_name("netgen_child.py")

_FAILED = {
    "fill": "the space between the surfaces could not be filled with tetrahedra",
    "optimise": "the tetrahedra between the surfaces could not be improved",
    "compose": "the body cannot be made of its parts; change its sizes",
    "fill_voids": "has voids that cannot be filled; fill them in CAD",
    "triangles": "has triangles that cannot be remeshed; repair them in a mesh program",
    "distances": "has faces from which distances cannot be measured; repair them in CAD",
    "solids": "has faces that cannot be meshed; repair them in CAD",
}

_WORDS = {
    "fill": "filling the body with tetrahedra",
    "optimise": "improving tetrahedra",
    "compose": "making the body of its parts",
    "fill_voids": "filling voids of the file",
    "triangles": "remeshing the triangles of the file",
    "distances": "measuring distances from faces",
    "solids": "meshing the faces of the file",
}

_LEAVING = 5.0
"""Seconds in which a process that gives no answer has left a status."""

_lock = Lock()
_running: tuple[int, subprocess.Popen[bytes]] | None = None
"""The process with this one's number, for a fork of this one must not use it."""


def call(name: str, *arguments: Any, seconds: float | None = None) -> tuple[Any, ...]:
    """What a function of `netgen_child` returns: points (n, 3) in mm, the nodes of elements (m, k), and what it adds.

    Parameters
    ----------
    name : of the function.
    arguments : of the function.
    seconds : after which it is ended.

    Raises
    ------
    MeshError
        If Netgen fails, for example because the triangles of two walls cross, or crashes.
    ComputationError
        If it cannot be started, or has not enough memory.
    """
    with doing(_WORDS.get(name, "waiting for the mesher")), _lock, _ended_after(seconds) as late:
        child = _process()
        assert child.stdin is not None and child.stdout is not None
        try:
            # Not `_end`, for the cleanup is called in another thread.
            with cleaned_up(child.kill):
                pickle.dump((name, arguments), child.stdin)
                child.stdin.flush()
                answer = pickle.load(child.stdout)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(_LEAVING)
            status = child.returncode
            _end()
            # What ends this program at once has ended that one.
            stop_if_asked()
            if late.is_set():
                raise MeshError(f"takes longer than {seconds:g} s; simplify it") from None
            raise _crashed(status) from error
        except BaseException:
            _end()  # else the next call would get this one's answer
            raise
    if isinstance(answer[0], str):
        raise _failed(name, *answer)
    if not len(answer[1]):
        raise MeshError(_FAILED[name])
    return answer


@contextlib.contextmanager
def _ended_after(seconds: float | None) -> Iterator[Event]:
    """End the process after so many seconds in this block, and say so by the event."""
    late = Event()

    def end() -> None:
        late.set()
        if _running is not None:
            _running[1].kill()

    if seconds is None:
        yield late
        return
    timer = Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()


def _crashed(status: int | None) -> ComputationError:
    """Why there was no answer, by the exit status of the process."""
    if status is not None and status == -getattr(signal, "SIGKILL", 0):
        return ComputationError("the mesher, Netgen, was killed, perhaps for want of memory; make mesh.size larger")
    return MeshError(f"the mesher, Netgen, crashed (status {status})")


def _failed(name: str, kind: str, text: str) -> ComputationError:
    """Why a call failed, by the class and the text of the exception that it raised."""
    if kind in ("ImportError", "ModuleNotFoundError"):
        return ComputationError(f"the mesher, Netgen, cannot be loaded ({text}); install netgen-mesher again")
    if kind == "Unsuitable":
        return MeshError(text)
    if kind == "MemoryError":
        return ComputationError("the mesher, Netgen, has not enough memory; make mesh.size larger")
    return MeshError(f"{_FAILED[name]} ({text})")


def _process() -> subprocess.Popen[bytes]:
    global _running
    if _running is None or _running[0] != os.getpid():
        command = python(str(_CHILD))
        pipe = subprocess.PIPE
        try:
            # A session of its own: what a Ctrl-C means is for this program.
            child = subprocess.Popen(
                command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, start_new_session=True
            )
        except OSError as error:
            raise ComputationError(
                f"the mesher, Netgen, cannot be started ({error}); close other programs, or see whether "
                f"Python is where it was: {sys.executable}"
            ) from error
        _running = os.getpid(), child
    return _running[1]


@atexit.register
def _end() -> None:
    """End the process, whatever it does."""
    global _running
    if _running is None or _running[0] != os.getpid():
        return
    child, _running = _running[1], None
    child.kill()
    child.wait()
    for stream in (child.stdin, child.stdout):
        assert stream is not None
        # A call that was not read may still be in the buffer.
        with contextlib.suppress(OSError):
            stream.close()
