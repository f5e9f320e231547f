"""Dependence of results on the mesh: the last design of a run, solved on meshes of several sizes.

    python benchmarks/refinement.py runs/linear [2.0 1.5 …]

Sizes are edge lengths in mm, by default that of the problem and coarser and finer ones. The last state of the run is
transferred from its own mesh to the coarsest of them, from there to the next finer one, and so on.
"""

import sys

from pneumorph.analysis import Analysis, Discretisation, analyse, carry_over, collect_task_results, discretise
from pneumorph.analysis.checkpoint import unpack
from pneumorph.errors import MeshError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import NoEquilibrium, State
from pneumorph.problem import Problem
from pneumorph.problem.models import MeshSpec
from pneumorph.run import open_run


def main() -> None:
    run = open_run(sys.argv[1])
    latest = run.latest()
    if latest is None:
        sys.exit("there is no design in it yet")
    design = run.load_design(latest)
    body = design.body(run.problem)
    sizes = [float(size) for size in sys.argv[2:]] or [
        factor * run.problem.mesh.size for factor in (0.75, 0.85, 1.0, 1.25, 1.5)
    ]
    own = build_design_space(run.problem, starting_body(run.problem.tubes))
    disc, found = unpack(run.problem, own, run.checkpoint()[1])
    print(f"{'size mm':>7s} {'elements':>9s} {'dofs':>7s}  tasks")
    report("own", disc, found, run.problem)
    coarser = disc, disc.morph.positions(own.control_points(found.phi)), states_of(found)
    for size in sorted(sizes, reverse=True):
        tasks = tuple(
            task.model_copy(
                update={
                    "pressure": {
                        name: pressure.model_copy(update=dict.fromkeys(("start", "min", "max"), value))
                        for (name, pressure), value in zip(
                            task.pressure.items(), design.pressures[task.name].values(), strict=True
                        )
                    }
                }
            )
            for task in run.problem.task
        )
        problem = run.problem.model_copy(
            update={"mesh": MeshSpec.model_validate({"size": f"{size} mm"}), "task": tasks}
        )
        space = build_design_space(problem, body)
        try:
            disc = discretise(problem, body)
        except MeshError as error:
            print(f"{size:7.2f} {error}")
            continue
        starts = carry_over(*coarser, disc, disc.morph.mesh.points)
        found = analyse(problem, space, disc, space.start, starts)
        if isinstance(found, NoEquilibrium):
            print(f"{size:7.2f} {disc.model.elements:9d} {disc.model.size:7d}  {found.reason}")
            continue
        coarser = disc, disc.morph.mesh.points, states_of(found)
        report(f"{size:.2f}", disc, found, problem)


def states_of(found: Analysis) -> dict[str, State]:
    return {name: equilibrium.state for name, equilibrium in found.equilibria.items()}


def report(size: str, disc: Discretisation, found: Analysis, problem: Problem) -> None:
    results = collect_task_results(disc, found)
    words = ", ".join(f"{task.name} {task.objective.achieved(results[task.name])}" for task in problem.task)
    print(f"{size:>7s} {disc.model.elements:9d} {disc.model.size:7d}  {words}", flush=True)


if __name__ == "__main__":
    main()
