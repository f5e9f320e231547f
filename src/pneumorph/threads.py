"""The threads of the process, for kernels that release the Python lock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

import numba

from pneumorph.interrupts import stop_if_asked

Part = TypeVar("Part")
Result = TypeVar("Result")


def each(work: Callable[[Part], Result], parts: Sequence[Part]) -> list[Result]:
    """Apply `work` to every part, on as many threads as Numba may have; whichever is free takes the next.

    Kernels that run in parts compile in a quarter of the time of Numba's own parallel loops.
    """

    def done(part: Part) -> Result:
        stop_if_asked()
        return work(part)

    if len(parts) == 1 or numba.get_num_threads() == 1:
        return [done(part) for part in parts]
    return list(_workers().map(done, parts))


@cache
def _workers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(numba.get_num_threads())
