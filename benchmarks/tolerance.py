"""The first-order scatter of designs beside that of sampled castings, each solved: python benchmarks/tolerance.py RUN …

    python benchmarks/tolerance.py RUN [RUN …] [--samples 200] [--size "3 mm"]

Causes are drawn from normal distributions with the usual tolerances. Nodes move along the sum of all motions, and
rubber that is stiffer by a factor s is that under all loads divided by s, so bodies of several rubbers are left out.
A casting without an equilibrium is counted; the deviation is that of the others.
"""

import argparse
from dataclasses import replace

import numpy as np

import pneumorph as pm
from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.scatter import UNITS, Tolerances, scatter_of, shape_causes
from pneumorph.mechanics import Equilibrium, predict, solve
from pneumorph.objective import measure_features
from pneumorph.problem.components import MOTIONS


def sampled(whole: Solved, task: str, samples: int, seed: int) -> tuple[np.ndarray, int]:
    """Motions (n, 6) of castings of a body in a task, and the number of those without an equilibrium."""
    at, state = whole.analysis.configurations[task], whole.analysis.equilibria[task].state
    disc, tolerances, random = whole.disc, Tolerances(), np.random.default_rng(seed)
    tangent = disc.tangents[task]
    along = []
    for each in shape_causes(disc.morph, at.X, tolerances):
        everywhere = each.motion if len(each.motion) == len(at.X) else disc.morph.extend(each.motion)
        along.append(each.tolerance * everywhere)
    motions, missing = [], 0
    for _ in range(samples):
        X = at.X + np.tensordot(random.standard_normal(len(along)), along, axes=1)
        softer = 1.0 / (1.0 + tolerances.rubber * random.standard_normal())
        pressure = at.loads.pressure + tolerances.pressure * random.standard_normal(len(disc.model.chambers))
        scaled = {
            name: softer * (1.0 + tolerances.load * random.standard_normal()) * getattr(at.loads, name)
            for name in ("acceleration", "spring", "wrench")
        }
        loads = at.loads._replace(pressure=softer * pressure, **scaled)
        casting = replace(at, X=X, loads=loads)
        tangent.move_to(at, state)
        answer = solve(casting, tangent, predict(at, tangent, state, X - at.X, loads), since=(at, state), most=60)
        if not isinstance(answer, Equilibrium):
            missing += 1
            continue
        moved = measure_features(disc.model, X, answer.state)
        motions.append(np.concatenate([moved.translation, moved.rotation]))
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
            motions, missing = sampled(whole, task, asked.samples, asked.seed)
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
