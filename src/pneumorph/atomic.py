"""Write files so that an interruption leaves the old content or the new one, never a mixture, and nothing elsewhere.

A directory that comes from elsewhere may have links where files are to be written. None is followed: a file is written
under a random name that nobody has taken, and then put in place of whatever has its name, which for a link is the link.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from pneumorph.interrupts import cleaned_up

_BY_HANDLE = {os.open, os.unlink, os.rename} <= os.supports_dir_fd and os.listdir in os.supports_fd
"""Whether files are named by the handle of their folder, which stays the same folder whatever its path leads to."""

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_BINARY = getattr(os, "O_BINARY", 0)


class Folder:
    """A folder in which files are written and removed. Made by `opened`."""

    def __init__(self, path: Path, handle: int | None):
        self._path, self._handle = path, handle

    def names(self) -> list[str]:
        """The names of what is in it."""
        return os.listdir(self._path if self._handle is None else self._handle)

    def remove(self, name: str) -> None:
        """Remove a file, or a link itself; nothing is done if it is gone."""
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._named(name), dir_fd=self._handle)

    def open(self, name: str, flags: int) -> int:
        """A handle of a file that is no link; OSError if it is one."""
        if not _NO_LINK and (self._path / name).is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(self._path / name))
        return os.open(self._named(name), flags | _NO_LINK | _BINARY, 0o666, dir_fd=self._handle)

    def replace(self, name: str, by: str) -> None:
        """Put one file in place of another, or of a link."""
        os.replace(self._named(by), self._named(name), src_dir_fd=self._handle, dst_dir_fd=self._handle)

    def _named(self, name: str) -> str | Path:
        return self._path / name if self._handle is None else name


@contextmanager
def opened(path: Path, follow: bool = True) -> Iterator[Folder]:
    """Open a folder; with `follow` false one that is no link.

    Raises
    ------
    OSError
        If there is none, or it is a link that must not be followed.
    """
    if not follow and _is_link(path):
        words = f"{path.name} is a link, which is not followed; put a folder there"
        raise NotADirectoryError(errno.ENOTDIR, words, str(path))
    handle = None
    if _BY_HANDLE:
        # Again: it may have become one.
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | (0 if follow else _NO_LINK))
    try:
        yield Folder(path, handle)
    finally:
        if handle is not None:
            os.close(handle)


def make_folder(path: Path) -> Path:
    """Make a folder in one that exists, unless it is there; OSError if it is a link, or no folder."""
    with contextlib.suppress(FileExistsError):
        path.mkdir()
    with opened(path, follow=False):
        return path


def write_bytes(path: Path, content: bytes, follow: bool = True) -> None:
    """Replace the file at `path` in one step, once the new content is on disk.

    With `follow` false its folder must not be a link.
    """
    temporary = f".{path.name[:100]}.{secrets.token_hex(8)}.new"
    with opened(path.parent, follow) as folder, cleaned_up(lambda: folder.remove(temporary)):
        try:
            with open(folder.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL), "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            folder.replace(path.name, temporary)
        except (OSError, KeyboardInterrupt):
            with contextlib.suppress(OSError):
                folder.remove(temporary)
            raise


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray], follow: bool = True) -> None:
    """Replace the .npz file at `path` in one step; see `write_bytes`."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    write_bytes(path, content.getvalue(), follow)


def append_line(path: Path, line: str) -> None:
    """Append a line by a single write: an interruption leaves all of it, an incomplete last line, or nothing.

    Where it cannot be written as a whole, nothing is left of it.
    """
    with opened(path.parent) as folder:
        handle = folder.open(path.name, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
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


def publish(source: Path, folder: Path) -> None:
    """Write all files of a folder, and of those in it, into another one that exists; links there are not followed."""
    for path in sorted(source.iterdir()):
        if path.is_dir():
            publish(path, make_folder(folder / path.name))
        else:
            write_bytes(folder / path.name, path.read_bytes())


def _is_link(path: Path) -> bool:
    return path.is_symlink() or getattr(path, "is_junction", bool)()
