"""Signals that end the `pneumorph` command: Ctrl-C (SIGINT), SIGTERM and SIGHUP.

Python raises KeyboardInterrupt wherever its interpreter is, also in callbacks of compiled libraries, which swallow it
or crash. So the command lets no signal raise anything: a thread receives them. Where something is to be saved
(`deferred`), the first one is noted, and raised by `stop_if_asked` where it is safe; everywhere else, and by a second
Ctrl-C, the process ends at once.

Nothing here has an effect unless the command has called `install`: in a Python program, signals do what they always do.
Nothing that takes time is imported, since this comes first.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

PATIENCE = 1.0
"""Seconds after which the command says that it has noted a signal and goes on to where it can stop."""

_lock = threading.Lock()
_deferring = False
_noted = 0
_ending = False
_cleanups: list[Callable[[], object]] = []


class Interrupted(KeyboardInterrupt):
    """A signal has asked the command to stop.

    Attributes
    ----------
    number : of the signal.
    """

    def __init__(self, number: int, message: str = "stopped"):
        super().__init__(message)
        self.number = number

    @property
    def status(self) -> int:
        """The exit status: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP."""
        return 128 + self.number

    def saying(self, message: str) -> Interrupted:
        """The same with another message."""
        return Interrupted(self.number, message)


def install() -> None:
    """Receive the signals from now on; called in the main thread. Those that the process ignores stay ignored."""
    source, sink = os.pipe()
    if os.name == "posix":
        os.set_blocking(sink, False)
    try:
        # A copy: where the standard error is closed, another file may get its number.
        words = os.dup(2)
    except OSError:
        words = -1
    threading.Thread(target=_receive, args=(source, words), daemon=True).start()
    # The interpreter writes the numbers of signals there as they arrive, also while compiled code is executed.
    signal.set_wakeup_fd(sink, warn_on_full_buffer=False)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)
    # The last of what Python does before it takes these away: a signal would kill a process that has done everything.
    atexit.register(_ignore)


@contextmanager
def deferred() -> Iterator[None]:
    """Have the first signal raise Interrupted only where `stop_if_asked` is called inside, or at the end.

    An error after a signal is a consequence of it, or does not matter any more: Interrupted takes its place.
    """
    global _deferring
    with _lock:
        _deferring = True
    try:
        yield
    except Exception as error:
        if number := _no_longer():
            raise Interrupted(number) from error
        raise
    finally:
        number = _no_longer()
    if number:
        raise Interrupted(number)


def stop_if_asked() -> None:
    """Raise Interrupted if a signal has come; cheap, to be called several times a second where much is computed."""
    if _ending:
        # What is cleaned up, such as a program that is waited for, must not let this one go on.
        threading.Event().wait()
    if _noted:
        raise Interrupted(_noted)


def leave(status: object) -> None:
    """End the process here if its status is that of a signal: what Python and libraries do at their end takes time."""
    if isinstance(status, int) and status - 128 in SIGNALS:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


@contextmanager
def cleaned_up(cleanup: Callable[[], object]) -> Iterator[None]:
    """Have a function called where the process ends at once inside; else nothing is done with it."""
    _cleanups.append(cleanup)
    try:
        yield
    finally:
        _cleanups.remove(cleanup)


def _ignore() -> None:
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _no_longer() -> int:
    """End the deferring, and return the number of the signal that has come; 0 for none."""
    global _deferring, _noted
    with _lock:
        number, _deferring, _noted = _noted, False, 0
    return number


def _receive(source: int, words: int) -> None:
    """Note signals, or end the process, as their numbers come through a pipe."""
    global _noted
    while True:
        for number in os.read(source, 64):
            if number not in SIGNALS:
                continue
            with _lock:
                first = not _noted
                if _deferring and first:
                    _noted = number
                    late = threading.Timer(PATIENCE, _say_so, (words,))
                    late.daemon = True
                    late.start()
                elif first or number == signal.SIGINT:
                    # Others often come in pairs, and are obeyed already.
                    _end(number, words, "stopped" if first else "ended at once")


def _say_so(words: int) -> None:
    if _noted:
        _write(words, "stops after the step in progress; Ctrl-C ends it at once")


def _end(number: int, words: int, sentence: str) -> None:
    global _ending
    _ending = True
    for cleanup in reversed(_cleanups):
        with contextlib.suppress(Exception):
            cleanup()
    _write(words, sentence)
    os._exit(128 + number)


def _write(words: int, sentence: str) -> None:
    with contextlib.suppress(OSError):
        # On a terminal: on a line of its own, and with the cursor that a progress bar may have hidden.
        begin = "\n\x1b[?25h" if os.isatty(words) else ""
        os.write(words, f"{begin}pneumorph: {sentence}\n".encode())
