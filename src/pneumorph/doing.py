"""What is computed at the moment, in words, and a line about it wherever nothing has been printed for five seconds.

Code says what it does, and how far it has come where it knows that::

    with doing("certifying walls") as far:
        far("1200 of 5000 pairs")

A thread of its own prints the lines, so they come whatever runs: compiled code, other programs, libraries. It has to be
compiled code that lets other threads go on (`nogil`).

That the program is being loaded, or kernels are compiled, is seen from what the main thread is in: these things happen
wherever something is used for the first time, and would have to be said everywhere.

Nothing here has an effect unless `announce` is called, as the command does. Nothing but the standard library is
imported, as by `interrupts`.
"""

from __future__ import annotations

import atexit
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY = 5.0
"""Seconds without a line after which one is printed."""

FIRST_USE = {
    "importlib._bootstrap": "loading the program",
    "_frozen_importlib": "loading the program",
    "numba.core.caching": "loading kernels",
    "numba.core.compiler": "compiling kernels",
    "jax._src.compilation_cache": "loading kernels",
    "jax._src.compiler": "compiling kernels",
    "jax._src.interpreters.mlir": "preparing kernels",
    "jax._src.interpreters.partial_eval": "preparing kernels",
}
"""What is done in modules of Python and of libraries, where something is used for the first time."""

Say = Callable[[str], object]


class _Part:
    """Something that is done: words, how far it has come, and when it began."""

    def __init__(self, words: str):
        self.words, self.far, self.began = words, "", time.monotonic()
        self._counts: dict[str, int] = {}

    def count(self, what: str) -> None:
        self._counts[what] = self._counts.get(what, 0) + 1

    def __str__(self) -> str:
        counts = [f"{number} {each}{'s' * (number > 1)}" for each, number in list(self._counts.items())]
        far = ", ".join([self.far, *counts] if self.far else counts)
        return f"{self.words}: {far}" if far else self.words


_say: Say | None = None
_saying = threading.Lock()
_now: list[_Part] = []
_latest = 0.0


def announce(say: Say | None) -> None:
    """Have `say` called with what is done, every `EVERY` seconds, by another thread; None takes that back."""
    global _say
    # A line that is being printed comes first.
    with _saying:
        _say = say
    said()
    if say is not None:
        threading.Thread(target=_tell, args=(say,), daemon=True).start()


def said() -> None:
    """Note that something has been printed: the seconds without a line count from now."""
    global _latest
    _latest = time.monotonic()


@contextmanager
def doing(words: str) -> Iterator[Callable[[str], None]]:
    """Say what is done inside, e.g. "meshing"; blocks may be nested. Only the main thread is listened to.

    What it gives is called with how far that is, e.g. "3 of 8 designs".
    """
    part = _Part(words)

    def far(so_far: str) -> None:
        part.far = so_far

    if threading.current_thread() is not threading.main_thread():
        yield far
        return
    _now.append(part)
    try:
        yield far
    finally:
        # A generator that is left behind may end after others have begun.
        _now.remove(part)


@contextmanager
def silent() -> Iterator[None]:
    """Print no line inside, as while somebody is asked something."""
    parts = list(_now)
    _now.clear()
    try:
        yield
    finally:
        _now[:] = parts
        said()


def counted(what: str) -> None:
    """Count what takes a while, e.g. "factorisation": the innermost block says how many there have been."""
    if _now and threading.current_thread() is threading.main_thread():
        _now[-1].count(what)


def words() -> str:
    """What is done now, from the whole to its part; empty if nothing has been said."""
    parts = [str(part) for part in list(_now)]
    return ", ".join(dict.fromkeys([*parts, *_first_use()] if parts else parts))


def _first_use() -> Iterator[str]:
    """What of `FIRST_USE` the main thread is in, the innermost."""
    frame = sys._current_frames().get(threading.main_thread().ident or 0)
    while frame is not None:
        if (found := FIRST_USE.get(frame.f_globals.get("__name__", ""))) is not None:
            yield found
            return
        frame = frame.f_back


def due(now: float) -> float:
    """Seconds from a time of `time.monotonic` to when the next line is due, at most `EVERY`."""
    return min(max(_latest + EVERY - now, 0.0), EVERY)


def line(now: float) -> str | None:
    """The line for a time of `time.monotonic`; None where nothing is done, as while somebody is asked something."""
    parts = list(_now)
    return f"{words()} ({max(now - parts[-1].began, 0.0):.0f} s)" if parts else None


def _tell(say: Say) -> None:
    """Print lines as they are due, for as long as they are asked for."""
    while _say is say:
        now = time.monotonic()
        if (rest := due(now)) > 0.0:
            time.sleep(rest)
            continue
        with _saying:
            text = line(now) if _say is say else None
            if text is not None:
                say(text)
        said()


# No line is cut off where the program ends.
atexit.register(announce, None)
