"""What a graded mesh saves: errors of a motion with equal elements, and with those divided that contribute most.

    python benchmarks/grading.py [BODY:SIZE …] [--errors 3 1] [--uniform 2]

The start of every problem is solved on a coarse mesh of plain elements, and its elements are divided as a run with
`mesh.error` divides them, until the estimated error is as small as asked for. Uniform refinements of the coarse mesh
have 8 times as many elements each. All have the geometry of the coarse mesh, so the error is that of the solution
alone: it is the difference from the motion on the finest uniform refinement, extrapolated by the order that the last
two show. Contributions of elements are told with and without their signs.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from pneumorph.analysis import analyse, divided, quick_errors, to_divide
from pneumorph.analysis.analyse import DESIGN_TOLERANCE
from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.sized import largest_share
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.mechanics import Configuration, NoEquilibrium, State, Tangent, model_of, part_of, solve
from pneumorph.mechanics.solve.refined import on_refined
from pneumorph.mesh import TetMesh
from pneumorph.mesh.refine import refine
from pneumorph.problem import Problem, load
from pneumorph.problem.components import MOTIONS

ROOT = Path(__file__).resolve().parents[1]
BODIES = ("linear:5", "curved_finger:8", "dome:6")
ROUNDS = 8


def unit(at: Configuration, state: State) -> float:
    """Processor seconds of one factorisation, the middle one of three."""
    tangent, found = Tangent(at.model), []
    for _ in range(3):
        began = time.process_time()
        tangent.factorise(at, state)
        found.append(time.process_time() - began)
    return sorted(found)[1]


def refined(problem: Problem, mesh: TetMesh, at: Configuration, state: State) -> tuple[TetMesh, Configuration, State]:
    """The state on the uniform refinement of a mesh."""
    fine = refine(mesh)
    there = replace(at, model=model_of(problem, fine.mesh), X=fine.mesh.points)
    found = solve(there, Tangent(there.model), on_refined(fine, at, state), DESIGN_TOLERANCE, most=80)
    if isinstance(found, NoEquilibrium):
        raise SystemExit(found.reason)
    return fine.mesh, there, found.state


def graded(problem: Problem, found: Solved) -> Solved:
    """A mesh of which the estimated error is as small as the problem asks for."""
    for _ in range(ROUNDS):
        errors = quick_errors(problem, found.disc, found.analysis)
        if largest_share(problem, errors) <= problem.mesh.error:
            break
        marked = to_divide(problem, found.disc, found.analysis, errors)
        disc, states = divided(problem, found.disc, found.analysis, marked, ())
        space = space_of(problem, body_of(problem))
        found = Solved(problem, disc, analyse(problem, space, disc, found.analysis.phi, states))
    return found


def compared(name: str, size: float, asked: list[float], uniform: int) -> None:
    problem = load(ROOT / "examples" / f"{name}.toml", trust=True)
    problem = problem.with_changes({"mesh.size": f"{size:g} mm", "mesh.element": "quadratic"})
    near = analyse_near(problem, body_of(problem), part_of(problem))
    task = problem.task[0]
    at, state = near.analysis.configurations[task.name], near.analysis.equilibria[task.name].state
    moves = [MOTIONS.index(each) for each in task.objective.tip_motions]
    component = moves[0] if moves else int(np.abs(state.plate).argmax())
    equal = [(near.disc.morph.mesh.at(near.analysis.X), at, state)]
    for _ in range(uniform):
        equal.append(refined(problem, *equal[-1]))
    zero, one, two = (float(each[2].plate[component]) for each in equal[-3:])
    ratio = min(max((two - one) / (one - zero), 0.05), 0.6)
    exact = two + (two - one) * ratio / (1.0 - ratio)
    print(f"{name}: {MOTIONS[component]} {zero:.4g} → {exact:.4g}, order {-math.log2(ratio):.2f}")
    print("| mesh | elements | unknowns | factorisation (ms) | error (%) | unknowns of equal elements for it |")
    print("|---|---|---|---|---|---|")
    errors = [abs(each[2].plate[component] / exact - 1.0) for each in equal]
    sizes = [each[1].model.size for each in equal]

    def row(kind: str, at: Configuration, state: State) -> None:
        error = float(state.plate[component] / exact - 1.0)
        # Between the equal meshes, and beyond them, by powers.
        k = min(max(int(np.searchsorted(-np.array(errors), -abs(error))), 1), len(errors) - 1)
        slope = math.log(sizes[k] / sizes[k - 1]) / math.log(errors[k - 1] / errors[k])
        same = sizes[k] * (errors[k] / abs(error)) ** slope
        cost = f"{1e3 * unit(at, state):.0f} | {100 * error:+.2f} | {same:.0f} |"
        print(f"| {kind} | {at.model.elements} | {at.model.size} | {cost}", flush=True)

    for _, there, found in equal:
        row("equal", there, found)
    for share in asked:
        own = graded(problem.with_changes({"mesh.error": f"{share:g} %"}), near)
        row(f"{share:g} % asked", own.analysis.configurations[task.name], own.analysis.equilibria[task.name].state)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bodies", nargs="*", default=BODIES)
    parser.add_argument("--errors", type=float, nargs="+", default=[3.0, 1.0])
    parser.add_argument("--uniform", type=int, default=2, help="refinements of all elements")
    asked = parser.parse_args()
    for body in asked.bodies:
        name, size = body.split(":")
        compared(name, float(size), asked.errors, asked.uniform)


if __name__ == "__main__":
    main()
