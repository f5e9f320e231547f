"""Programs that are sent signals: each is a process of its own, that says a word where it is to be interrupted."""

import os
import select
import subprocess
import sys
from dataclasses import dataclass

import pytest

from pneumorph import interrupts

SENT = [(number, 128 + number) for number in interrupts.SIGNALS]
"""Signals that end commands, with the exit status."""

POSIX = pytest.mark.skipif(os.name != "posix", reason="processes are sent signals as on POSIX systems")

LINUX = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="asks Linux when a process ends that is not a child")


@dataclass(frozen=True)
class Ended:
    """How a program ended: its status, and what it printed that was not read before."""

    status: int
    out: str
    err: str


HUNG = 600.0
"""Seconds after which a program that should end is taken to hang."""


AS_IN_A_TERMINAL = """
import os, signal, sys
for number in (signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN if str(int(number)) in sys.argv[1].split() else signal.SIG_DFL)
os.execv(sys.executable, [sys.executable, *sys.argv[2:]])
"""
"""Programs that a shell starts in the background ignore Ctrl-C, and so would those that they start."""


def start(arguments: list[str], ignoring: tuple[int, ...] = (), **options) -> subprocess.Popen:
    """Start Python with arguments and its input and outputs piped; it ignores no signals but those given."""
    ignored = " ".join(str(int(number)) for number in ignoring)
    command = [sys.executable, "-c", AS_IN_A_TERMINAL, ignored, *arguments]
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(command, text=True, **pipes, **options)


def heard(process: subprocess.Popen, beginning: str, stream: str = "stdout") -> str:
    """Read lines until one begins so, and return it."""
    for line in getattr(process, stream):
        if line.startswith(beginning):
            return line
    raise AssertionError(f"it ended before it said {beginning}: {process.communicate()[1]}")


def interrupted(process: subprocess.Popen, *numbers: int) -> Ended:
    """Send signals, close the program's input, and wait for its end."""
    try:
        for number in numbers:
            os.kill(process.pid, number)
        out, err = process.communicate(timeout=HUNG)
        return Ended(process.returncode, out, err)
    finally:
        process.kill()
        process.wait()


def ends(child: int) -> bool:
    """Wait until a process ends, of which this is the file descriptor (`os.pidfd_open`); whether it does."""
    try:
        return bool(select.select([child], [], [], HUNG)[0])
    finally:
        os.close(child)


def arrive(number: int) -> None:
    """Have a signal noted in this process, as by the thread that receives them; it is raised by the next check."""
    assert interrupts._deferring, "here the process would end at once"
    interrupts._noted = number
