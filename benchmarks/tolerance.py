"""The first-order scatter of designs beside that of sampled castings, each solved: python benchmarks/tolerance.py RUN …

    python benchmarks/tolerance.py RUN [RUN …] [--samples 200] [--size "3 mm"]

Causes are drawn from normal distributions with the usual tolerances. Nodes move along the sum of all motions, and
rubber that is stiffer by a factor s is that under all loads divided by s, so bodies of several rubbers are left out.
A casting without an equilibrium is counted; the deviation is that of the others. Beside it is that of the same castings
by first derivatives, so that few castings tell how they compare.
"""

import argparse
import sys

import numpy as np

import pneumorph as pm
from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.scatter import one_deviation, scatter_of
from pneumorph.analysis.second_order import curvatures
from pneumorph.analysis.tolerances import LOADS, MODULUS, UNITS, Tolerances, as_cast, pressure_of, shape_causes
from pneumorph.mechanics import Equilibrium, Tangent, predict, solve
from pneumorph.objective import measure_features
from pneumorph.problem.components import MOTIONS
from pneumorph.results import Scatter

ENOUGH, MOST = 1e-5, 80
"""Relative residual of the states, and most factorisations for one: what is not found with them is no state."""

EVERY = 10
"""Castings after which it is told how far they have come."""


Casting = dict[str, float]
"""Changes of all causes by their names, in the units of the code."""


def drawn(whole: Solved, tolerances: Tolerances, samples: int, seed: int) -> list[Casting]:
    """Castings of a body, at random."""
    random, disc = np.random.default_rng(seed), whole.disc
    deviations = {each.name: each.tolerance for each in shape_causes(disc.morph, whole.analysis.X, tolerances)}
    deviations |= {MODULUS: tolerances.rubber, **dict.fromkeys(LOADS.values(), tolerances.load)}
    deviations |= {pressure_of(chamber): tolerances.pressure for chamber in disc.model.chambers}
    return [{name: each * random.standard_normal() for name, each in deviations.items()} for _ in range(samples)]


def sampled(whole: Solved, task: str, castings: list[Casting]) -> list[np.ndarray | None]:
    """Motions (6,) of castings of a body in a task; None where there is no equilibrium."""
    at, state = whole.analysis.configurations[task], whole.analysis.equilibria[task].state
    disc = whole.disc
    # One stays factorised where castings are predicted from, and serves for those that are near.
    tangent, search = disc.tangents[task], Tangent(disc.model)
    tangent.move_to(at, state)
    shapes = {each.name: each.everywhere(disc.morph) for each in shape_causes(disc.morph, at.X, Tolerances())}
    motions: list[np.ndarray | None] = []
    for number, changes in enumerate(castings):
        found = [each for each in motions if each is not None]
        if number > 1 and number % EVERY == 0:
            so_far = np.std(found, axis=0, ddof=1) if len(found) > 1 else "not known"
            missing = number - len(found)
            told = f"{task}: {number} of {len(castings)}, {missing} without equilibrium, ± {so_far}"
            print(told, file=sys.stderr, flush=True)
        moved = sum((changes[name] * motion for name, motion in shapes.items()), np.zeros_like(at.X))
        casting = as_cast(at, moved, changes)
        start = predict(at, tangent, state, moved, casting.loads)
        search.borrow(tangent, casting)
        answer = solve(casting, search, start, ENOUGH, since=(at, state), most=MOST)
        if not isinstance(answer, Equilibrium):
            motions.append(None)
            continue
        tip = measure_features(disc.model, casting.X, answer.state)
        motions.append(np.concatenate([tip.translation, tip.rotation]))
    return motions


def of_first_order(scatter: Scatter, castings: list[Casting]) -> np.ndarray:
    """The motions (n, 6) of castings by first derivatives."""
    by = {cause.name: np.array(cause.by[: len(MOTIONS)]) / UNITS[cause.unit] for cause in scatter.causes}
    return np.array([sum((change * by[name] for name, change in each.items() if name in by), 0.0) for each in castings])


def to_second_order(
    whole: Solved, task: str, scatter: Scatter, motion: int, castings: list[Casting]
) -> tuple[float, np.ndarray] | None:
    """The deviation of a motion to second order, and by how much (n,) castings differ; None where one has no state."""
    own = one_deviation(whole, task, scatter, motion)
    curved = None if own is None else curvatures(whole, task, scatter, motion, own)
    if curved is None:
        return None
    causes = [(each.name, UNITS[each.unit] * each.tolerance) for each in scatter.causes]
    parts = np.array([[casting.get(name, 0.0) / tolerance for name, tolerance in causes] for casting in castings])
    more = sum(b * np.square(parts @ direction) for direction, b in curved)
    deviation = np.sqrt(scatter.deviations[motion] ** 2 + sum(2.0 * b**2 for _, b in curved))
    return deviation, of_first_order(scatter, castings)[:, motion] + more


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", help="of the mesh, by default that of the run")
    asked = parser.parse_args()
    print(
        "| run, task | motion | value | first order ± | second order ± | first order, same castings ± "
        "| second order, same castings ± | sampled ± | mean of samples | without equilibrium |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for run in asked.runs:
        design = pm.open_run(run).best
        problem = design.problem.with_changes({"mesh.size": asked.size}) if asked.size else design.problem
        whole = analyse_near(problem, design.body, (), design.stored, design.entry.tasks)
        for task, scatter in scatter_of(whole, Tolerances()).items():
            castings = drawn(whole, Tolerances(), asked.samples, asked.seed)
            answers = sampled(whole, task, castings)
            pairs = [pair for pair in zip(castings, answers, strict=True) if pair[1] is not None]
            motions, alike = (
                np.array([motion for _, motion in pairs]),
                of_first_order(scatter, [one for one, _ in pairs]),
            )
            missing = len(answers) - len(pairs)
            largest = scatter.deviations[: len(MOTIONS)] * ([1.0] * 3 + [10.0] * 3)
            for k in np.flatnonzero(largest > 0.1 * largest.max()):
                unit, size = ("mm", 1.0) if k < 3 else ("°", 1.0 / UNITS["°"])
                first, same = size * scatter.deviations[k], size * alike[:, k].std(ddof=1)
                found = size * motions[:, k].std(ddof=1)
                further = to_second_order(whole, task, scatter, int(k), [one for one, _ in pairs])
                second, alike_too = (
                    ("not known", "not known")
                    if further is None
                    else (f"{size * further[0]:.2f}", f"{size * further[1].std(ddof=1):.2f}")
                )
                print(
                    f"| {run}, {task} | {MOTIONS[k]} | {size * scatter.motion[k]:.2f} {unit} | {first:.2f} | {second} "
                    f"| {same:.2f} | {alike_too} | {found:.2f} | {size * motions[:, k].mean():.2f} "
                    f"| {missing} of {asked.samples} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
