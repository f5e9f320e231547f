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
    results: dict[int, Result] = {}
    # Whoever asks for the next one holds the Python lock, so no two threads get the same.
    left = iter(range(len(parts)))

    def some() -> None:
        for number in left:
            stop_if_asked()
            results[number] = work(parts[number])

    helpers = [_workers().submit(some) for _ in range(min(numba.get_num_threads(), len(parts)) - 1)]
    try:
        some()
    finally:
        # Those that have not begun are not needed: waiting for them could wait for ever where parts have parts.
        for helper in helpers:
            if not helper.cancel():
                helper.result()
    return [results[number] for number in range(len(parts))]


@cache
def _workers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(numba.get_num_threads() - 1, 1))
