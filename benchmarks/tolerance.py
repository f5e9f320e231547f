"""The first-order scatter of designs beside that of sampled castings, each solved: python benchmarks/tolerance.py RUN …

    python benchmarks/tolerance.py RUN [RUN …] [--samples 200] [--size "3 mm"]

Causes are drawn from normal distributions with the usual tolerances. Nodes move along the sum of all motions, and
rubber that is stiffer by a factor s is that under all loads divided by s, so bodies of several rubbers are left out.
A casting without an equilibrium is counted; the deviation is that of the others.
"""

import argparse
import sys

import numpy as np

import pneumorph as pm
from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.scatter import scatter_of
from pneumorph.analysis.tolerances import LOADS, MODULUS, UNITS, Tolerances, as_cast, pressure_of, shape_causes
from pneumorph.mechanics import Equilibrium, Tangent, predict, solve
from pneumorph.objective import measure_features
from pneumorph.problem.components import MOTIONS

ENOUGH, MOST = 1e-5, 25
"""Relative residual of the states, and most factorisations for one: what is not found with them is no state."""

EVERY = 10
"""Castings after which it is told how far they have come."""


def sampled(whole: Solved, task: str, tolerances: Tolerances, samples: int, seed: int) -> tuple[np.ndarray, int]:
    """Motions (n, 6) of castings of a body in a task, and the number of those without an equilibrium."""
    at, state = whole.analysis.configurations[task], whole.analysis.equilibria[task].state
    disc, random = whole.disc, np.random.default_rng(seed)
    # One stays factorised where castings are predicted from, and serves for those that are near.
    tangent, search = disc.tangents[task], Tangent(disc.model)
    tangent.move_to(at, state)
    along = [each.tolerance * each.everywhere(disc.morph) for each in shape_causes(disc.morph, at.X, tolerances)]
    others = {MODULUS: tolerances.rubber, **dict.fromkeys(LOADS.values(), tolerances.load)}
    others |= {pressure_of(chamber): tolerances.pressure for chamber in disc.model.chambers}
    motions, missing = [], 0
    for number in range(samples):
        if number > 1 and number % EVERY == 0:
            so_far = np.std(motions, axis=0, ddof=1) if len(motions) > 1 else "not known"
            print(
                f"{task}: {number} of {samples}, {missing} without equilibrium, ± {so_far}", file=sys.stderr, flush=True
            )
        moved = np.tensordot(random.standard_normal(len(along)), along, axes=1)
        changes = {name: tolerance * random.standard_normal() for name, tolerance in others.items()}
        casting = as_cast(at, moved, changes)
        start = predict(at, tangent, state, moved, casting.loads)
        search.borrow(tangent, casting)
        answer = solve(casting, search, start, ENOUGH, since=(at, state), most=MOST)
        if not isinstance(answer, Equilibrium):
            missing += 1
            continue
        tip = measure_features(disc.model, casting.X, answer.state)
        motions.append(np.concatenate([tip.translation, tip.rotation]))
    return np.array(motions), missing


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", help="of the mesh, by default that of the run")
    asked = parser.parse_args()
    print("| run, task | motion | value | first order ± | sampled ± | ratio | mean of samples | without equilibrium |")
    print("|---|---|---|---|---|---|---|---|")
    for run in asked.runs:
        design = pm.open_run(run).best
        problem = design.problem.with_changes({"mesh.size": asked.size}) if asked.size else design.problem
        whole = analyse_near(problem, design.body, (), design.stored, design.entry.tasks)
        for task, scatter in scatter_of(whole, Tolerances()).items():
            motions, missing = sampled(whole, task, Tolerances(), asked.samples, asked.seed)
            largest = scatter.deviations * ([1.0] * 3 + [10.0] * 3)
            for k in np.flatnonzero(largest > 0.1 * largest.max()):
                unit, size = ("mm", 1.0) if k < 3 else ("°", 1.0 / UNITS["°"])
                first, drawn = size * scatter.deviations[k], size * motions[:, k].std(ddof=1)
                value = f"{size * scatter.motion[k]:.2f} {unit}"
                print(
                    f"| {run}, {task} | {MOTIONS[k]} | {value} | {first:.2f} | {drawn:.2f} "
                    f"| {first / drawn:.2f} | {size * motions[:, k].mean():.2f} | {missing} of {asked.samples} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
