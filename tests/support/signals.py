"""Programs that are sent signals: each is a process of its own, that says a word where it is to be interrupted."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from pneumorph import interrupts

SENT = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
"""Signals that end commands, with the exit status."""


@dataclass(frozen=True)
class Ended:
    """How a program ended: its status, what it printed, and the seconds since it was first interrupted."""

    status: int
    out: str
    err: str
    late: float


AS_IN_A_TERMINAL = """
import os, signal, sys
for number in (signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN if str(int(number)) in sys.argv[1].split() else signal.SIG_DFL)
os.execv(sys.executable, [sys.executable, *sys.argv[2:]])
"""
"""Programs that a shell starts in the background ignore Ctrl-C, and so would those that they start."""


def start(arguments: list[str], ignoring: tuple[int, ...] = (), **options) -> subprocess.Popen:
    """Start Python with arguments and its outputs piped; it ignores no signals but those given."""
    ignored = " ".join(str(int(number)) for number in ignoring)
    command = [sys.executable, "-c", AS_IN_A_TERMINAL, ignored, *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def interrupted(process: subprocess.Popen, *numbers: int, pause: float = 0.3, seconds: float = 120.0) -> Ended:
    """Send signals one after another, and wait for the end."""
    began = time.perf_counter()
    try:
        for place, number in enumerate(numbers):
            if place:
                time.sleep(pause)
            os.kill(process.pid, number)
        out, err = process.communicate(timeout=seconds)
        return Ended(process.returncode, out, err, time.perf_counter() - began)
    finally:
        process.kill()
        process.wait()


def heard(process: subprocess.Popen, beginning: str) -> str:
    """Read lines until one begins so, and return it."""
    for line in process.stdout:
        if line.startswith(beginning):
            return line
    raise AssertionError(f"it ended before it said {beginning}: {process.communicate()[1]}")


def received(process: subprocess.Popen) -> None:
    """Wait until a process receives SIGTERM itself, which is soon after its start; Linux only."""
    status = Path("/proc", str(process.pid), "status")
    while process.poll() is None:
        caught = next(line for line in status.read_text().splitlines() if line.startswith("SigCgt"))
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.002)


def arrive(number: int) -> None:
    """Have a signal noted in this process, as by the thread that receives them; it is raised by the next check."""
    assert interrupts._deferring, "here the process would end at once"
    interrupts._noted = number
