"""Reading files of others: only plain files, and only up to a size."""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from pneumorph.cad.read import FORMATS
from pneumorph.errors import ProblemError, clipped

MOST_BYTES = 2_000_000
"""Largest problem or study file, and file beside it, that is read: a hundred times what a long one has."""

MOST_PARTS = 64
"""Parts of a dotted key, of which no problem needs more than five: the parser takes memory by their square."""

_NAME = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_NAME}(?:[ \t]*+\.[ \t]*+{_NAME}){{{MOST_PARTS},}}")


@contextmanager
def open_plain(path: Path, most: int) -> Iterator[BinaryIO]:
    """Open a plain file of at most `most` bytes.

    Raises
    ------
    OSError
        Also if it is a device, a pipe or a directory, or has more bytes; its `strerror` says so.
    """
    # Without waiting for whoever may write into a pipe.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is a device or a pipe, not a file", str(path))
        if status.st_size > most:
            raise _too_large(path, most)
        with open(handle, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(handle)


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a plain file of at most `most` bytes; raises OSError as `open_plain` does."""
    with open_plain(path, most) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise _too_large(path, most)
    return data


def _too_large(path: Path, most: int) -> OSError:
    return OSError(errno.EFBIG, f"it has more than {most / 1e6:g} MB", str(path))


def read_toml(path: Path, where: str, example: str) -> dict[str, Any]:
    """The table of a TOML file.

    Parameters
    ----------
    where : names the file in messages.
    example : what the file should be, for messages about something else.

    Raises
    ------
    ProblemError
        One line: the file, what is wrong, and how to fix it.
    """
    if path.suffix.lower() in FORMATS and path.is_file():
        raise ProblemError(
            f'{where}: is a CAD file; give {example} with file = "{path.name}" under [body], for which `pneumorph new '
            "NAME --kind dome` writes one to start from; see docs/how_to/cad.md"
        )
    try:
        # Some editors begin UTF-8 with a byte order mark.
        text = read_bytes(path).decode("utf-8-sig")
    except FileNotFoundError:
        raise ProblemError(f"{where}: there is no such file; check the path") from None
    except IsADirectoryError:
        raise ProblemError(f"{where}: is a directory; give {example} in it") from None
    except UnicodeDecodeError:
        raise ProblemError(f"{where}: is not UTF-8 text; save it as UTF-8") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ProblemError(f"{where}: cannot be read ({why}); check the path and its permissions") from None
    return parse_toml(text, where)


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The table of a TOML text.

    Raises
    ------
    ProblemError
        If the text is too long, nested too deep, or not TOML.
    """
    if len(text) > MOST_BYTES:
        raise ProblemError(
            f"{where}: has more than {MOST_BYTES / 1e6:g} MB, too many for a problem file; make it shorter"
        )
    if _LONG_KEY.search(text):
        raise ProblemError(f"{where}: has a dotted key of more than {MOST_PARTS} parts; no key has so many, shorten it")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        how = _mended(text, str(error)) or "fix it there"
        raise ProblemError(f"{where}: is not TOML ({clipped(str(error), 150)}); {how}") from None
    except RecursionError:
        raise ProblemError(
            f"{where}: is not TOML that can be read (too many lists within lists); write it flatter"
        ) from None
    except ValueError:
        raise ProblemError(
            f"{where}: is not TOML that can be read (a number has too many digits); shorten it"
        ) from None


def _mended(text: str, reason: str) -> str | None:
    """How to write the line at which the parser has stopped, for slips that are common; None for others."""
    if (at := re.search(r"line ([0-9]+)", reason)) is None:
        return None
    lines = text.splitlines()
    line = lines[int(at[1]) - 1][:500] if int(at[1]) <= len(lines) else ""
    if re.search("[“”„‟]", line):
        return 'its quotes are curly; write straight ones, "…"'
    if "overwrite" in reason:
        return "it is given twice; leave one of them out"
    if found := re.search(r"[=\[,]\s*([-+]?[0-9.]+\s*[A-Za-zµ°%/][^\s,\]}#]*)", line):
        return f'quantities are in quotes; write "{clipped(found[1], 40)}"'
    return None
