"""What is computed at the moment, in words, and a line about it wherever nothing has been printed for five seconds.

Code says what it does by ``with doing("meshing"):``, and whatever takes long comes by `beat` several times a second, by
way of `interrupts.stop_if_asked`. So the lines are printed by the thread that computes, and need none of their own.

Nothing here has an effect unless `announce` is called, as the command does. Nothing but the standard library is
imported, as by `interrupts`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY = 5.0
"""Seconds without a line after which one is printed."""

_say: Callable[[str], object] | None = None
_now: list[tuple[str, float]] = []
_latest = 0.0


def announce(say: Callable[[str], object] | None) -> None:
    """Have `say` called with what is done, at least every `EVERY` seconds; None takes that back."""
    global _say
    _say = say
    said()


def said() -> None:
    """Note that something has been printed: the seconds without a line count from now."""
    global _latest
    _latest = time.monotonic()


@contextmanager
def doing(words: str) -> Iterator[None]:
    """Say what is done inside, e.g. "meshing"; blocks may be nested. Only the main thread is listened to."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    one = (words, time.monotonic())
    _now.append(one)
    try:
        yield
    finally:
        # A generator that is left behind may end after others have begun.
        _now.remove(one)


def words() -> str:
    """What is done now, from the whole to its part; empty if nothing has been said."""
    return ", ".join(dict.fromkeys(each for each, _ in _now))


def beat() -> None:
    """Print what is done, if nothing has been printed for a while; cheap."""
    if _say is None or time.monotonic() - _latest < EVERY or threading.current_thread() is not threading.main_thread():
        return
    said()
    if _now:
        _say(f"{words()} ({time.monotonic() - _now[-1][1]:.0f} s)")
    else:
        _say("still working")
