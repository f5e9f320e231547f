"""Pressures for random motions of runs: how many are found, how far they are off, and how many equilibria that takes.

    python benchmarks/reaching.py RUN [RUN ...] [--motions 100] [--seed 0] [--size "5 mm"]

Of every run the last design is taken, on a mesh of its own where a size is given. Pressures are drawn uniformly between
the bounds; the motion that they give is then asked for, without them. As many components of it are asked for as there
are chambers, at most five: those that the pressures change most.
"""

from __future__ import annotations

import argparse
import time
from statistics import median

import numpy as np

import pneumorph as pm
from pneumorph.analysis import Explorer
from pneumorph.analysis.reaching import PER_RADIAN, Reaching
from pneumorph.interface.reach import bounds_of
from pneumorph.problem.components import MOTIONS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--motions", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size")
    asked = parser.parse_args()
    print(
        "| run | degrees of freedom | reached | median off (mm) | most off (mm) | equilibria, median | most | s each |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for run in asked.runs:
        print(row(run, asked.motions, asked.seed, asked.size), flush=True)


def row(path: str, count: int, seed: int, size: str | None) -> str:
    """A row of the table."""
    run = pm.open_run(path, trust=True)
    design = run.best
    problem = design.problem if size is None else design.problem.with_changes({"mesh.size": size})
    bounds = bounds_of(problem, {})
    lower, upper = np.array(list(bounds.values())).T
    truth, search = Explorer(problem, design.body), Reaching(Explorer(problem, design.body), bounds)
    rng, found, dofs = np.random.default_rng(seed), [], 0
    began = time.perf_counter()
    while len(found) < count:
        pressures = dict(zip(bounds, rng.uniform(lower, upper), strict=True))
        at, answer, _ = truth.solved(pressures, pressures)
        if not getattr(answer, "stable", False):
            continue
        step = truth.at(pressures).step
        motion = np.array([*step.translation, *step.rotation])
        first = search.reach({"extension": motion[2]}) if not found else None
        if first is not None:
            sizes = np.linalg.norm(first.by_pressure, axis=1) * np.where(np.arange(6) < 3, 1.0, PER_RADIAN)
            chosen = np.sort(np.argsort(-sizes)[: min(5, len(bounds))])
            dofs = at.model.size
        found.append(search.reach({MOTIONS[k]: float(motion[k]) for k in chosen}))
    off, solves = [each.distance for each in found], [each.solves for each in found]
    seconds = (time.perf_counter() - began) / sum(solves)
    reached = sum(each.reached for each in found)
    cells = run.path.name, dofs, f"{reached} of {count}", f"{median(off):.3f}", f"{max(off):.3f}"
    return f"| {' | '.join(map(str, cells))} | {median(solves):g} | {max(solves)} | {seconds:.2f} |"


if __name__ == "__main__":
    main()
