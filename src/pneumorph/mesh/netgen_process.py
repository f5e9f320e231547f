"""Netgen in a process of its own, so that a crash of its ends the mesh and not the program.

Netgen's optimiser frees memory twice on some meshes, which nothing but the end of a process can follow. What it prints
from C++ is not seen either.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import subprocess
import sys
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from pneumorph.errors import MeshError

_CHILD = Path(__file__).with_name("netgen_child.py")

_lock = Lock()
_running: tuple[int, subprocess.Popen[bytes]] | None = None
"""The process with this one's number, for a fork of this one must not use it."""


def call(name: str, *arguments: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and the corners of tetrahedra (m, 4), by a function of `netgen_child`.

    Raises
    ------
    MeshError
        If Netgen fails, for example because the triangles of two walls cross.
    """
    with _lock:
        child = _process()
        assert child.stdin is not None and child.stdout is not None
        try:
            pickle.dump((name, arguments), child.stdin)
            child.stdin.flush()
            answer = pickle.load(child.stdout)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            _end()
            raise MeshError(f"the mesher, Netgen, crashed (status {child.returncode})") from error
        except BaseException:
            _end()  # else the next call would get this one's answer
            raise
    if answer is None or not len(answer[1]):
        raise MeshError("the space between the surfaces could not be filled with tetrahedra")
    return answer


def _process() -> subprocess.Popen[bytes]:
    global _running
    if _running is None or _running[0] != os.getpid():
        # -P: no module of this folder is meant where Netgen or NumPy import one of the same name.
        command = [sys.executable, "-P", str(_CHILD)]
        _running = os.getpid(), subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
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
