"""Pressures for random motions of runs: how many are found, how far they are off, and how many equilibria that takes.

    python benchmarks/reaching.py RUN_OR_PROBLEM [...] [--motions 100] [--seed 0] [--size "5 mm"]

Of every run the last design is taken, of every problem file the start, on a mesh of a size of its own where one is
given. Pressures are drawn uniformly between the bounds; the motion that they give is then asked for, without them. As
many components of it are asked for as there are chambers, at most five: those that the pressures change most.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from statistics import median

import numpy as np

import pneumorph as pm
from pneumorph.analysis import Explorer
from pneumorph.analysis.reaching import PER_RADIAN, Reaching
from pneumorph.interface.reach import bounds_of
from pneumorph.problem.components import MOTIONS
from pneumorph.sensitivity import motion_slopes


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
    source = Path(path)
    design = pm.open_run(source, trust=True).best if source.is_dir() else pm.starting_design(pm.load(source))
    problem = design.problem if size is None else design.problem.with_changes({"mesh.size": size})
    bounds = bounds_of(problem, {})
    lower, upper = np.array(list(bounds.values())).T
    truth, search = Explorer(problem, design.body), Reaching(Explorer(problem, design.body), bounds)
    unlike = dict(zip(bounds, lower + (upper - lower) * np.linspace(0.3, 0.7, len(bounds)), strict=True))
    rng, found, dofs = np.random.default_rng(seed), [], 0
    began = time.perf_counter()
    while len(found) < count:
        pressures = dict(zip(bounds, rng.uniform(lower, upper), strict=True))
        at, answer, tangent = truth.solved(pressures, unlike)
        if not getattr(answer, "stable", False):
            continue
        motion = motion_slopes(at, tangent, answer.state).motion
        first = search.reach({"extension": motion[2]}) if not found else None
        if first is not None:
            sizes = np.linalg.norm(first.by_pressure, axis=1) * np.where(np.arange(6) < 3, 1.0, PER_RADIAN)
            chosen = np.sort(np.argsort(-sizes)[: min(5, len(bounds))])
            dofs = at.model.size
        found.append(search.reach({MOTIONS[k]: float(motion[k]) for k in chosen}))
    off, solves = [each.distance for each in found], [each.solves for each in found]
    seconds = (time.perf_counter() - began) / sum(solves)
    reached = sum(each.reached for each in found)
    cells = source.stem, dofs, f"{reached} of {count}", f"{median(off):.3f}", f"{max(off):.3f}"
    return f"| {' | '.join(map(str, cells))} | {median(solves):g} | {max(solves)} | {seconds:.2f} |"


if __name__ == "__main__":
    main()
