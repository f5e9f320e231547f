"""Yields of designs, by sampled castings that are solved.

    python benchmarks/robust.py RUN [RUN …] --task NAME --within "5 deg" [--samples 100]

Causes are drawn from normal distributions with the tolerances of [robust] of the last run. Castings are solved on the
mesh of the last design: where that is a part of the body, with the causes that keep its symmetry. A casting without an
equilibrium is a bad one.
"""

import argparse
from pathlib import Path

import numpy as np
from tolerance import drawn, sampled

from pneumorph.analysis import checkpoint
from pneumorph.analysis.near import Solved
from pneumorph.analysis.scatter import scatter_of
from pneumorph.analysis.tolerances import UNITS
from pneumorph.optimize.castings import tolerances_of
from pneumorph.optimize.setup import build_setup
from pneumorph.problem.components import MOTIONS
from pneumorph.run import RunDirectory, open_run
from pneumorph.units import ANGLE, LENGTH, parse


def last(run: RunDirectory) -> Solved:
    """The last design of a run, on its mesh."""
    setup, state = build_setup(run.problem), run.resumable()
    assert state is not None, f"{run.path} has no design"
    return Solved(run.problem, *checkpoint.unpack(run.problem, setup.space, dict(state), setup.mesher.heights))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--task", required=True, help="one with a motion as its target")
    parser.add_argument("--within", required=True, help="how far a casting may be off the target")
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    runs = {path: open_run(path) for path in asked.runs}
    robust = runs[asked.runs[-1]].problem.robust
    assert robust is not None, "the last run is not robust"
    tolerances = tolerances_of(robust)
    print("| run | as designed | target | first order ± | samples | without equilibrium | within | yield |")
    print("|---|---|---|---|---|---|---|---|")
    for path, run in runs.items():
        task = next(each for each in run.problem.task if each.name == asked.task)
        ((motion, target),) = task.objective.targets.items()
        number = MOTIONS.index(motion)
        unit, size, kind = ("mm", 1.0, LENGTH) if number < 3 else ("°", 1.0 / UNITS["°"], ANGLE)
        design = last(run)
        scatter = scatter_of(design, tolerances)[asked.task]
        answers = sampled(design, asked.task, drawn(design, tolerances, asked.samples, asked.seed))
        motions = np.array([each for each in answers if each is not None])
        missing = len(answers) - len(motions)
        found, within = motions[:, number], parse(asked.within, kind)
        good = int(np.sum(np.abs(found - target) <= within))
        print(
            f"| {path} | {size * scatter.motion[number]:.2f} {unit} | {size * target:.2f} {unit} "
            f"| {size * scatter.deviations[number]:.2f} | {size * found.mean():.2f} ± {size * found.std(ddof=1):.2f} "
            f"| {missing} of {asked.samples} | {size * within:g} {unit} | {100 * good / asked.samples:.0f} % |",
            flush=True,
        )


if __name__ == "__main__":
    main()
