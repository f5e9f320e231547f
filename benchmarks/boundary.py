"""Compare the paper's boundary formula with the exact discrete gradient, on finer and finer meshes.

    python benchmarks/boundary.py [runs/linear]

It prints ‖boundary − exact‖/‖exact‖ for the gradients by all design variables, and the relative difference along a
smooth direction (a radial wave), for the starting body of the linear actuator and, with a run directory, its last
design.
"""

import sys
from pathlib import Path

import numpy as np

from pneumorph.analysis import analyse, discretise
from pneumorph.geometry import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.objective import maximize
from pneumorph.problem import Problem, load
from pneumorph.run import open_run
from pneumorph.sensitivity import boundary_gradient, gradient

EXAMPLE = Path(__file__).parents[1] / "examples" / "linear.toml"


def row(problem: Problem, body: Body) -> None:
    space = build_design_space(problem, body)
    disc = discretise(problem, body)
    analysis = analyse(problem, space, disc, space.start, tolerance=1e-9)
    task = problem.task[0]
    at, found = analysis.configurations[task.name], analysis.equilibria[task.name]
    exact = gradient(at, disc.tangents[task.name], found, maximize(task.objective.motion))
    mesh = disc.morph.mesh
    nodal = boundary_gradient(at, mesh, found, exact.adjoint)
    by_boundary = space.pullback(disc.morph.B.T @ nodal[: disc.morph.n_surface])
    by_adjoint = space.pullback(disc.morph.pullback(exact.X))
    points = body.control_points()
    wave = space.L.T @ (np.cos(2 * np.pi * (points[:, 2] - 40) / 10)[:, None] * points * [1, 1, 0]).ravel()
    error = np.linalg.norm(by_boundary - by_adjoint) / np.linalg.norm(by_adjoint)
    smooth = abs(by_boundary @ wave / (by_adjoint @ wave) - 1)
    print(f"{problem.mesh.size:7.2f} {disc.model.elements:9d} {error:12.4f} {smooth:14.5f}", flush=True)


def main() -> None:
    # The whole body: the formula has no part for the surfaces of a cut.
    problem = load(EXAMPLE).with_changes({"body.symmetry": False})
    bodies = {"start": starting_body(problem.tubes)}
    if len(sys.argv) > 1:
        run = open_run(sys.argv[1])
        bodies["last design"] = run.load_design(run.latest()).body(run.problem)
    for name, body in bodies.items():
        print(f"{name}\n{'size mm':>7s} {'elements':>9s} {'all variables':>12s} {'radial wave':>14s}")
        for size in (4.0, 3.0, 2.0, 1.5):
            row(problem.with_changes({"mesh.size": f"{size} mm"}), body)


if __name__ == "__main__":
    main()
