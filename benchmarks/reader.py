"""How long the reader of fast models takes for a pose, a Jacobian, and the pressures for a place; processor time.

python benchmarks/reader.py MODEL.npz [...] [--places 200]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from statistics import median

import numpy as np

from pneumorph.surrogate.reader import Model

CALLS, ROUNDS = 2000, 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--places", type=int, default=200)
    asked = parser.parse_args()
    print("| model | inputs | polynomials | pose (µs) | Jacobian (µs) | places found | pressures (ms) | most (ms) |")
    print("|---" * 8 + "|")
    for path in asked.models:
        print(row(path, asked.places), flush=True)


def row(path: str, count: int) -> str:
    """A row of the table."""
    model, rng = Model(path), np.random.default_rng(0)
    middle = model.bounds.mean(axis=1)
    pose, slope = (each(lambda call=call: call(middle)) for call in (model.pose, model.jacobian))
    seconds, found = [], 0
    names = ("shift_x", "shift_y", "extension")
    while len(seconds) < count:
        drawn = rng.uniform(*model.bounds.T)
        drawn[len(model.chambers) :] = list(model.usual.values())
        if not model.inside(drawn):
            continue
        wanted = dict(zip(names, model.pose(drawn).translation.tolist(), strict=True))
        began = time.process_time()
        answer = model.pressures_for(wanted)
        seconds.append(time.process_time() - began)
        found += answer.reached
    cells = path, len(model.bounds), len(model.index), f"{1e6 * pose:.0f}", f"{1e6 * slope:.0f}", f"{found} of {count}"
    return f"| {' | '.join(map(str, (*cells, f'{1e3 * median(seconds):.2f}', f'{1e3 * max(seconds):.2f}')))} |"


def each(call: Callable[[], object]) -> float:
    """Seconds of a call: the median of several rounds of many."""
    rounds = []
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(CALLS):
            call()
        rounds.append((time.process_time() - began) / CALLS)
    return median(rounds)


if __name__ == "__main__":
    main()
