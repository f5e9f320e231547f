"""Other programs, which are ended with this one, and folders for what they exchange."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumorph.interrupts import cleaned_up, stop_if_asked

_LOOK = 0.1
"""Seconds between looks at whether a program goes on, and whether it should."""


def run(command: Sequence[str], seconds: float, folder: str | Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program to its end and return what it printed; it is ended if this one is interrupted.

    Raises
    ------
    subprocess.TimeoutExpired
        If it takes more than so many seconds; it is then ended.
    OSError
        If it cannot be started.
    """
    pipe, latest = subprocess.PIPE, time.monotonic() + seconds
    with (
        subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, errors="replace", cwd=folder) as process,
        cleaned_up(lambda: _ended(process)),
    ):
        try:
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    out, err = process.communicate(timeout=_LOOK)
                    break
                if time.monotonic() > latest:
                    raise subprocess.TimeoutExpired(command, seconds)
                stop_if_asked()
        except BaseException:
            process.kill()
            raise
    # The same Ctrl-C may have ended it.
    stop_if_asked()
    return subprocess.CompletedProcess(command, process.returncode, out, err)


@contextmanager
def program(command: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """A program that goes on beside this one until the end of the block, and whose outputs are not wanted."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with cleaned_up(lambda: _ended(process)):
        try:
            yield process
        finally:
            _ended(process)


def _ended(process: subprocess.Popen[Any]) -> None:
    process.kill()
    process.wait()


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder that is removed at the end, however that comes."""
    with (
        tempfile.TemporaryDirectory(prefix="pneumorph-") as name,
        cleaned_up(lambda: shutil.rmtree(name, ignore_errors=True)),
    ):
        yield Path(name)
