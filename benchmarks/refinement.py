"""How far a finished design's motion depends on the mesh: the last design of a run, solved on meshes of several sizes.

python benchmarks/refinement.py runs/linear
"""

import sys

from pneumorph.errors import MeshError
from pneumorph.geometry import design_space
from pneumorph.mechanics import NoEquilibrium
from pneumorph.optimize.analysis import analyse, discretise
from pneumorph.problem.models import MeshSpec
from pneumorph.run import open_run
from pneumorph.run.cache import use_compilation_cache


def main() -> None:
    use_compilation_cache()
    run = open_run(sys.argv[1])
    body = run.load_design(run.latest()).body(run.problem)
    print(f"{'size mm':>7s} {'elements':>9s} {'dofs':>7s}  motion of the end-effector (mm, rad)")
    for factor in (0.75, 0.85, 1.0, 1.25, 1.5):
        size = factor * run.problem.mesh.size
        problem = run.problem.model_copy(update={"mesh": MeshSpec.model_validate({"size": f"{size} mm"})})
        space = design_space(problem, body)
        try:
            disc = discretise(problem, body)
        except MeshError as error:
            print(f"{size:7.2f} {error}")
            continue
        found = analyse(problem, space, disc, space.start)
        if isinstance(found, NoEquilibrium):
            print(f"{size:7.2f} {disc.model.elements:9d} {disc.model.size:7d}  {found.reason}")
            continue
        for name, state in found.equilibria.items():
            motion = " ".join(f"{value:9.4f}" for value in state.plate)
            print(f"{size:7.2f} {disc.model.elements:9d} {disc.model.size:7d}  {name}: {motion}", flush=True)


if __name__ == "__main__":
    main()
