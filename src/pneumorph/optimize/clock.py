"""The time that a design takes, by phase."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from pneumorph.doing import doing

PHASES = {
    "geometry": "meshing",
    "equilibrium": "finding equilibria",
    "gradient": "finding the gradient",
    "subproblem": "finding a step within the limits",
}
"""With what is done in each, in words."""


class Clock:
    """Seconds since its creation, in total and by named phase."""

    def __init__(self):
        self._began = time.perf_counter()
        self._spent: dict[str, float] = dict.fromkeys(PHASES, 0.0)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Count the time inside as part of a phase."""
        began = time.perf_counter()
        try:
            with doing(PHASES[name]):
                yield
        finally:
            self._spent[name] += time.perf_counter() - began

    def seconds(self) -> dict[str, float]:
        """Seconds by phase, and in total."""
        return {**self._spent, "total": time.perf_counter() - self._began}
