"""Write files so that an interruption leaves the old content or the new one, never a mixture."""

import contextlib
import errno
import io
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pneumorph.interrupts import cleaned_up


def write_bytes(path: Path, content: bytes) -> None:
    """Replace the file at `path` in one step, once the new content is on disk."""
    temporary = path.with_name(f".{path.name}.new")
    with cleaned_up(lambda: temporary.unlink(missing_ok=True)):
        try:
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except (OSError, KeyboardInterrupt):
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Replace the .npz file at `path` in one step."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    write_bytes(path, content.getvalue())


def append_line(path: Path, line: str) -> None:
    """Append a line by a single write: an interruption leaves all of it, an incomplete last line, or nothing.

    Where it cannot be written as a whole, nothing is left of it.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        before, content = os.fstat(handle).st_size, f"{line}\n".encode()
        try:
            if os.write(handle, content) < len(content):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
            os.fsync(handle)
        except OSError:
            os.ftruncate(handle, before)
            raise
    finally:
        os.close(handle)
