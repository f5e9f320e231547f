"""A limit to the time that a user's code may take while it is loaded."""

from __future__ import annotations

import ctypes
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

PROCESSOR, WALL = 3.0, 20.0
"""Seconds of the thread's processor time, which do not depend on what else the machine does, and on the clock."""

_LOOK, _AGAIN = 0.2, 2.0  # seconds between looks at the clocks, and to where TooLong is raised once more


class TooLong(BaseException):
    """The code has taken too long; not an Exception, so that the code does not catch it."""


@contextmanager
def deadline(processor: float = PROCESSOR, wall: float = WALL) -> Iterator[None]:
    """Raise TooLong in the code inside once it has taken so many seconds, wherever Python itself is executed there.

    What waits, such as a sleep, is ended in the main thread only, and where the system has signals.
    """
    watch = _Watch(processor, wall)
    thread = threading.Thread(target=watch.look, daemon=True)
    thread.start()
    try:
        try:
            yield
        finally:
            watch.end()
    finally:
        # Again, where TooLong was raised in the first one.
        watch.end()
        thread.join()


class _Watch:
    """Looks at what this thread uses from now on until it ends or has used too much."""

    def __init__(self, processor: float, wall: float):
        self._thread, self._processor, self._wall = threading.get_ident(), processor, wall
        self._ended, self._fired = threading.Event(), False
        main = threading.current_thread() is threading.main_thread()
        self._by_signal = main and hasattr(signal, "pthread_kill")
        self._before = signal.signal(signal.SIGALRM, self._interrupted) if self._by_signal else None
        self._began = time.monotonic(), self._used()

    def look(self) -> None:
        pause = _LOOK
        while not self._ended.wait(pause):
            waited, used = time.monotonic() - self._began[0], self._used() - self._began[1]
            if waited >= self._wall or used >= self._processor:
                self._fired, pause = True, _AGAIN
                if self._by_signal:
                    signal.pthread_kill(self._thread, signal.SIGALRM)
                else:
                    _raise_in(self._thread, TooLong)

    def end(self) -> None:
        self._ended.set()
        if self._by_signal:
            signal.signal(signal.SIGALRM, signal.SIG_DFL if self._before is None else self._before)
        else:
            # What was raised as the code ended, and has not arrived.
            _raise_in(self._thread, None)

    def _used(self) -> float:
        """Processor time of the thread; on systems that do not tell it, the time on the clock."""
        clock = getattr(time, "pthread_getcpuclockid", None)
        return time.monotonic() if clock is None else time.clock_gettime(clock(self._thread))

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        if self._fired and not self._ended.is_set():
            raise TooLong
        if callable(self._before):
            self._before(number, frame)


def _raise_in(thread: int, error: type[BaseException] | None) -> None:
    pointer = ctypes.py_object() if error is None else ctypes.py_object(error)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), pointer)
