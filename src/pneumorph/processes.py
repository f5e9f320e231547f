"""Other programs, which are ended with this one, and folders for what they exchange."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumorph.interrupts import cleaned_up, stop_if_asked

_SAFE = "PYTHONSAFEPATH"

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


def python(*arguments: str) -> list[str]:
    """The command of a program in Python, for which modules in the working directory are not meant by their names."""
    return [sys.executable, "-P", *arguments]


@contextmanager
def program(command: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """A program that goes on beside this one until the end of the block, and whose outputs are not wanted.

    Its standard input ends when this program does, see `end_with_input`.
    """
    nowhere = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere)
    with cleaned_up(lambda: _ended(process)):
        try:
            yield process
        finally:
            _ended(process)
            assert process.stdin is not None
            process.stdin.close()


def wait(process: subprocess.Popen[Any], seconds: float) -> None:
    """Wait for the end of a program.

    Raises
    ------
    subprocess.TimeoutExpired
        If it goes on after so many seconds.
    """
    latest = time.monotonic() + seconds
    while process.poll() is None:
        stop_if_asked()
        if time.monotonic() > latest:
            raise subprocess.TimeoutExpired(process.args, seconds)
        time.sleep(_LOOK)
    # The same Ctrl-C may have ended it.
    stop_if_asked()


def end_with_input() -> None:
    """Have this process end when its standard input does, which whoever started it holds open while it lives."""

    def watch() -> None:
        with contextlib.suppress(OSError):
            while os.read(0, 4096):
                pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def without_working_directory() -> Iterator[None]:
    """Have programs in Python that libraries start inside take no modules from the working directory."""
    before = os.environ.get(_SAFE)
    os.environ[_SAFE] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(_SAFE, None)
        else:
            os.environ[_SAFE] = before


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
