"""Growth of time and memory with the number of unknowns: the last design of a run, solved on finer and finer meshes.

    python benchmarks/growth.py runs/linear [3.0 2.0 1.4 1.0 …]

Sizes are edge lengths in mm. The state on each mesh begins from the one on the mesh before, the first from the run's
own. A step is a design of the loop without its sub-problem: prediction, equilibrium and gradient after a motion of the
design variables by up to 0.05 mm against the gradient. Memory is the peak of the process so far, without
Netgen's, so sizes go from coarse to fine. At the end are the exponents of growth between the last two sizes.
"""

import resource
import sys
import time

import numpy as np

from pneumorph.analysis import Analysis, analyse, carry_over, design_gradient, discretise, predict_states
from pneumorph.analysis.checkpoint import unpack
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import NoEquilibrium
from pneumorph.run import open_run

SIZES = (3.0, 2.0, 1.4, 1.0)
COLUMNS = ("mesh s", "transfer s", "equilibrium s", "factorisations", "unit s", "gradient s", "step s", "peak GB")


def main(path: str, sizes: list[float]) -> None:
    run = open_run(path)
    design = run.load_design(run.result().best)
    body = design.body(run.problem)
    own = build_design_space(run.problem, starting_body(run.problem.tubes))
    disc, found = unpack(run.problem, own, run.checkpoint()[1])
    X = disc.morph.positions(own.control_points(found.phi))
    print("| size, mm | elements | unknowns | " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * (3 + len(COLUMNS)))
    rows = []
    for size in sorted(sizes, reverse=True):
        problem = run.problem.with_changes({"mesh.size": f"{size} mm"})
        space = build_design_space(problem, body)
        clock = Clock()
        finer = discretise(problem, body)
        mesh = clock.lap()
        states = {name: each.state for name, each in found.equilibria.items()}
        starts = carry_over(disc, X, states, finer, finer.morph.mesh.points)
        disc, found = finer, None  # the coarser factor is not needed any more
        transfer = clock.lap()
        found = solved(analyse(problem, space, disc, space.start, starts))
        equilibrium, factorisations = clock.lap(), disc.factorisations
        X = disc.morph.mesh.points
        (name,) = list(disc.tangents)[:1]
        at, state = found.configurations[name], found.equilibria[name].state
        clock.lap()
        disc.tangents[name].factorise(at, state)
        unit = clock.lap()
        slope = design_gradient(problem, space, disc, found)
        gradient = clock.lap()
        there = space.start - 0.05 * slope / np.abs(slope).max()
        near = solved(analyse(problem, space, disc, there, predict_states(space, disc, found, there)))
        design_gradient(problem, space, disc, near)
        step = clock.lap()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
        row = (mesh, transfer, equilibrium, factorisations, unit, gradient, step, peak)
        rows.append((disc.model.size, row))
        print(
            f"| {size:g} | {disc.model.elements} | {disc.model.size} | "
            + " | ".join(f"{each}" if isinstance(each, int) else f"{each:.2f}" for each in row)
            + " |",
            flush=True,
        )
    if len(rows) > 1:
        (fewer, before), (more, after) = rows[-2:]
        exponents = np.log(np.array(after) / np.array(before)) / np.log(more / fewer)
        print("| exponent | | | " + " | ".join(f"{each:.2f}" for each in exponents) + " |")


class Clock:
    """Seconds since the lap before."""

    def __init__(self) -> None:
        self.at = time.perf_counter()

    def lap(self) -> float:
        before, self.at = self.at, time.perf_counter()
        return self.at - before


def solved(found: Analysis | NoEquilibrium) -> Analysis:
    """The analysis, if there is one."""
    if isinstance(found, NoEquilibrium):
        sys.exit(found.reason)
    return found


if __name__ == "__main__":
    main(sys.argv[1], [float(size) for size in sys.argv[2:]] or list(SIZES))
