"""One run at a time in a directory: a lock that ends with its process, however that ends.

On file systems that know no locks there is none: there, nothing keeps a second run out.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from pneumorph.errors import ProblemError
from pneumorph.problem.reading import read_bytes

NAME = ".lock"
"""The file that is locked; it stays, and means nothing unless a process holds it."""

WITHOUT_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}
"""What file systems say that know no locks."""


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Lock a run's directory.

    Raises
    ------
    ProblemError
        If another run goes on in it.
    OSError
        If it cannot be written.
    """
    path = directory / NAME
    lock = FileLock(path, timeout=0, thread_local=False)
    try:
        lock.acquire()
    except Timeout:
        raise ProblemError(
            f"{directory}: another run goes on in it ({_holder(path)}); wait until it ends, or name another --out"
        ) from None
    except NotImplementedError:
        pass
    except OSError as error:
        if error.errno not in WITHOUT_LOCKS:
            raise
    else:
        # Windows lets nobody write or read a locked file: there, messages do not name the process.
        with contextlib.suppress(OSError):
            path.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")
    try:
        yield
    finally:
        lock.release()


def _holder(path: Path) -> str:
    """Which process holds a lock."""
    try:
        said = read_bytes(path, 200).decode(errors="replace").strip()
    except OSError:
        said = ""
    return said or "its process is not known"
