"""Whether objectives after two designs, or what they promise, say which candidates are best after six.

    python benchmarks/promise.py SEARCH...

A SEARCH is a folder of runs, such as that of `propose`. Compared are its runs on the coarse mesh with six designs, and
those that ended by themselves before. Of these the best third is kept, two at least, by either measure; what is lost is
the share of the best objective by which the best that is kept falls behind it. In a search the runs that were left
after two designs have no six, so that what went on by another measure is missing there.
"""

from __future__ import annotations

import argparse
import math
import statistics
from pathlib import Path

from pneumorph.optimize.stopping import TIME_IS_UP
from pneumorph.proposals.search import BEST, KEPT
from pneumorph.proposals.stage import promised
from pneumorph.run import open_run

EARLY, LATE = 2, 6
"""Designs after which candidates are compared, and after which they are judged."""


def objectives(directory: Path) -> list[float] | None:
    """Those of the first designs of a run, the last one again where it ended by itself; None if it was cut short."""
    run = open_run(directory)
    found, result = [each.objective for each in run.history()][: LATE + 1], run.result()
    if len(found) > LATE:
        return found
    by_itself = result is not None and not result.reason.startswith(TIME_IS_UP)
    if not found or not by_itself or len(found) > run.problem.optimizer.iterations:
        return None
    return found + [found[-1]] * (LATE + 1 - len(found))


def lost(runs: list[list[float]], more: int) -> float:
    """What is lost if runs are kept by the objectives that they promise after so many more designs."""
    kept = sorted(runs, key=lambda each: promised(each[: EARLY + 1], more))
    kept = kept[: max(BEST, math.ceil(KEPT * len(runs)))]
    best, found = (min(each[LATE] for each in some) for some in (runs, kept))
    return (found - best) / abs(best) if best else 0.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("search", type=Path, nargs="+")
    rows = []
    print("| search | runs | lost by the objective | lost by what it promises |", "|---|---|---|---|", sep="\n")
    for folder in parser.parse_args().search:
        names = [
            each.parent for each in sorted(folder.glob("*/problem.toml")) if not each.parent.name.endswith("-fine")
        ]
        runs = [own for own in map(objectives, names) if own is not None]
        if len(runs) > BEST:
            rows.append((lost(runs, 0), lost(runs, LATE - EARLY)))
            told = " | ".join(f"{100 * each:.0f} %" for each in rows[-1])
            print(f"| {'/'.join(folder.parts[-2:])} | {len(runs)} | {told} |", flush=True)
    if rows:
        means = " | ".join(f"{100 * statistics.mean(own):.1f} %" for own in zip(*rows, strict=True))
        print(f"| mean of {len(rows)} | | {means} |")


if __name__ == "__main__":
    main()
