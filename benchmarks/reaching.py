"""Pressures for random poses of runs: how many are found, how far they are off, and how many equilibria that takes.

    python benchmarks/reaching.py RUN_OR_PROBLEM [...] [--poses 100] [--far 20] [--seed 0] [--size "5 mm"]

Of every run the last design is taken, of every problem file the start, on a mesh of a size of its own where one is
given. Pressures are drawn uniformly between the bounds; the pose that they give is then asked for without them, all six
components of it. Then poses are asked for that are three times as far from the pose without pressure, most of which are
out of reach: the nearest is proved if to first order no other pressures are nearer, and none of the other starts and
none of the poses that are known from before is.
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
from pneumorph.interface.reach import NO_NEARER, bounds_of
from pneumorph.problem.components import MOTIONS
from pneumorph.sensitivity import motion_slopes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--poses", type=int, default=100)
    parser.add_argument("--far", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size")
    asked = parser.parse_args()
    print(
        "| run | chambers | degrees of freedom | found | median off (mm) | most off (mm) | equilibria, median | most "
        "| out of reach | proved | equilibria, median | s each |"
    )
    print("|---" * 12 + "|")
    for run in asked.runs:
        print(row(run, asked.poses, asked.far, asked.seed, asked.size), flush=True)


def row(path: str, count: int, far: int, seed: int, size: str | None) -> str:
    """A row of the table."""
    source = Path(path)
    design = pm.open_run(source, trust=True).best if source.is_dir() else pm.starting_design(pm.load(source))
    problem = design.problem if size is None else design.problem.with_changes({"mesh.size": size})
    bounds = bounds_of(problem, {})
    lower, upper = np.array(list(bounds.values())).T
    truth, search = Explorer(problem, design.body), Reaching(Explorer(problem, design.body), bounds)
    unlike = dict(zip(bounds, lower + (upper - lower) * np.linspace(0.3, 0.7, len(bounds)), strict=True))
    rng, poses, dofs = np.random.default_rng(seed), [], 0

    def pose(parts: np.ndarray) -> np.ndarray | None:
        nonlocal dofs
        at, answer, tangent = truth.solved(dict(zip(bounds, lower + (upper - lower) * parts, strict=True)), unlike)
        dofs = at.model.size
        return motion_slopes(at, tangent, answer.state).motion if getattr(answer, "stable", False) else None

    began = time.process_time()
    rest = pose(-lower / (upper - lower))
    assert rest is not None
    while len(poses) < count:
        if (drawn := pose(rng.random(len(bounds)))) is not None:
            poses.append(drawn)
    found = [search.reach(dict(zip(MOTIONS, each.tolist(), strict=True))) for each in poses]
    beyond = [rest + 3.0 * (each - rest) for each in poses[:far]]
    nearest = [search.reach(dict(zip(MOTIONS, each.tolist(), strict=True))) for each in beyond]
    missed = [(wanted, each) for wanted, each in zip(beyond, nearest, strict=True) if not each.reached]
    weight = np.where(np.arange(6) < 3, 1.0, PER_RADIAN)
    proved = [
        each.nearer <= NO_NEARER * each.distance
        and each.distance < min(float(np.linalg.norm(weight * (known - wanted))) for known in poses) + 1e-3
        for wanted, each in missed
    ]
    off, solves = [each.distance for each in found], [each.solves for each in found]
    more = [each.solves for _, each in missed]
    seconds = (time.process_time() - began) / (len(poses) + sum(solves) + sum(each.solves for each in nearest))
    within = sum(each.distance <= 0.1 for each in found)
    cells = source.stem, len(bounds), dofs, f"{within} of {count}", f"{median(off):.3f}", f"{max(off):.3f}"
    apart = f"{len(missed)} of {far}", f"{sum(proved)} of {len(missed)}", f"{median(more or [0]):g}", f"{seconds:.2f}"
    return f"| {' | '.join(map(str, (*cells, f'{median(solves):g}', max(solves), *apart)))} |"


if __name__ == "__main__":
    main()
