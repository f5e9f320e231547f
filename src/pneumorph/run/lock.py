"""One run at a time in a directory: a lock that ends with its process, however that ends.

Systems without `fcntl` (Windows) and file systems that know no locks have none: there, nothing keeps a second run out.
"""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pneumorph.errors import ProblemError

try:
    import fcntl
except ImportError:
    fcntl = None

NAME = ".lock"
"""The file that is locked; it stays, and means nothing unless a process holds it."""


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Hold a run's directory.

    Raises
    ------
    ProblemError
        If another run goes on in it.
    OSError
        If it cannot be written.
    """
    if fcntl is None:
        yield
        return
    handle = os.open(directory / NAME, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.read(handle, 200).decode(errors="replace").strip() or "its process is not known"
            raise ProblemError(
                f"{directory}: another run goes on in it ({holder}); wait until it ends, or name another --out"
            ) from None
        except OSError:
            pass
        else:
            with contextlib.suppress(OSError):
                os.ftruncate(handle, 0)
                os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield
    finally:
        os.close(handle)
