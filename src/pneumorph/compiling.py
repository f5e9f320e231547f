"""Say that kernels are compiled, once in a process: where nothing is kept from before, that takes most of the time.

Nothing here has an effect unless `announce` is called before the first kernel is loaded, as the command does: a Python
program and the workers of a study say nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

_say: Callable[[], object] | None = None
_lock = threading.Lock()


def announce(say: Callable[[], object] | None) -> None:
    """Have `say` called when something is compiled for the first time; None takes that back."""
    global _say
    _say = say


def watch() -> None:
    """Listen to jax and Numba, if anything is to be said; called when they are loaded."""
    if _say is None:
        return
    import jax
    from numba.core import event

    class Compiled(event.Listener):
        """Numba compiles what is in none of its caches."""

        def on_start(self, event: Any) -> None:
            _tell()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Compiled())
    jax.monitoring.register_event_listener(_heard)


def _heard(event: str, **_: Any) -> None:
    """jax has compiled what its cache does not have."""
    if event == "/jax/compilation_cache/cache_misses":
        _tell()


def _tell() -> None:
    global _say
    # Several threads may compile at once.
    with _lock:
        say, _say = _say, None
    if say is not None:
        say()
